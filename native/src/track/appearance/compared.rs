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
    pub foreground: &'a [f32],
    pub room_misfit: &'a [f32],
    pub foreign_misfit: &'a [f32],
    pub hidden: &'a [f32],
    /// How much of every pixel the object may cover at another of the poses that are compared.
    pub claimed: &'a [f32],
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
    /// Empty where the room is in the light that it is expected in.
    pub expected: Planes,
    pub changed: Vec<f32>,
    pub foreground: Vec<f32>,
    pub room_misfit: Vec<f32>,
    pub foreign_misfit: Vec<f32>,
    pub hidden: Vec<f32>,
    pub claimed: Vec<f32>,
    pub range_m: Vec<f32>,
}

impl Cut {
    #[inline(always)]
    pub fn of(window: &Window, part: Part) -> Cut {
        let across = window.width;
        Cut {
            live: part.colours(window.live, across),
            empty: part.colours(window.empty, across),
            expected: match window.in_any_light {
                true => part.colours(window.expected, across),
                false => Planes::default(),
            },
            changed: part.values(window.changed, across),
            foreground: part.values(window.foreground, across),
            room_misfit: part.values(window.room_misfit, across),
            foreign_misfit: part.values(window.foreign_misfit, across),
            hidden: part.values(window.hidden, across),
            claimed: part.values(window.claimed, across),
            range_m: part.values(window.range_m, across),
        }
    }
}

impl Part {
    /// Of a picture with one value per pixel, rows of `across` pixels.
    #[inline(always)]
    fn values(&self, values: &[f32], across: usize) -> Vec<f32> {
        let mut part = Vec::with_capacity(self.height * self.width);
        for row in self.top..self.top + self.height {
            part.extend_from_slice(&values[row * across + self.left..][..self.width]);
        }
        part
    }

    /// Of a picture with interleaved colours.
    #[inline(always)]
    fn colours(&self, values: &[f32], across: usize) -> Planes {
        let mut part = [(); 3].map(|()| vec![0.0; self.height * self.width]);
        let [red, green, blue] = &mut part;
        let rows = red.chunks_exact_mut(self.width);
        let rows = rows.zip(green.chunks_exact_mut(self.width));
        let rows = rows.zip(blue.chunks_exact_mut(self.width));
        for (row, ((red, green), blue)) in rows.enumerate() {
            let from = 3 * ((self.top + row) * across + self.left);
            separate(&values[from..][..3 * self.width], [red, green, blue]);
        }
        part
    }
}

/// An object as the window's pixels would see it.
#[inline(always)]
pub fn seen(drawn: &Drawn, part: Part, least_known: f32) -> Seen {
    let (size, finer) = ([part.width, part.height], drawn.finer);
    let known = at_own_pixels(drawn.compass_alpha.to_vec(), size, finer);
    // Loops: what an array is made from by a function is compiled without vector instructions.
    let mut facing = planes(drawn.compass);
    for facing in &mut facing {
        *facing = at_own_pixels(std::mem::take(facing), size, finer);
        for (axis, &known) in facing.iter_mut().zip(&known) {
            // The foot has no normals: it was scanned with the shadow it stood in.
            let is_known = known > least_known;
            let towards = 2.0 * *axis / known.max(MIN_ALPHA) - 1.0;
            *axis = if is_known { towards } else { 0.0 };
        }
    }
    let mut rgb = planes(drawn.rgb);
    for plane in &mut rgb {
        *plane = blurred(&at_own_pixels(std::mem::take(plane), size, finer), size);
    }
    let mut depth = Vec::with_capacity(part.width * part.height);
    for row in drawn.depth.chunks_exact(part.width * finer).step_by(finer) {
        depth.extend(row.iter().step_by(finer));
    }
    Seen {
        rgb,
        alpha: blurred(&at_own_pixels(drawn.alpha.to_vec(), size, finer), size),
        depth,
        facing,
    }
}

/// A plane blurred like the lens.
#[inline(always)]
fn blurred(plane: &[f32], size: [usize; 2]) -> Vec<f32> {
    let lens: [f32; LENS_TAPS] = gaussian(LENS_BLUR_PX);
    filtered(plane, size, 1, &lens)
}

/// Interleaved colours, channel by channel.
#[inline(always)]
fn planes(values: &[f32]) -> Planes {
    let mut planes = [(); 3].map(|()| vec![0.0; values.len() / 3]);
    separate(values, planes.each_mut().map(Vec::as_mut_slice));
    planes
}

/// Writes interleaved colours, as many as there is room for, channel by channel.
#[inline(always)]
fn separate(values: &[f32], [red, green, blue]: [&mut [f32]; 3]) {
    let (pixels, _) = values.as_chunks::<3>();
    let to = red.iter_mut().zip(green).zip(blue);
    for (((red, green), blue), pixel) in to.zip(pixels) {
        (*red, *green, *blue) = (pixel[0], pixel[1], pixel[2]);
    }
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
    let count = 2 * reach + 1;
    // Rows apart, as one line: none sees another.
    let apart = width + 2 * reach;
    let mut lines = vec![0.0; height * apart];
    for (line, row) in lines
        .chunks_exact_mut(apart)
        .zip(values.chunks_exact(width))
    {
        line[reach..][..width].copy_from_slice(row);
    }
    largest_of_next(&mut lines, count, 1);
    let mut down = vec![0.0; (height + 2 * reach) * width];
    let rows = down[reach * width..].chunks_exact_mut(width);
    for (row, line) in rows.zip(lines.chunks_exact(apart)) {
        row.copy_from_slice(&line[..width]);
    }
    largest_of_next(&mut down, count, width);
    down.truncate(values.len());
    down
}

/// Every value becomes the largest of `count` values, itself and those after it, `stride` apart; the
/// last ones, which have fewer after them, are spoilt. Of twice as many it is the largest of two.
#[inline(always)]
fn largest_of_next(values: &mut [f32], count: usize, stride: usize) {
    let mut ahead = Vec::with_capacity(values.len());
    let mut reached = 1;
    while reached < count {
        let step = reached.min(count - reached);
        // Copied, so that several are done at once: none is read after it was written.
        ahead.clear();
        ahead.extend_from_slice(values.get(step * stride..).unwrap_or_default());
        for (value, ahead) in values.iter_mut().zip(&ahead) {
            *value = if *ahead > *value { *ahead } else { *value };
        }
        reached += step;
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
