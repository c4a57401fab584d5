//! How probably every pixel of a silhouette shows something that is in no scan: foreground around
//! the silhouette goes on inside it along colours that have no edge.
//! `tests/twins/likelihood.py` says the same.

use crate::track::appearance::compared::{dilated, Cut, Part};
use crate::track::exponential::exp;

/// The constants of `tracking.likelihood.pixel_model`.
#[derive(Clone, Copy)]
pub struct UnknownModel {
    /// Difference of neighbouring colours across which half an unknown object ends.
    pub edge_sigma: f32,
    /// Weight of the prior, against surroundings without an edge between.
    pub prior_weight: f32,
    /// Lowest and highest probability.
    pub range: [f32; 2],
    /// Pixels around a silhouette that the lens blurs with it.
    pub gap_px: usize,
}

/// What the surroundings of a silhouette say of every pixel.
pub struct Unknown {
    /// Share of the surroundings that is foreground, times how far they reach the pixel.
    foreground: Vec<f32>,
    /// How far the surroundings reach the pixel, 0..1.
    reached: Vec<f32>,
    model: UnknownModel,
}

impl Unknown {
    /// Of a part of a window and the alpha of an object drawn there; surroundings count within about
    /// `reach_px`.
    #[inline(always)]
    pub fn around(
        cut: &Cut,
        alpha: &[f32],
        part: Part,
        reach_px: f32,
        model: &UnknownModel,
    ) -> Self {
        let size = [part.width, part.height];
        // What may be a part of the object is no surroundings of it.
        let claimed = alpha.iter().zip(&cut.claimed);
        let claimed: Vec<f32> = claimed
            .map(|(alpha, claimed)| alpha.max(*claimed))
            .collect();
        let silhouette = dilated(&claimed, size, model.gap_px);
        let outside = silhouette.iter().zip(&cut.hidden);
        let outside: Vec<f32> = outside
            .map(|(covered, hidden)| (1.0 - covered.clamp(0.0, 1.0)) * (1.0 - hidden))
            .collect();
        let foreground = outside.iter().zip(&cut.foreground);
        let foreground: Vec<f32> = foreground
            .map(|(outside, foreground)| outside * foreground)
            .collect();
        let spread = Spread::along(cut, size, reach_px, model.edge_sigma);
        Unknown {
            foreground: spread.everywhere(&foreground),
            reached: spread.everywhere(&outside),
            model: *model,
        }
    }

    /// Probabilities that pixels show something unknown; `prior` where nothing around reaches one.
    #[inline(always)]
    pub fn probabilities(&self, prior: f32) -> Vec<f32> {
        let (weight, [low, high]) = (self.model.prior_weight, self.model.range);
        let pixels = self.foreground.iter().zip(&self.reached);
        pixels
            .map(|(foreground, reached)| {
                ((foreground + weight * prior) / (reached + weight)).clamp(low, high)
            })
            .collect()
    }

    /// The parts of those which the surroundings alone account for.
    #[inline(always)]
    pub fn certain(&self) -> Vec<f32> {
        let weight = self.model.prior_weight;
        let pixels = self.foreground.iter().zip(&self.reached);
        pixels
            .map(|(foreground, reached)| foreground / (reached + weight))
            .collect()
    }
}

/// Edge-stopping recursive filter: along rows, then columns, and the other way round.
struct Spread {
    rows: Lines,
    columns: Lines,
    /// Makes the weights of a line without edges sum to one.
    scale: f32,
}

/// Lines side by side, along which values spread: pixels of all lines are computed at once.
struct Lines {
    /// How many there are.
    count: usize,
    /// What passes to each pixel from the one before it in its line.
    passed: Vec<f32>,
}

impl Spread {
    #[inline(always)]
    fn along(cut: &Cut, [width, height]: [usize; 2], reach_px: f32, edge_sigma: f32) -> Self {
        let kept = (-1.0 / reach_px.max(1.0)).exp();
        let sharpness = 0.5 / (edge_sigma * edge_sigma);
        // What passes to the first of a line is not read.
        let mut passed = [(); 2].map(|()| vec![0.0; width * height]);
        for (passed, ahead) in passed.iter_mut().zip([1, width]) {
            for plane in &cut.live {
                let pairs = plane.iter().zip(&plane[ahead..]);
                for (to, (a, b)) in passed[ahead..].iter_mut().zip(pairs) {
                    *to += (b - a) * (b - a);
                }
            }
            for passed in passed {
                *passed = kept * exp(-sharpness * *passed);
            }
        }
        let [across, down] = passed;
        Spread {
            rows: Lines {
                count: height,
                passed: transposed(&across, width),
            },
            columns: Lines {
                count: width,
                passed: down,
            },
            scale: (1.0 - kept) / (1.0 + kept),
        }
    }

    #[inline(always)]
    fn everywhere(&self, values: &[f32]) -> Vec<f32> {
        let one = self.over_columns(&self.over_rows(values));
        let other = self.over_rows(&self.over_columns(values));
        let both = one.iter().zip(&other);
        both.map(|(one, other)| 0.5 * (one + other)).collect()
    }

    #[inline(always)]
    fn over_rows(&self, values: &[f32]) -> Vec<f32> {
        let turned = transposed(values, self.columns.count);
        transposed(&self.rows.spread(&turned, self.scale), self.rows.count)
    }

    #[inline(always)]
    fn over_columns(&self, values: &[f32]) -> Vec<f32> {
        self.columns.spread(values, self.scale)
    }
}

impl Lines {
    /// Values spread both ways; a pixel itself counts once.
    #[inline(always)]
    fn spread(&self, values: &[f32], scale: f32) -> Vec<f32> {
        let count = self.count;
        let (mut on, mut back) = (values.to_vec(), values.to_vec());
        for first in (count..values.len()).step_by(count) {
            let (before, here) = on[first - count..first + count].split_at_mut(count);
            let passed = self.passed[first..][..count].iter();
            for ((to, before), passed) in here.iter_mut().zip(before).zip(passed) {
                *to += passed * *before;
            }
        }
        for first in (0..values.len() - count).step_by(count).rev() {
            let (here, after) = back[first..first + 2 * count].split_at_mut(count);
            let passed = self.passed[first + count..][..count].iter();
            for ((to, after), passed) in here.iter_mut().zip(after).zip(passed) {
                *to += passed * *after;
            }
        }
        let all = values.iter().zip(&on).zip(&back);
        all.map(|((value, on), back)| scale * (on + back - value))
            .collect()
    }
}

/// A picture of rows of `width` pixels, its columns as rows.
#[inline(always)]
fn transposed(values: &[f32], width: usize) -> Vec<f32> {
    let mut turned = Vec::with_capacity(values.len());
    for column in 0..width {
        turned.extend(values[column..].iter().step_by(width));
    }
    turned
}
