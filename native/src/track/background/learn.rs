//! What some rows of a lens picture show of the empty room.
//! `tracking.solve.numpy_twin.learned_rows` says the same in numpy.

use crate::track::background::expected::Exposure;
use crate::track::picture::{filtered, slopes};

/// Coherent differences are measured in a picture this many times smaller; `tracking.learn.SHRINK`.
pub const SHRINK: usize = 4;

/// Constants of `tracking.learn` and `tracking.background`, under their names there.
#[derive(Clone, Copy)]
pub struct LearnModel {
    pub coherent_level: f32,
    /// Pixels of the small picture.
    pub coherent_side: usize,
    pub rough_side: usize,
    pub wary_side: usize,
    pub relit_ratio: [f32; 2],
    pub relit_hue: f32,
    pub blend: f32,
    pub noise_floor: f32,
    pub misalignment_px: f32,
    /// A grey object before a wall may not be taken for a shadow on it.
    pub is_cautious: bool,
}

/// Whole rows of a lens picture.
pub struct Strip<'a> {
    /// RGB.
    pub live: Vec<&'a [u8]>,
    /// RGB, 0..1: the empty room so far.
    pub background: &'a [f32],
    /// Whether a pixel was learned before.
    pub learned: &'a [bool],
    /// Whether a pixel may be learned from.
    pub usable: &'a [bool],
    /// First of the rows.
    pub top: usize,
    /// Width and height of the lens picture.
    pub lens: [usize; 2],
}

/// The same rows afterwards.
pub struct Learned {
    pub background: Vec<f32>,
    pub noise: Vec<f32>,
    pub known: Vec<bool>,
}

type Planes = [Vec<f32>; 3];

/// The background image updated with what the live picture shows of the room, its noise, and which
/// pixels were ever learned.
#[inline(always)]
pub fn learn(strip: &Strip<'_>, exposure: &Exposure, model: &LearnModel) -> Learned {
    let width = strip.lens[0];
    let size = [width, strip.live.len()];
    let small = size.map(|side| side.div_ceil(SHRINK));
    let mut background = planes_of(strip.background);
    let residual = residual(strip, &background, exposure);
    let small_residual = residual.each_ref().map(|plane| shrunk(plane, size));
    let mean = small_residual
        .each_ref()
        .map(|plane| boxed(plane, small, model.coherent_side));
    let shows_room = shows_room(&background, &mean, [size, small], model);
    let shown = Grown::new(&shows_room, small);
    let count = width * size[1];
    let (mut take, mut known) = (vec![false; count], vec![false; count]);
    let mut share = vec![0.0; width];
    for row in 0..size[1] {
        shown.row(row, &mut share);
        let here = row * width..(row + 1) * width;
        let before = strip.usable[here.clone()]
            .iter()
            .zip(&strip.learned[here.clone()]);
        let after = take[here.clone()].iter_mut().zip(&mut known[here.clone()]);
        for (((&usable, &learned), (take, known)), share) in before.zip(after).zip(&mut share) {
            *take = usable & (*share >= 0.5);
            *known = learned | *take;
            let blend = if learned { model.blend } else { 1.0 };
            *share = if *take { blend } else { 0.0 };
        }
        for (plane, residual) in background.iter_mut().zip(&residual) {
            let from = residual[here.clone()].iter().zip(&share);
            for (to, (residual, share)) in plane[here.clone()].iter_mut().zip(from) {
                *to += residual * share;
            }
        }
    }
    let mut noise = noise(&background, size, model);
    if known.contains(&false) {
        let rough = roughness(&small_residual, &mean, &take, [size, small], model);
        let rough = Grown::new(&rough, small);
        for row in 0..size[1] {
            rough.row(row, &mut share);
            let here = row * width..(row + 1) * width;
            let pixels = known[here.clone()].iter().zip(&share);
            for (noise, (&known, &rough)) in noise[here].iter_mut().zip(pixels) {
                *noise = if known { *noise } else { noise.max(rough) };
            }
        }
    }
    let [red, green, blue] = &background;
    let mut mixed = Vec::with_capacity(3 * count);
    for ((&r, &g), &b) in red.iter().zip(green).zip(blue) {
        mixed.extend([r, g, b]);
    }
    Learned {
        background: mixed,
        noise,
        known,
    }
}

/// Red, green and blue of interleaved pixels.
#[inline(always)]
fn planes_of(pixels: &[f32]) -> Planes {
    let mut planes: Planes = std::array::from_fn(|_| vec![0.0; pixels.len() / 3]);
    let [red, green, blue] = planes.each_mut();
    let to = red.iter_mut().zip(green).zip(blue);
    for (((r, g), b), rgb) in to.zip(pixels.chunks_exact(3)) {
        (*r, *g, *b) = (rgb[0], rgb[1], rgb[2]);
    }
    planes
}

