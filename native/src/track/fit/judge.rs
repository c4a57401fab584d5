//! Scores of a pose in one window. The NumPy reference, which says why, is
//! `tracking.likelihood.contour_support`.

use crate::camera::lens::Lens;
use crate::track::exponential::exp;
use crate::track::fit::edges::{Edge, CHANNELS};
use crate::track::fit::solve::{triple, Problem};
use crate::track::picture::Picture;
use crate::track::rigid::{in_frame, Rigid};

/// Channels of a window's pixel; see `edges::CHANNELS`.
const FOREGROUND: usize = 3;
const OWN: usize = 4;
const HIDDEN: usize = 5;

/// Constants of `tracking.likelihood.contour_support`, under their names there.
#[derive(Clone, Copy)]
pub struct JudgeModel {
    pub reach_px: f64,
    pub agree_px: f64,
    pub misfit_cutoff: f64,
    pub together_px: f32,
    pub least_together: usize,
    pub least_shown: usize,
    pub detail_px: f32,
}

/// Points evenly over a drawn silhouette, in the object's frame, and their colours.
#[derive(Clone, Copy)]
pub struct Surface<'a> {
    pub points: &'a [f64],
    pub colours: &'a [f32],
}

/// What was found, as in `tracking.likelihood.contour_support`.
pub struct Judgement {
    /// Share of contour points with an edge within `agree_px`.
    pub inlier_ratio: f64,
    /// Share of contour points with no other object on either side.
    pub free_share: f64,
    /// Sum of robust squares of edge offsets (Tukey), in independent points.
    pub misfit: f64,
    /// Mean robust square of the edges found.
    pub roughness: f64,
    /// Variance of sums of neighbouring residuals over what a solve assumes, at least 1.
    pub variance_inflation: f64,
    /// Shares of surface points that show the object, and that something else covers.
    pub visible_fraction: f64,
    pub covered_fraction: f64,
    /// Correlation of drawn and live colours on the visible surface, -1..1; 0 where too little is seen.
    pub correlation: f64,
}

impl<L: Lens> Problem<'_, L> {
    /// Scores a pose, without changing it.
    #[inline(always)]
    pub fn judge(
        &self,
        at: &Rigid,
        silhouette_bias: f64,
        surface: &Surface<'_>,
        is_textured: bool,
        model: &JudgeModel,
    ) -> Judgement {
        let edges = self.edges(at, silhouette_bias, model.reach_px);
        let mut found = self.outline_judged(at, &edges, model);
        let pixels = surface.points.chunks_exact(3);
        let pixels: Vec<[f64; 2]> = pixels
            .map(|point| self.pixel(at, [point[0], point[1], point[2]]))
            .collect();
        let shown = surface_shown(&self.window, &self.smooth, &pixels, surface.colours);
        found.visible_fraction = shown.visible_fraction;
        found.covered_fraction = shown.covered_fraction;
        if shown.live.len() >= model.least_shown {
            found.correlation = match is_textured {
                true => shown.in_detail(model.detail_px).correlation(),
                false => shown.correlation(),
            };
        }
        found
    }

    #[inline(always)]
    fn pixel(&self, at: &Rigid, point: [f64; 3]) -> [f64; 2] {
        let in_camera = in_frame(&self.camera_from_world, in_frame(at, point));
        let seen = self.lens.project(in_camera);
        [seen.u, seen.v]
    }

    #[inline(always)]
    fn outline_judged(&self, at: &Rigid, edges: &[Edge], model: &JudgeModel) -> Judgement {
        let worst = model.misfit_cutoff * model.misfit_cutoff / 3.0;
        let (mut agrees, mut free, mut misfit, mut seen_loss) = (0, 0, 0.0, 0.0);
        let (mut pixels, mut residuals) = (Vec::new(), Vec::new());
        for (k, edge) in edges.iter().enumerate() {
            if edge.covered || edge.foreign {
                continue;
            }
            free += 1;
            if !edge.found {
                misfit += worst;
                continue;
            }
            let residual = edge.offset / edge.sigma;
            let relative = (residual / model.misfit_cutoff).abs().min(1.0);
            // Tukey's loss, scaled to be a square near 0.
            let left = 1.0 - relative * relative;
            let loss = worst * (1.0 - left * left * left);
            agrees += usize::from(edge.offset.abs() < model.agree_px);
            misfit += loss;
            seen_loss += loss;
            let pixel = self.pixel(at, triple(self.outline.points, k));
            pixels.push(pixel.map(|side| side as f32));
            residuals.push(residual.clamp(-model.misfit_cutoff, model.misfit_cutoff));
        }
        let count = edges.len().max(1) as f64;
        let correlation = self.model.contour_correlation;
        Judgement {
            inlier_ratio: agrees as f64 / count,
            free_share: f64::from(free) / count,
            misfit: misfit / correlation,
            roughness: match residuals.len() {
                0 if edges.is_empty() => 0.0,
                0 => worst,
                seen => seen_loss / seen as f64,
            },
            variance_inflation: variance_inflation(&pixels, &residuals, correlation, model),
            visible_fraction: 0.0,
            covered_fraction: 0.0,
            correlation: 0.0,
        }
    }
}

