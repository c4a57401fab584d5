//! How probably every pixel of a silhouette shows something that is in no scan: what is changed around
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
    /// Share of the surroundings that is changed, times how far they reach the pixel.
    changed: Vec<f32>,
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
        let silhouette = dilated(alpha, size, model.gap_px);
        let outside = silhouette.iter().zip(&cut.hidden);
        let outside: Vec<f32> = outside
            .map(|(covered, hidden)| (1.0 - covered.clamp(0.0, 1.0)) * (1.0 - hidden))
            .collect();
        let changed = outside.iter().zip(&cut.changed);
        let changed: Vec<f32> = changed
            .map(|(outside, changed)| outside * changed)
            .collect();
        let spread = Spread::along(cut, size, reach_px, model.edge_sigma);
        Unknown {
            changed: spread.everywhere(&changed),
            reached: spread.everywhere(&outside),
            model: *model,
        }
    }

    /// Probability that a pixel shows something unknown; `prior` where nothing around reaches it.
    #[inline(always)]
    pub fn probability(&self, pixel: usize, prior: f32) -> f32 {
        let weight = self.model.prior_weight;
        let share = (self.changed[pixel] + weight * prior) / (self.reached[pixel] + weight);
        share.clamp(self.model.range[0], self.model.range[1])
    }

    /// The part of that which the surroundings alone account for.
    #[inline(always)]
    pub fn certain(&self, pixel: usize) -> f32 {
        self.changed[pixel] / (self.reached[pixel] + self.model.prior_weight)
    }
}

/// Edge-stopping recursive filter: along rows, then columns, and the other way round.
struct Spread {
    width: usize,
    /// What passes from the pixel before in a row, and from the one above.
    across: Vec<f32>,
    down: Vec<f32>,
    /// Makes the weights of a line without edges sum to one.
    scale: f32,
}

impl Spread {
    #[inline(always)]
    fn along(cut: &Cut, [width, height]: [usize; 2], reach_px: f32, edge_sigma: f32) -> Self {
        let kept = (-1.0 / reach_px.max(1.0)).exp();
        let sharpness = 0.5 / (edge_sigma * edge_sigma);
        let passed = |first: usize, second: usize, count: usize| -> Vec<f32> {
            let mut apart2 = vec![0.0; count];
            for plane in &cut.live {
                let pairs = plane[first..][..count]
                    .iter()
                    .zip(&plane[second..][..count]);
                for (to, (a, b)) in apart2.iter_mut().zip(pairs) {
                    *to += (a - b) * (a - b);
                }
            }
            let passed = apart2.iter();
            passed
                .map(|apart2| kept * exp(-sharpness * apart2))
                .collect()
        };
        let count = width * height;
        // The first of a row and the first row have nothing before them.
        let mut across = vec![0.0];
        across.extend(passed(1, 0, count - 1));
        for first in across.iter_mut().step_by(width) {
            *first = 0.0;
        }
        let mut down = vec![0.0; width];
        down.extend(passed(width, 0, count - width));
        Spread {
            width,
            across,
            down,
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
        let (mut right, mut left) = (values.to_vec(), values.to_vec());
        for first in (0..values.len()).step_by(self.width) {
            for pixel in first + 1..first + self.width {
                right[pixel] += self.across[pixel] * right[pixel - 1];
            }
            for pixel in (first..first + self.width - 1).rev() {
                left[pixel] += self.across[pixel + 1] * left[pixel + 1];
            }
        }
        self.sum(values, &right, &left)
    }

    #[inline(always)]
    fn over_columns(&self, values: &[f32]) -> Vec<f32> {
        let width = self.width;
        let (mut down, mut up) = (values.to_vec(), values.to_vec());
        for first in (width..values.len()).step_by(width) {
            let (above, row) = down[first - width..first + width].split_at_mut(width);
            let passed = self.down[first..][..width].iter();
            for ((to, above), passed) in row.iter_mut().zip(above).zip(passed) {
                *to += passed * *above;
            }
        }
        for first in (0..values.len() - width).step_by(width).rev() {
            let (row, below) = up[first..first + 2 * width].split_at_mut(width);
            let passed = self.down[first + width..][..width].iter();
            for ((to, below), passed) in row.iter_mut().zip(below).zip(passed) {
                *to += passed * *below;
            }
        }
        self.sum(values, &down, &up)
    }

    /// Both directions; a pixel itself counts once.
    #[inline(always)]
    fn sum(&self, values: &[f32], one: &[f32], other: &[f32]) -> Vec<f32> {
        let all = values.iter().zip(one).zip(other);
        all.map(|((value, one), other)| self.scale * (one + other - value))
            .collect()
    }
}