/// The live picture at the background image's exposure, less that image.
#[inline(always)]
fn residual(strip: &Strip<'_>, background: &Planes, exposure: &Exposure) -> Planes {
    let [width, height] = strip.lens;
    let mut residual: Planes = background.each_ref().map(|plane| vec![0.0; plane.len()]);
    let mut live: Planes = std::array::from_fn(|_| vec![0.0; width]);
    let from_middle = |place: usize, side: usize| ((place as f32 + 0.5) / side as f32 - 0.5) * 2.0;
    for (row, pixels) in strip.live.iter().enumerate() {
        let [red, green, blue] = live.each_mut();
        let to = red.iter_mut().zip(green).zip(blue);
        for (((r, g), b), rgb) in to.zip(pixels.chunks_exact(3)) {
            (*r, *g, *b) = (f32::from(rgb[0]), f32::from(rgb[1]), f32::from(rgb[2]));
        }
        let y = from_middle(strip.top + row, height);
        let here = row * width..(row + 1) * width;
        for channel in 0..3 {
            let (gain, offset) = (exposure.gain[channel], exposure.offset[channel]);
            let falloff = exposure.falloff[channel];
            let from = live[channel].iter().zip(&background[channel][here.clone()]);
            let to = residual[channel][here.clone()].iter_mut();
            for (column, (residual, (live, background))) in to.zip(from).enumerate() {
                let x = from_middle(column, width);
                let neutral = (live / 255.0 - offset) / (gain + (x * x + y * y) * falloff);
                *residual = neutral - background;
            }
        }
    }
    residual
}

/// 1 where the live picture has no coherent difference from the background image, in the small picture.
#[inline(always)]
fn shows_room(
    background: &Planes,
    mean: &Planes,
    [size, small]: [[usize; 2]; 2],
    model: &LearnModel,
) -> Vec<f32> {
    let around = background
        .each_ref()
        .map(|plane| boxed(&shrunk(plane, size), small, model.coherent_side));
    let [low, high] = model.relit_ratio;
    let is_room = |place: usize| {
        let apart: [f32; 3] = std::array::from_fn(|channel| mean[channel][place]);
        if apart.iter().all(|a| a.abs() < model.coherent_level) {
            return true;
        }
        // The same colour is only lighter or darker: a shadow has come or gone.
        let room: [f32; 3] = std::array::from_fn(|channel| around[channel][place]);
        let live: [f32; 3] = std::array::from_fn(|channel| room[channel] + apart[channel]);
        let power = room[0] * room[0] + room[1] * room[1] + room[2] * room[2] + 1e-4;
        let ratio = (live[0] * room[0] + live[1] * room[1] + live[2] * room[2]) / power;
        let same_hue = (0..3).all(|k| (live[k] - ratio * room[k]).abs() < model.relit_hue);
        !model.is_cautious && ratio > low && ratio < high && same_hue
    };
    let shows: Vec<f32> = (0..small[0] * small[1])
        .map(|place| f32::from(u8::from(is_room(place))))
        .collect();
    if !model.is_cautious {
        return shows;
    }
    // Beside what differs there may be more of it, of colours like the room's.
    boxed(&shows, small, model.wary_side)
        .iter()
        .map(|share| f32::from(u8::from(*share > 0.999)))
        .collect()
}

/// Standard deviation expected between the background image and a live picture of the same room.
#[inline(always)]
fn noise(background: &Planes, size: [usize; 2], model: &LearnModel) -> Vec<f32> {
    let [red, green, blue] = background;
    let colours = red.iter().zip(green).zip(blue);
    let grey: Vec<f32> = colours
        .map(|((r, g), b)| 0.299 * r + 0.587 * g + 0.114 * b)
        .collect();
    let [x, y] = slopes(&grey, size);
    let steep: Vec<f32> = x
        .iter()
        .zip(&y)
        .map(|(x, y)| (x * x + y * y).sqrt())
        .collect();
    let mut noise = filtered(&steep, size, 1, &[0.2; 5]);
    let floor2 = model.noise_floor * model.noise_floor;
    for value in &mut noise {
        let moved = model.misalignment_px * *value;
        *value = (floor2 + moved * moved).sqrt();
    }
    noise
}

/// Typical difference between scan and live picture in the surroundings that were taken over.
#[inline(always)]
fn roughness(
    residual: &Planes,
    mean: &Planes,
    take: &[bool],
    [size, small]: [[usize; 2]; 2],
    model: &LearnModel,
) -> Vec<f32> {
    let weight: Vec<f32> = (0..small[0] * small[1])
        .map(|place| {
            let corner = SHRINK * (place / small[0] * size[0] + place % small[0]);
            f32::from(u8::from(take[corner]))
        })
        .collect();
    let speckle = weight.iter().enumerate().map(|(place, weight)| {
        let apart = |channel: usize| (residual[channel][place] - mean[channel][place]).abs();
        weight * ((apart(0) + apart(1) + apart(2)) / 3.0)
    });
    let total = boxed(&speckle.collect::<Vec<_>>(), small, model.rough_side);
    let count = boxed(&weight, small, model.rough_side);
    let parts = total.iter().zip(&count);
    parts
        .map(|(total, count)| total / count.max(1e-3))
        .collect()
}

