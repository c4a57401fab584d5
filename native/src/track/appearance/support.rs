//! Nats by which a window speaks for an object at a pose.
//! `tracking/likelihood/numpy_twin.py` says the same.

use crate::track::appearance::light_fit::{fitted, LightModel, LightPrior, Sample};
use crate::track::appearance::relight::{LEAST_ALPHA, LENS_BLUR_PX, LENS_TAPS};
use crate::track::exponential::{exp, ln};
use crate::track::picture::{filtered, gaussian, shrunk};

/// The constants of `tracking.likelihood.pose_likelihood`.
#[derive(Clone, Copy)]
pub struct SupportModel {
    pub light: LightModel,
    pub light_sigma: [f64; 3],
    pub foreign: f32,
    pub behind_m: f32,
    pub behind_share: f32,
    pub least_px: f64,
    pub least_changed: f32,
    pub least_lit: usize,
    pub residual_sigma: f32,
    pub most_misfit: f32,
}

/// How a pose is compared: where it is drawn, and how exactly it has to be right.
#[derive(Clone, Copy)]
pub struct Terms {
    pub part: Part,
    /// Reach of its surroundings.
    pub ring_px: usize,
    /// Pixels that share one error.
    pub shared_px2: f64,
    pub sigma: f32,
    pub most_misfit: f32,
    pub occluded: f32,
}

/// A window's pictures, interleaved colours or one value per pixel, rows of `width` pixels.
#[derive(Clone, Copy)]
pub struct Window<'a> {
    pub width: usize,
    pub live: &'a [f32],
    pub empty: &'a [f32],
    pub expected: &'a [f32],
    pub changed: &'a [f32],
    pub room_misfit: &'a [f32],
    pub foreign_misfit: &'a [f32],
    pub hidden: &'a [f32],
    pub range_m: &'a [f32],
    /// Whether the room may be in another light than it was scanned in.
    pub is_first: bool,
}

/// The part of a window in which an object is drawn.
#[derive(Clone, Copy)]
pub struct Part {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
}

/// An object drawn alone in that part, `finer` pixels each way per pixel of it: as scanned, and
/// coloured by where it faces.
#[derive(Clone, Copy)]
pub struct Drawn<'a> {
    pub finer: usize,
    pub rgb: &'a [f32],
    pub alpha: &'a [f32],
    pub depth: &'a [f32],
    pub compass: &'a [f32],
    pub compass_alpha: &'a [f32],
}

/// What is said of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Support {
    pub nats: f64,
    pub samples: f64,
    pub open_fraction: f64,
    pub matched_fraction: f64,
    pub area_px: f64,
}

/// A drawn object at the part's own pixels, blurred like the lens.
struct Seen {
    rgb: Vec<f32>,
    alpha: Vec<f32>,
    depth: Vec<f32>,
    facing: Vec<f32>,
}

/// What all comparisons share.
struct Comparison<'a> {
    terms: &'a Terms,
    model: &'a SupportModel,
}

/// A part of a window, without gaps between its rows.
struct Cut {
    live: Vec<f32>,
    empty: Vec<f32>,
    expected: Vec<f32>,
    changed: Vec<f32>,
    room_misfit: Vec<f32>,
    foreign_misfit: Vec<f32>,
    hidden: Vec<f32>,
    range_m: Vec<f32>,
}

impl Cut {
    #[inline(always)]
    fn of(window: &Window, part: Part) -> Cut {
        let rows = |values: &[f32], channels: usize| {
            let line = part.width * channels;
            let mut cut = Vec::with_capacity(part.height * line);
            for row in part.top..part.top + part.height {
                cut.extend_from_slice(
                    &values[(row * window.width + part.left) * channels..][..line],
                );
            }
            cut
        };
        Cut {
            live: rows(window.live, 3),
            empty: rows(window.empty, 3),
            expected: rows(window.expected, 3),
            changed: rows(window.changed, 1),
            room_misfit: rows(window.room_misfit, 1),
            foreign_misfit: rows(window.foreign_misfit, 1),
            hidden: rows(window.hidden, 1),
            range_m: rows(window.range_m, 1),
        }
    }
}