/// Variance of sums of neighbouring residuals over what a solve assumes, at least 1.
#[inline(always)]
fn variance_inflation(
    pixels: &[[f32; 2]],
    residuals: &[f64],
    correlation: f64,
    model: &JudgeModel,
) -> f64 {
    if residuals.len() < model.least_together {
        return 1.0;
    }
    let near2 = model.together_px * model.together_px;
    let (x, y): (Vec<f32>, Vec<f32>) = pixels.iter().map(|[x, y]| (*x, *y)).unzip();
    let values: Vec<f32> = residuals.iter().map(|value| *value as f32).collect();
    let mut together = 0.0;
    for k in 0..values.len() {
        let (mut count, mut sum) = (0.0f32, 0.0f32);
        for i in 0..values.len() {
            let apart2 = (x[i] - x[k]) * (x[i] - x[k]) + (y[i] - y[k]) * (y[i] - y[k]);
            let near = f32::from(u8::from(apart2 < near2));
            count += near;
            sum += near * values[i];
        }
        together += f64::from(sum) * f64::from(sum) / f64::from(count);
    }
    let power: f64 = residuals.iter().map(|value| value * value).sum();
    (together / power.max(1e-9 * residuals.len() as f64) / correlation).max(1.0)
}

/// What a window shows of a surface: fractions of its points, and the points that show the object
/// itself.
struct Shown {
    visible_fraction: f64,
    covered_fraction: f64,
    pixels: Vec<[f32; 2]>,
    live: Vec<[f32; 3]>,
    drawn: Vec<[f32; 3]>,
}

#[inline(always)]
fn surface_shown(
    window: &Picture<'_, CHANNELS>,
    smooth: &Picture<'_, 3>,
    pixels: &[[f64; 2]],
    colours: &[f32],
) -> Shown {
    let (mut visible_fraction, mut covered_fraction) = (0, 0);
    let (mut at, mut live, mut drawn) = (Vec::new(), Vec::new(), Vec::new());
    for (k, pixel) in pixels.iter().enumerate() {
        let seen = window.sample(*pixel);
        let (foreground, own, hidden) = (seen[FOREGROUND], seen[OWN], seen[HIDDEN]);
        visible_fraction += u32::from(own * (1.0 - hidden) > 0.35);
        covered_fraction += u32::from((foreground - own).max(hidden) > 0.5);
        if own > 0.35 && hidden < 0.5 {
            at.push(pixel.map(|side| side as f32));
            live.push(smooth.sample(*pixel));
            drawn.push(triple(colours, k));
        }
    }
    let count = pixels.len().max(1) as f64;
    Shown {
        visible_fraction: f64::from(visible_fraction) / count,
        covered_fraction: f64::from(covered_fraction) / count,
        pixels: at,
        live,
        drawn,
    }
}