/// Means of squares of `SHRINK` pixels; the last row and column are repeated to fill the last ones.
#[inline(always)]
fn shrunk(plane: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
    let [across, down] = [width.div_ceil(SHRINK), height.div_ceil(SHRINK)];
    let mut sums = vec![0.0; across * SHRINK];
    let mut small = Vec::with_capacity(across * down);
    for row in 0..down {
        sums.fill(0.0);
        for y in row * SHRINK..(row + 1) * SHRINK {
            let from = &plane[y.min(height - 1) * width..][..width];
            for (sum, value) in sums.iter_mut().zip(from) {
                *sum += value;
            }
        }
        let last = sums[width - 1];
        sums[width..].fill(last);
        let squares = sums.chunks_exact(SHRINK);
        small.extend(squares.map(|part| part.iter().sum::<f32>() / (SHRINK * SHRINK) as f32));
    }
    small
}

/// Means over squares of an odd side, the border repeated.
#[inline(always)]
fn boxed(plane: &[f32], [width, height]: [usize; 2], side: usize) -> Vec<f32> {
    let reach = side / 2;
    let share = 1.0 / (side * side) as f32;
    let mut down = vec![0.0; width + 2 * reach];
    let mut means = vec![0.0; plane.len()];
    for (row, to) in means.chunks_exact_mut(width).enumerate() {
        down.fill(0.0);
        for step in 0..side {
            let from = (row + step).saturating_sub(reach).min(height - 1);
            let from = &plane[from * width..][..width];
            for (sum, value) in down[reach..].iter_mut().zip(from) {
                *sum += value;
            }
        }
        let (first, last) = (down[reach], down[reach + width - 1]);
        down[..reach].fill(first);
        down[reach + width..].fill(last);
        for step in 0..side {
            for (sum, value) in to.iter_mut().zip(&down[step..]) {
                *sum += value;
            }
        }
        to.iter_mut().for_each(|sum| *sum *= share);
    }
    means
}

/// A small picture seen at the size it was shrunk from, linear between the squares' middles.
struct Grown<'a> {
    small: &'a [f32],
    size: [usize; 2],
}

impl<'a> Grown<'a> {
    fn new(small: &'a [f32], size: [usize; 2]) -> Self {
        Grown { small, size }
    }

    /// One row of the large picture.
    #[inline(always)]
    fn row(&self, row: usize, to: &mut [f32]) {
        let [width, height] = self.size;
        let (above, below, down) = between(row, height);
        let [above, below] = [above, below].map(|line| &self.small[line * width..][..width]);
        let mixed = |column: usize| above[column] + down * (below[column] - above[column]);
        let mut left = mixed(0);
        for (column, part) in to.chunks_mut(SHRINK).enumerate() {
            let (here, right) = (mixed(column), mixed((column + 1).min(width - 1)));
            for (k, value) in part.iter_mut().enumerate() {
                let (_, _, share) = between(SHRINK + k, 3);
                *value = match k < SHRINK / 2 {
                    true => left + share * (here - left),
                    false => here + share * (right - here),
                };
            }
            left = here;
        }
    }
}

/// The two squares that a pixel's middle lies between, and its share of the second.
#[inline(always)]
fn between(pixel: usize, squares: usize) -> (usize, usize, f32) {
    // In halves of a pixel, from the middle of the square before the first.
    let halves = 2 * pixel + 1 + SHRINK;
    let (first, part) = (halves / (2 * SHRINK), halves % (2 * SHRINK));
    let inside = |square: usize| square.saturating_sub(1).min(squares - 1);
    (
        inside(first),
        inside(first + 1),
        part as f32 / (2 * SHRINK) as f32,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_shrunk_and_grown_to_itself_inside() {
        let size = [24, 8];
        let ramp: Vec<f32> = (0..24 * 8).map(|k| (k % 24) as f32).collect();
        let small = shrunk(&ramp, size);
        assert_eq!(small[..6], [1.5, 5.5, 9.5, 13.5, 17.5, 21.5]);
        let (grown, mut row) = (Grown::new(&small, [6, 2]), vec![0.0; 24]);
        grown.row(3, &mut row);
        for (column, value) in row.iter().enumerate() {
            assert_eq!(*value, (column as f32).clamp(1.5, 21.5), "column {column}");
        }
    }

    #[test]
    fn squares_that_are_cut_off_repeat_the_border() {
        let plane: Vec<f32> = (0..5 * 5).map(|k| (k % 5) as f32).collect();
        assert_eq!(shrunk(&plane, [5, 5]), [1.5, 4.0, 1.5, 4.0]);
    }

    #[test]
    fn means_over_squares_keep_a_plain_picture_and_spread_a_point() {
        assert_eq!(boxed(&[0.5; 12], [4, 3], 3), [0.5; 12]);
        let mut point = vec![0.0; 49];
        point[24] = 9.0;
        let means = boxed(&point, [7, 7], 3);
        assert_eq!((means[24], means[16], means[8]), (1.0, 1.0, 0.0));
    }
}