/// What a window says for an object that is drawn at a pose.
#[inline(always)]
pub fn support(window: &Window, drawn: &Drawn, terms: &Terms, model: &SupportModel) -> Support {
    let part = terms.part;
    let cut = Cut::of(window, part);
    let seen = seen(drawn, part, model);
    let silhouette = silhouette(&seen, &cut, model);
    let (area_px, open_px) = (total(&seen.alpha), total(&silhouette));
    if open_px < model.least_px {
        return Support {
            open_fraction: open_px / area_px.max(model.least_px),
            area_px,
            ..Support::default()
        };
    }
    let comparison = Comparison { terms, model };
    let (ratio, matched_px) = comparison.against_absence(&cut, &seen, &silhouette);
    let ring = ring(&seen.alpha, &cut.hidden, part, terms.ring_px);
    let relit = comparison.relit_nats(&cut, &silhouette, &ring);
    // Once the room's light has been learned, a shade is sooner a passer-by's: it takes evidence
    // for the object away, and is none that the object has left.
    let least = match window.is_first {
        true => f64::NEG_INFINITY,
        false => ratio.min(0.0),
    };
    Support {
        nats: ratio.min(ratio - relit).max(least),
        samples: open_px / terms.shared_px2,
        open_fraction: open_px / area_px,
        matched_fraction: matched_px / open_px,
        area_px,
    }
}

/// An object as the window's pixels would see it.
#[inline(always)]
fn seen(drawn: &Drawn, part: Part, model: &SupportModel) -> Seen {
    let (size, finer) = ([part.width, part.height], drawn.finer);
    let lens: [f32; LENS_TAPS] = gaussian(LENS_BLUR_PX);
    let colours = |values: &[f32]| shrunk::<3>(values, size, finer);
    let shares = |values: &[f32]| shrunk::<1>(values, size, finer);
    let (compass, known) = (colours(drawn.compass), shares(drawn.compass_alpha));
    let mut facing = vec![0.0; compass.len()];
    for (pixel, to) in facing.chunks_exact_mut(3).enumerate() {
        // The foot has no normals: it was scanned with the shadow it stood in.
        if known[pixel] > model.light.seen {
            for axis in 0..3 {
                to[axis] = 2.0 * compass[3 * pixel + axis] / known[pixel].max(LEAST_ALPHA) - 1.0;
            }
        }
    }
    let mut depth = Vec::with_capacity(part.width * part.height);
    for row in drawn.depth.chunks_exact(part.width * finer).step_by(finer) {
        depth.extend(row.iter().step_by(finer));
    }
    Seen {
        rgb: filtered(&colours(drawn.rgb), size, 3, &lens),
        alpha: filtered(&shares(drawn.alpha), size, 1, &lens),
        depth,
        facing,
    }
}

/// How much of every pixel an object covers that neither the room nor a tracked object hides.
#[inline(always)]
fn silhouette(seen: &Seen, cut: &Cut, model: &SupportModel) -> Vec<f32> {
    let mut silhouette = vec![0.0; seen.alpha.len()];
    for (pixel, to) in silhouette.iter_mut().enumerate() {
        let range_m = cut.range_m[pixel];
        let reach_m = range_m * (1.0 + model.behind_share) + model.behind_m;
        let is_behind = range_m > 0.0 && seen.depth[pixel] > reach_m;
        let free = if is_behind {
            0.0
        } else {
            1.0 - cut.hidden[pixel]
        };
        *to = seen.alpha[pixel] * free;
    }
    silhouette
}

/// How much of every pixel around a silhouette is in its surroundings, which nothing hides.
#[inline(always)]
fn ring(alpha: &[f32], hidden: &[f32], part: Part, ring_px: usize) -> Vec<f32> {
    let mut ring = dilated(alpha, [part.width, part.height], ring_px);
    for (pixel, to) in ring.iter_mut().enumerate() {
        let beside = 1.0 - alpha[pixel].clamp(0.0, 1.0);
        *to = to.clamp(0.0, 1.0) * beside * (1.0 - hidden[pixel]);
    }
    ring
}

