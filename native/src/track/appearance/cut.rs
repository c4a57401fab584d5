//! Places cut out of a lens picture, upright and all of one size.
//! `tracking.solve.numpy_twin.cut_out` says the same in numpy.

use crate::camera::lens::Lens;
use crate::track::rigid::{cross, dot, Rigid};

/// Red, green, blue, own foreground, all foreground.
pub const CHANNELS: usize = 5;

/// Pictures of at most an eighth of the size are looked at.
const LEVELS: usize = 4;

/// How places are cut out.
#[derive(Clone, Copy)]
pub struct Cutter {
    /// Pixels of a cut-out, each way.
    pub side: usize,
    /// Half of what it shows, in metres.
    pub half_m: f64,
    /// Pixels per radian of the lens.
    pub focal: f64,
    /// Of the picture.
    pub size: [usize; 2],
}

/// What is at some places; every picture is `side` × `side`.
#[derive(Default)]
pub struct Cuts {
    pub colours: Vec<f32>,
    pub own: Vec<f32>,
    pub free: Vec<f32>,
}

/// A picture at half, a quarter or an eighth of its size.
struct Level {
    values: Vec<f32>,
    width: usize,
    height: usize,
}

/// Places cut out of a picture, smoothed to the step between samples.
#[inline(always)]
pub fn cut_out<L: Lens>(
    picture: &[f32],
    lens: &L,
    world_from_lens: &Rigid,
    centres: &[f64],
    cutter: &Cutter,
) -> Cuts {
    let mut levels = vec![Level {
        values: picture.to_vec(),
        width: cutter.size[0],
        height: cutter.size[1],
    }];
    let count = cutter.side * cutter.side;
    let places = centres.len() / 3;
    let mut cuts = Cuts {
        colours: Vec::with_capacity(3 * count * places),
        own: Vec::with_capacity(count * places),
        free: Vec::with_capacity(count * places),
    };
    let mut pixels = vec![[0.0; 2]; count];
    let mut seen = vec![false; count];
    for centre in centres.chunks_exact(3) {
        let distance = project_grid(
            lens,
            world_from_lens,
            [centre[0], centre[1], centre[2]],
            cutter,
            (&mut pixels, &mut seen),
        );
        let step_px = 2.0 * cutter.half_m / cutter.side as f64 / distance * cutter.focal;
        let octave = ((step_px.max(1.0).log2() + 0.5) as usize).min(LEVELS - 1);
        while levels.len() <= octave {
            levels.push(halved(&levels[levels.len() - 1]));
        }
        let level = &levels[octave];
        let share = 1.0 / (1u32 << octave) as f64;
        for (pixel, &seen) in pixels.iter().zip(&seen) {
            let found = match seen {
                true => sampled(level, pixel.map(|place| place * share - 0.5)),
                false => [0.0; CHANNELS],
            };
            let [red, green, blue, own, foreground] = found;
            cuts.colours.extend_from_slice(&[red, green, blue]);
            cuts.own.push(own);
            let free = if seen { 1.0 } else { 0.0 };
            cuts.free.push(free * (1.0 - (foreground - own).max(0.0)));
        }
    }
    cuts
}