impl Shown {
    /// The same with colours less those of each point's surroundings.
    #[inline(always)]
    fn in_detail(self, detail_px: f32) -> Shown {
        let falling = -0.5 / (detail_px * detail_px);
        let (x, y): (Vec<f32>, Vec<f32>) = self.pixels.iter().map(|[x, y]| (*x, *y)).unzip();
        let mut weights = vec![0.0f32; x.len()];
        let (mut live, mut drawn) = (self.live.clone(), self.drawn.clone());
        for k in 0..x.len() {
            let (here_x, here_y) = (x[k], y[k]);
            for (weight, (x, y)) in weights.iter_mut().zip(x.iter().zip(&y)) {
                let apart2 = (x - here_x) * (x - here_x) + (y - here_y) * (y - here_y);
                *weight = exp(falling * apart2);
            }
            let total: f32 = weights.iter().sum();
            for (values, to) in [(&self.live, &mut live[k]), (&self.drawn, &mut drawn[k])] {
                let mut around = [0.0f32; 3];
                for (value, weight) in values.iter().zip(&weights) {
                    for channel in 0..3 {
                        around[channel] += weight * value[channel];
                    }
                }
                for channel in 0..3 {
                    to[channel] -= around[channel] / total;
                }
            }
        }
        Shown {
            live,
            drawn,
            ..self
        }
    }

    /// -1..1: correlation of the drawn colours with the live ones, about their means.
    #[inline(always)]
    fn correlation(&self) -> f64 {
        let (a, b) = (mean(&self.drawn), mean(&self.live));
        let (mut both, mut own, mut other) = (0.0, 0.0, 0.0);
        for (drawn, live) in self.drawn.iter().zip(&self.live) {
            for channel in 0..3 {
                let first = f64::from(drawn[channel]) - a[channel];
                let second = f64::from(live[channel]) - b[channel];
                both += first * second;
                own += first * first;
                other += second * second;
            }
        }
        let norm = (own * other).sqrt();
        match norm > 1e-9 {
            true => both / norm,
            false => 0.0,
        }
    }
}

#[inline(always)]
fn mean(colours: &[[f32; 3]]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for colour in colours {
        for (sum, value) in sums.iter_mut().zip(colour) {
            *sum += f64::from(*value);
        }
    }
    sums.map(|sum| sum / colours.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: JudgeModel = JudgeModel {
        reach_px: 4.0,
        agree_px: 1.6,
        misfit_cutoff: 5.0,
        together_px: 12.0,
        least_together: 12,
        least_shown: 12,
        detail_px: 3.0,
    };

    #[test]
    fn a_side_that_is_off_makes_its_points_say_less() {
        let pixels: Vec<[f32; 2]> = (0..100).map(|k| [k as f32, 0.0]).collect();
        let apart: Vec<f64> = (0..100).map(|k| f64::from(k % 2) - 0.5).collect();
        let grouped: Vec<f64> = (0..100).map(|k| f64::from(k / 50) - 0.5).collect();
        assert_eq!(variance_inflation(&pixels, &apart, 3.0, &MODEL), 1.0);
        assert!(variance_inflation(&pixels, &grouped, 3.0, &MODEL) > 2.0);
        assert_eq!(
            variance_inflation(&pixels[..5], &grouped[..5], 3.0, &MODEL),
            1.0
        );
    }

    #[test]
    fn detail_does_not_see_what_is_smooth() {
        let place = |k: usize| [(k % 20) as f32, (k / 20) as f32];
        let colours = |slope: f32| -> Vec<[f32; 3]> {
            let value = |k: usize| f32::from(k as u8 % 2) * 0.2 + slope * place(k)[1];
            (0..400).map(|k| [value(k); 3]).collect()
        };
        let shown = Shown {
            visible_fraction: 1.0,
            covered_fraction: 0.0,
            pixels: (0..400).map(place).collect(),
            live: colours(0.05),
            drawn: colours(-0.05),
        };
        assert!(shown.correlation() < 0.0);
        assert!(shown.in_detail(3.0).correlation() > 0.5);
    }
}