/// The largest value within `reach` pixels, along rows and along columns.
#[inline(always)]
fn dilated(values: &[f32], [width, height]: [usize; 2], reach: usize) -> Vec<f32> {
    let mut across = values.to_vec();
    for (from, to) in values
        .chunks_exact(width)
        .zip(across.chunks_exact_mut(width))
    {
        for step in 1..=reach.min(width - 1) {
            for (to, value) in to.iter_mut().zip(&from[step..]) {
                *to = to.max(*value);
            }
            for (to, value) in to[step..].iter_mut().zip(from) {
                *to = to.max(*value);
            }
        }
    }
    let mut down = across.clone();
    for (row, to) in down.chunks_exact_mut(width).enumerate() {
        for from in row.saturating_sub(reach)..=(row + reach).min(height - 1) {
            for (to, value) in to.iter_mut().zip(&across[from * width..]) {
                *to = to.max(*value);
            }
        }
    }
    down
}

/// Colours as they are seen, from which a light is fitted: over black as scanned, where they face,
/// as the live picture shows them, and their weights.
struct Lit<'a> {
    rgb: &'a [f32],
    facing: &'a [f32],
    shown: &'a [f32],
    weight: &'a [f32],
}

impl Comparison<'_> {
    /// Log likelihood ratio of an object against its absence; pixels that it accounts for.
    #[inline(always)]
    fn against_absence(&self, cut: &Cut, seen: &Seen, silhouette: &[f32]) -> (f64, f64) {
        let Comparison { terms, model } = self;
        let count = silhouette.len();
        let (mut behind, mut shown) = (vec![0.0; 3 * count], vec![0.0; 3 * count]);
        let mut weight = vec![0.0; count];
        for pixel in 0..count {
            let through = 1.0 - seen.alpha[pixel];
            for at in 3 * pixel..3 * pixel + 3 {
                behind[at] = through * cut.empty[at];
                shown[at] = cut.live[at] - behind[at];
            }
            weight[pixel] = silhouette[pixel] * cut.changed[pixel].max(model.least_changed);
        }
        let (gains, light_nats) = self.gains(&Lit {
            rgb: &seen.rgb,
            facing: &seen.facing,
            shown: &shown,
            weight: &weight,
        });
        let most = terms.most_misfit;
        let wider = 0.5 / (terms.sigma * terms.sigma);
        let least = (-most).exp();
        let (mut sum, mut matched) = (0.0, 0.0);
        for (pixel, &covered) in silhouette.iter().enumerate() {
            let apart2 = squared(pixel, |at| {
                cut.live[at] - seen.rgb[at] * gains[at] - behind[at]
            });
            let misfit = (wider * apart2).min(model.most_misfit).min(most);
            let as_object = exp(-misfit);
            let as_foreign = self.as_foreign(cut, pixel);
            let as_room = exp(-cut.room_misfit[pixel].min(most));
            // What hides the object would have to look like the room behind it.
            let changed = cut.changed[pixel];
            let as_occluder = changed * as_foreign + (1.0 - changed) * least;
            let absent = (1.0 - model.foreign) * as_room + model.foreign * as_foreign;
            let present = (1.0 - terms.occluded) * as_object + terms.occluded * as_occluder;
            sum += f64::from(covered * (ln(present) - ln(absent)));
            matched += f64::from(covered * as_object);
        }
        (sum / self.terms.shared_px2 + light_nats, matched)
    }

    /// Nats by which the room in another light accounts better for a place than the room as it was.
    ///
    /// Light does not change in the shape of one object: what surrounds the silhouette is in it, too.
    #[inline(always)]
    fn relit_nats(&self, cut: &Cut, silhouette: &[f32], ring: &[f32]) -> f64 {
        let Comparison { terms, model } = self;
        let part = terms.part;
        let here: Vec<f32> = silhouette.iter().zip(ring).map(|(a, b)| a + b).collect();
        let mut across = vec![0.0; 3 * here.len()];
        for (pixel, to) in across.chunks_exact_mut(3).enumerate() {
            to[0] = from_edge_to_edge(pixel % part.width, part.width);
            to[1] = from_edge_to_edge(pixel / part.width, part.height);
        }
        let (gains, light_nats) = self.gains(&Lit {
            rgb: &cut.expected,
            facing: &across,
            shown: &cut.live,
            weight: &here,
        });
        // A pose that is off makes no room lighter: no tolerance here.
        let exact = 0.5 / (model.residual_sigma * model.residual_sigma);
        let most = self.terms.most_misfit;
        let (mut inside, mut around) = (0.0, 0.0);
        for pixel in 0..here.len() {
            let apart2 = squared(pixel, |at| cut.live[at] - cut.expected[at] * gains[at]);
            let misfit = (exact * apart2).min(model.most_misfit).min(most);
            let foreign = model.foreign * self.as_foreign(cut, pixel);
            let familiar = 1.0 - model.foreign;
            let relit = ln(familiar * exp(-misfit) + foreign);
            let same = ln(familiar * exp(-cut.room_misfit[pixel].min(most)) + foreign);
            inside += f64::from(silhouette[pixel] * (relit - same));
            around += f64::from(ring[pixel] * (relit - same));
        }
        // Around an object that is there, the light may have changed as well.
        (inside + around.min(0.0)) / self.terms.shared_px2 + light_nats
    }

    /// Likelihood of a pixel as something that is in no scan.
    #[inline(always)]
    fn as_foreign(&self, cut: &Cut, pixel: usize) -> f32 {
        let wider = self.model.residual_sigma / self.terms.sigma;
        exp(-(wider * wider * cut.foreign_misfit[pixel]).min(self.terms.most_misfit))
    }

    /// Gains, three a pixel, of the likeliest light, and the log of its prior, 0 at most.
    #[inline(always)]
    fn gains(&self, lit: &Lit) -> (Vec<f32>, f64) {
        let model = self.model;
        let here: Vec<usize> = (0..lit.weight.len())
            .filter(|&pixel| lit.weight[pixel] > model.light.seen)
            .collect();
        if here.len() < model.least_lit {
            return (vec![1.0; lit.rgb.len()], 0.0);
        }
        let every = (here.len() / model.light.enough_px).max(1);
        let at = |values: &[f32], pixel: usize| -> [f64; 3] {
            std::array::from_fn(|k| f64::from(values[3 * pixel + k]))
        };
        let samples: Vec<Sample> = here
            .iter()
            .step_by(every)
            .map(|&pixel| {
                let [x, y, z] = at(lit.facing, pixel);
                Sample {
                    rgb: at(lit.rgb, pixel),
                    sides: [1.0, x, y, z],
                    seen: at(lit.shown, pixel),
                    weight: f64::from(lit.weight[pixel]),
                }
            })
            .collect();
        let sigma2 = f64::from(model.residual_sigma).powi(2);
        let prior = LightPrior {
            sigma: model.light_sigma,
            pixel_information: every as f64 / (sigma2 * self.terms.shared_px2),
        };
        let light = fitted(&samples, &model.light, Some(&prior));
        let [even, x, y, z] = light.by_side.map(|value| value as f32);
        let tint = light.tint.map(|value| value as f32);
        let [low, high] = model.light.range;
        let mut gains = vec![0.0; lit.rgb.len()];
        for (to, facing) in gains.chunks_exact_mut(3).zip(lit.facing.chunks_exact(3)) {
            let gain = even + x * facing[0] + y * facing[1] + z * facing[2];
            for channel in 0..3 {
                to[channel] = (gain + tint[channel]).clamp(low, high);
            }
        }
        (gains, prior.nats(&light))
    }
}

/// Square of the distance of a pixel's three channels.
#[inline(always)]
fn squared(pixel: usize, apart: impl Fn(usize) -> f32) -> f32 {
    let channels = (3 * pixel..3 * pixel + 3).map(apart);
    channels.map(|apart| apart * apart).sum()
}

/// -1 at the first of some pixels, 1 at the last.
#[inline(always)]
fn from_edge_to_edge(index: usize, count: usize) -> f32 {
    2.0 * index as f32 / (count - 1).max(1) as f32 - 1.0
}

#[inline(always)]
fn total(values: &[f32]) -> f64 {
    values.iter().map(|&value| f64::from(value)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_value_nearby_is_found_up_to_the_border() {
        let mut values = vec![0.0; 5 * 4];
        values[5 + 3] = 1.0;
        let found = dilated(&values, [5, 4], 1);
        for (pixel, value) in found.into_iter().enumerate() {
            let (column, row) = (pixel % 5, pixel / 5);
            let is_near = column >= 2 && row <= 2;
            assert_eq!(value, f32::from(u8::from(is_near)), "{column}, {row}");
        }
        assert_eq!(dilated(&values, [5, 4], 9), vec![1.0; 20]);
    }
}