/// Where an upright grid about a place is seen, and whether; the place's distance.
#[inline(always)]
fn project_grid<L: Lens>(
    lens: &L,
    world_from_lens: &Rigid,
    centre: [f64; 3],
    cutter: &Cutter,
    (pixels, seen): (&mut [[f64; 2]], &mut [bool]),
) -> f64 {
    let eye = world_from_lens.translation;
    let away = [centre[0] - eye[0], centre[1] - eye[1], centre[2] - eye[2]];
    let distance = dot(away, away).sqrt();
    let level = away[0].hypot(away[1]).max(1e-9);
    let forward = away.map(|part| part / distance);
    let right = [away[1] / level, -away[0] / level, 0.0];
    let down = cross(forward, right);
    let columns = &world_from_lens.rotation;
    let in_lens = |v: [f64; 3]| {
        [0, 1, 2].map(|k| columns[0][k] * v[0] + columns[1][k] * v[1] + columns[2][k] * v[2])
    };
    let (centre, right, down) = (in_lens(away), in_lens(right), in_lens(down));
    let side = cutter.side;
    let step = |k: usize| ((k as f64 + 0.5) / side as f64 * 2.0 - 1.0) * cutter.half_m;
    let (radius, middle) = lens.circle().unwrap_or((f64::INFINITY, [0.0; 2]));
    let [width, height] = cutter.size.map(|side| side as f64);
    for row in 0..side {
        let along = step(row);
        let here = row * side..(row + 1) * side;
        let to = pixels[here.clone()].iter_mut().zip(&mut seen[here]);
        for (column, (pixel, seen)) in to.enumerate() {
            let across = step(column);
            let projected = lens.project([
                centre[0] + across * right[0] + along * down[0],
                centre[1] + across * right[1] + along * down[1],
                centre[2] + across * right[2] + along * down[2],
            ]);
            let (u, v) = (projected.u, projected.v);
            let off = [u - middle[0], v - middle[1]];
            let in_circle = off[0] * off[0] + off[1] * off[1] <= radius * radius;
            let in_picture = (u >= 0.0) & (u <= width) & (v >= 0.0) & (v <= height);
            *pixel = [u, v];
            *seen = projected.drawable & in_circle & in_picture;
        }
    }
    distance
}

/// The means of 2 × 2 pixels.
#[inline(always)]
fn halved(level: &Level) -> Level {
    let (width, height) = ((level.width / 2).max(1), (level.height / 2).max(1));
    let line = level.width * CHANNELS;
    let mut values = vec![0.0; width * height * CHANNELS];
    for (row, to) in values.chunks_exact_mut(width * CHANNELS).enumerate() {
        let below = (2 * row + 1).min(level.height - 1);
        let [above, below] = [2 * row, below].map(|row| &level.values[row * line..][..line]);
        for (column, to) in to.chunks_exact_mut(CHANNELS).enumerate() {
            let next = (2 * column + 1).min(level.width - 1) * CHANNELS;
            let here = 2 * column * CHANNELS;
            for (k, value) in to.iter_mut().enumerate() {
                let upper = above[here + k] + above[next + k];
                *value = 0.25 * (upper + below[here + k] + below[next + k]);
            }
        }
    }
    Level {
        values,
        width,
        height,
    }
}

/// Bilinear values; whole numbers are pixels' centres, and there is nothing outside.
#[inline(always)]
fn sampled(level: &Level, [x, y]: [f64; 2]) -> [f32; CHANNELS] {
    let (left, top) = (x.floor(), y.floor());
    let (across, down) = ((x - left) as f32, (y - top) as f32);
    let (left, top) = (left as isize, top as isize);
    let mut found = [0.0; CHANNELS];
    for (row, wide) in [(top, 1.0 - down), (top + 1, down)] {
        for (column, share) in [(left, 1.0 - across), (left + 1, across)] {
            let inside = row >= 0
                && column >= 0
                && row < level.height as isize
                && column < level.width as isize;
            if inside {
                let place = (row as usize * level.width + column as usize) * CHANNELS;
                let pixel = &level.values[place..place + CHANNELS];
                for (sum, value) in found.iter_mut().zip(pixel) {
                    *sum += wide * share * value;
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_halved_by_means_and_sampled_between_its_pixels() {
        let values: Vec<f32> = (0..4 * 2 * CHANNELS)
            .map(|k| (k / CHANNELS % 4) as f32)
            .collect();
        let level = Level {
            values,
            width: 4,
            height: 2,
        };
        let half = halved(&level);
        assert_eq!((half.width, half.height), (2, 1));
        assert_eq!((half.values[0], half.values[CHANNELS]), (0.5, 2.5));
        assert_eq!(sampled(&level, [1.25, 0.5])[0], 1.25);
        assert_eq!(sampled(&level, [3.5, 0.0])[0], 1.5);
        assert_eq!(sampled(&level, [-2.0, 0.0])[0], 0.0);
    }
}
