//! Similarity score of a small object that is rendered over the background and the live picture.
//! The NumPy reference is `tracking/model/similarity.py`.

use std::sync::OnceLock;

use crate::track::appearance::relight::Seen;
use crate::track::picture::{filtered, gaussian};

/// Standard deviation of the lens's blur, px, and the taps of its filter; as in `tracking.resemblance`.
const LENS_BLUR_PX: f32 = 0.6;
const LENS_TAPS: usize = 5;
/// Standard deviation, px, of the blur that detail is what differs from; taps of its filter.
const DETAIL_PX: f32 = 3.0;
const DETAIL_TAPS: usize = 19;
/// The same for a close comparison.
const CLOSE_PX: f32 = 1.0;
const CLOSE_TAPS: usize = 7;
/// Smallest sum of squares that a correlation divides by.
const MIN_POWER: f32 = 1e-6;

/// Constants of `tracking.resemblance`, under their names there: the colour distance at which a
/// pixel counts as half changed, the alpha above which it shows the object, and pixels of doubt.
#[derive(Clone, Copy)]
pub struct SimilarityModel {
    pub strange: f32,
    pub on_object: f32,
    pub doubt_px: f64,
    pub closely: bool,
}

/// A part of the live picture, and what it would show without the object.
pub struct Setting {
    size: [usize; 2],
    live: Vec<f32>,
    empty: Vec<f32>,
    free: Vec<f32>,
    model: SimilarityModel,
    known: OnceLock<Known>,
}

/// What is the same for whatever is drawn.
struct Known {
    live_detail: Vec<f32>,
    empty_detail: Vec<f32>,
    changed_px: f64,
}

/// A drawn object over the empty room.
struct Shown {
    rgb: Vec<f32>,
    alpha: Vec<f32>,
}

impl Setting {
    /// Colours are interleaved, `free` has one value per pixel, `size` is width and height.
    pub fn new(
        live: &[f32],
        empty: &[f32],
        free: &[f32],
        size: [usize; 2],
        model: SimilarityModel,
    ) -> Self {
        Setting {
            size,
            live: live.to_vec(),
            empty: empty.to_vec(),
            free: free.to_vec(),
            model,
            known: OnceLock::new(),
        }
    }

    /// What is the same for whatever is drawn, computed when it is first asked for.
    #[inline(always)]
    fn known(&self) -> &Known {
        if let Some(known) = self.known.get() {
            return known;
        }
        // Out of the closure below, which is compiled without vector instructions.
        let known = Known {
            live_detail: detail(&self.live, self.size, self.model.closely),
            empty_detail: detail(&self.empty, self.size, self.model.closely),
            changed_px: changed_px_between(&self.empty, &self.live, &self.free, self.model.strange),
        };
        self.known.get_or_init(|| known)
    }

    /// Width and height.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The pictures, for the light in them.
    pub fn seen(&self) -> Seen<'_> {
        Seen {
            size: self.size,
            live: &self.live,
            empty: &self.empty,
            free: &self.free,
        }
    }

    /// Pixels, in fractions too, in which the live picture differs from the rendering over the
    /// background.
    #[inline(always)]
    pub fn unexplained_px(&self, rgb: &[f32], alpha: &[f32]) -> f64 {
        let shown = self.shown(rgb, alpha);
        changed_px_between(&shown.rgb, &self.live, &self.free, self.model.strange)
    }

    /// Similarity score of a rendered object and the live picture: at most 1, about 0 by chance.
    /// The mean of the share of changed pixels that it explains and of the correlation of detail
    /// gained over the background's.
    #[inline(always)]
    pub fn similarity(&self, rgb: &[f32], alpha: &[f32]) -> f64 {
        let shown = self.shown(rgb, alpha);
        let lens: [f32; LENS_TAPS] = gaussian(LENS_BLUR_PX);
        let around = filtered(&shown.alpha, self.size, 1, &lens);
        let on_object = self.free.iter().zip(&around);
        let on_object: Vec<f32> = on_object
            .map(|(free, alpha)| {
                if *alpha > self.model.on_object {
                    *free
                } else {
                    0.0
                }
            })
            .collect();
        let drawn = detail(&shown.rgb, self.size, self.model.closely);
        let Known {
            live_detail,
            empty_detail,
            ..
        } = self.known();
        let shared = detail_correlation(&drawn, live_detail, &on_object);
        let without = detail_correlation(empty_detail, live_detail, &on_object);
        0.5 * (self.share_explained(&shown.rgb) + shared - without.max(0.0))
    }

    #[inline(always)]
    fn shown(&self, rgb: &[f32], alpha: &[f32]) -> Shown {
        let mut drawn = Vec::with_capacity(4 * alpha.len());
        for (rgb, alpha) in rgb.chunks_exact(3).zip(alpha) {
            drawn.extend_from_slice(&[rgb[0], rgb[1], rgb[2], *alpha]);
        }
        let lens: [f32; LENS_TAPS] = gaussian(LENS_BLUR_PX);
        let drawn = filtered(&drawn, self.size, 4, &lens);
        let mut shown = Shown {
            rgb: Vec::with_capacity(rgb.len()),
            alpha: Vec::with_capacity(alpha.len()),
        };
        let pixels = drawn.chunks_exact(4).zip(self.empty.chunks_exact(3));
        for (drawn, empty) in pixels {
            let through = 1.0 - drawn[3];
            let rgb: [f32; 3] = std::array::from_fn(|k| drawn[k] + through * empty[k]);
            shown.rgb.extend_from_slice(&rgb);
            shown.alpha.push(drawn[3]);
        }
        shown
    }

    /// 1 if the picture is as shown, 0 if it is as near to what is there without the object.
    #[inline(always)]
    fn share_explained(&self, shown: &[f32]) -> f64 {
        let strange = self.model.strange;
        let covered = changed_px_between(&self.empty, shown, &self.free, strange);
        let most = self.known().changed_px.max(covered);
        let left = changed_px_between(shown, &self.live, &self.free, strange);
        (most - left) / (most + self.model.doubt_px)
    }
}

