//! The pictures that the likelihood compares: a part of a window, and an object drawn into it, channel
//! by channel, so that several pixels are computed at once.
//! `tests/twins/likelihood.py` says the same.

use crate::track::appearance::relight::{LENS_BLUR_PX, LENS_TAPS, MIN_ALPHA};
use crate::track::picture::{filtered, gaussian, shrunk};

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
    /// Whether the room may be in another light here than it is expected in.
    pub in_any_light: bool,
}

/// How much farther than the static room a surface is behind it: metres, and share of the distance.
#[derive(Clone, Copy)]
pub struct Behind {
    pub m: f32,
    pub share: f32,
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

/// Red, green and blue, one value per pixel in each: several pixels are computed at once.
pub type Planes = [Vec<f32>; 3];

/// A drawn object at the part's own pixels, blurred like the lens.
pub struct Seen {
    pub rgb: Planes,
    pub alpha: Vec<f32>,
    pub depth: Vec<f32>,
    pub facing: Planes,
}

/// A part of a window, without gaps between its rows.
pub struct Cut {
    pub live: Planes,
    pub empty: Planes,
    pub expected: Planes,
    pub changed: Vec<f32>,
    pub room_misfit: Vec<f32>,
    pub foreign_misfit: Vec<f32>,
    pub hidden: Vec<f32>,
    pub range_m: Vec<f32>,
}

impl Cut {
    #[inline(always)]
    pub fn of(window: &Window, part: Part) -> Cut {
        let rows = part.top..part.top + part.height;
        let plain = |values: &[f32]| {
            let mut cut = Vec::with_capacity(part.height * part.width);
            for row in rows.clone() {
                cut.extend_from_slice(&values[row * window.width + part.left..][..part.width]);
            }
            cut
        };
        let colours = |values: &[f32]| -> Planes {
            std::array::from_fn(|channel| {
                let mut cut = Vec::with_capacity(part.height * part.width);
                for row in rows.clone() {
                    let line = &values[3 * (row * window.width + part.left)..][..3 * part.width];
                    cut.extend(line.chunks_exact(3).map(|pixel| pixel[channel]));
                }
                cut
            })
        };
        Cut {
            live: colours(window.live),
            empty: colours(window.empty),
            expected: colours(window.expected),
            changed: plain(window.changed),
            room_misfit: plain(window.room_misfit),
            foreign_misfit: plain(window.foreign_misfit),
            hidden: plain(window.hidden),
            range_m: plain(window.range_m),
        }
    }
}

/// An object as the window's pixels would see it.
#[inline(always)]
pub fn seen(drawn: &Drawn, part: Part, least_known: f32) -> Seen {
    let (size, finer) = ([part.width, part.height], drawn.finer);
    let lens: [f32; LENS_TAPS] = gaussian(LENS_BLUR_PX);
    let blurred = |plane: Vec<f32>| filtered(&plane, size, 1, &lens);
    let known = at_own_pixels(drawn.compass_alpha.to_vec(), size, finer);
    let facing = planes(drawn.compass).map(|plane| {
        let mut facing = at_own_pixels(plane, size, finer);
        for (axis, &known) in facing.iter_mut().zip(&known) {
            // The foot has no normals: it was scanned with the shadow it stood in.
            let is_known = known > least_known;
            let towards = 2.0 * *axis / known.max(MIN_ALPHA) - 1.0;
            *axis = if is_known { towards } else { 0.0 };
        }
        facing
    });
    let mut depth = Vec::with_capacity(part.width * part.height);
    for row in drawn.depth.chunks_exact(part.width * finer).step_by(finer) {
        depth.extend(row.iter().step_by(finer));
    }
    Seen {
        rgb: planes(drawn.rgb).map(|plane| blurred(at_own_pixels(plane, size, finer))),
        alpha: blurred(at_own_pixels(drawn.alpha.to_vec(), size, finer)),
        depth,
        facing,
    }
}

/// Interleaved colours, channel by channel.
#[inline(always)]
fn planes(values: &[f32]) -> Planes {
    std::array::from_fn(|channel| values.chunks_exact(3).map(|pixel| pixel[channel]).collect())
}

/// A plane drawn finer than a picture of `size`, averaged.
#[inline(always)]
fn at_own_pixels(plane: Vec<f32>, size: [usize; 2], finer: usize) -> Vec<f32> {
    match finer {
        1 => plane,
        _ => shrunk::<1>(&plane, size, finer),
    }
}

/// How much of every pixel an object covers that neither the room nor a tracked object hides.
#[inline(always)]
pub fn silhouette(seen: &Seen, cut: &Cut, behind: Behind) -> Vec<f32> {
    let room = cut.range_m.iter().zip(&cut.hidden);
    let object = seen.alpha.iter().zip(&seen.depth);
    let pixels = object.zip(room);
    pixels
        .map(|((alpha, &depth), (&range_m, hidden))| {
            let reach_m = range_m * (1.0 + behind.share) + behind.m;
            let is_behind = range_m > 0.0 && depth > reach_m;
            alpha * if is_behind { 0.0 } else { 1.0 - hidden }
        })
        .collect()
}

/// How much of every pixel around a silhouette is in its surroundings, which nothing hides.
#[inline(always)]
pub fn ring(alpha: &[f32], hidden: &[f32], part: Part, ring_px: usize) -> Vec<f32> {
    let mut ring = dilated(alpha, [part.width, part.height], ring_px);
    for (to, (alpha, hidden)) in ring.iter_mut().zip(alpha.iter().zip(hidden)) {
        *to = to.clamp(0.0, 1.0) * (1.0 - alpha.clamp(0.0, 1.0)) * (1.0 - hidden);
    }
    ring
}

/// The largest of values of 0 at least within `reach` pixels, along rows and along columns.
#[inline(always)]
pub fn dilated(values: &[f32], [width, height]: [usize; 2], reach: usize) -> Vec<f32> {
    let mut across = Vec::with_capacity(values.len());
    let mut line = vec![0.0; width + 2 * reach];
    for row in values.chunks_exact(width) {
        line.fill(0.0);
        line[reach..][..width].copy_from_slice(row);
        largest_of_next(&mut line, 2 * reach + 1, 1);
        across.extend_from_slice(&line[..width]);
    }
    let mut down = vec![0.0; (height + 2 * reach) * width];
    down[reach * width..][..values.len()].copy_from_slice(&across);
    largest_of_next(&mut down, 2 * reach + 1, width);
    down.truncate(values.len());
    down
}

/// Every value becomes the largest of `count` values, itself and those after it, `stride` apart; the
/// last ones, which have fewer after them, are spoilt. Of twice as many it is the largest of two.
#[inline(always)]
fn largest_of_next(values: &mut [f32], count: usize, stride: usize) {
    let mut reached = 1;
    while reached < count {
        let ahead = reached.min(count - reached);
        for at in 0..values.len().saturating_sub(ahead * stride) {
            values[at] = values[at].max(values[at + ahead * stride]);
        }
        reached += ahead;
    }
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