/// Sum over pixels of how much two pictures differ there, 0..1, times `free`.
#[inline(always)]
fn changed_px_between(first: &[f32], second: &[f32], free: &[f32], strange: f32) -> f64 {
    let pixels = first.chunks_exact(3).zip(second.chunks_exact(3)).zip(free);
    let each = pixels.map(|((a, b), free)| {
        let apart2: f32 = (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum();
        f64::from(free * apart2 / (apart2 + strange * strange))
    });
    each.sum()
}

/// What differs from its surroundings.
#[inline(always)]
fn detail(picture: &[f32], size: [usize; 2], closely: bool) -> Vec<f32> {
    let mut smooth = if closely {
        filtered(picture, size, 3, &gaussian::<CLOSE_TAPS>(CLOSE_PX))
    } else {
        filtered(picture, size, 3, &gaussian::<DETAIL_TAPS>(DETAIL_PX))
    };
    for (smooth, value) in smooth.iter_mut().zip(picture) {
        *smooth = value - *smooth;
    }
    smooth
}

/// Correlation of detail, -1..1, by weight; lower where the strengths differ.
#[inline(always)]
fn detail_correlation(first: &[f32], second: &[f32], weight: &[f32]) -> f64 {
    let (mut both, mut power) = (0.0, 0.0);
    let pixels = first.chunks_exact(3).zip(second.chunks_exact(3));
    for ((a, b), weight) in pixels.zip(weight) {
        let (mut shared, mut own) = (0.0, 0.0);
        for k in 0..3 {
            shared += a[k] * b[k];
            own += a[k] * a[k] + b[k] * b[k];
        }
        both += f64::from(weight * shared);
        power += f64::from(weight * own);
    }
    2.0 * both / power.max(f64::from(MIN_POWER))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [24, 20];
    const MODEL: SimilarityModel = SimilarityModel {
        strange: 0.15,
        on_object: 0.1,
        doubt_px: 8.0,
        closely: false,
    };

    /// A striped square on black, its left side at `left`.
    fn square(left: usize) -> (Vec<f32>, Vec<f32>) {
        let (mut rgb, mut alpha) = (vec![0.0; 3 * 480], vec![0.0; 480]);
        for row in 6..14 {
            for column in left..left + 8 {
                alpha[row * 24 + column] = 1.0;
                let stripe = if (column - left) % 4 < 2 { 0.9 } else { 0.3 };
                rgb[3 * (row * 24 + column)..][..3].fill(stripe);
            }
        }
        (rgb, alpha)
    }

    #[test]
    fn the_drawn_place_scores_higher_than_one_beside_it() {
        let (rgb, alpha) = square(8);
        let grey = vec![0.5; 3 * 480];
        let free = vec![1.0; 480];
        let plain = Setting::new(&grey, &grey, &free, SIZE, MODEL);
        let live = plain.shown(&rgb, &alpha).rgb;
        let setting = Setting::new(&live, &grey, &free, SIZE, MODEL);
        let (beside, beside_alpha) = square(10);
        assert!(setting.similarity(&rgb, &alpha) > 0.8);
        assert!(setting.similarity(&beside, &beside_alpha) < 0.5);
        assert!(
            setting.unexplained_px(&rgb, &alpha) < setting.unexplained_px(&beside, &beside_alpha)
        );
    }
}
