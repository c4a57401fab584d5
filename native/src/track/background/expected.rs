//! What a window of a lens picture would show if nothing had changed: the empty room at the lens's
//! exposure, with the other objects drawn into it.

use std::ops::Range;

/// A window of a lens picture: its pixels are the means of `shrink` × `shrink` of the lens.
#[derive(Clone, Copy)]
pub struct Window {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
    pub shrink: usize,
    /// Width and height of the lens picture.
    pub lens: [usize; 2],
}

/// The exposure model of a live picture, given the background image: `background · (gain + falloff
/// · r²) + offset`.
#[derive(Clone, Copy)]
pub struct Exposure {
    pub gain: [f32; 3],
    pub falloff: [f32; 3],
    pub offset: [f32; 3],
}

/// What a window is cut from, at the lens's pixels: one slice a row.
pub struct Cut<'a> {
    /// RGB.
    pub live: Vec<&'a [u8]>,
    /// RGB, 0..1: the empty room.
    pub background: Vec<&'a [f32]>,
    /// Standard deviation of a channel.
    pub noise: Vec<&'a [f32]>,
}

/// Another object as it is drawn into a rectangle of the lens picture.
#[derive(Clone, Copy)]
pub struct Layer<'a> {
    pub left: isize,
    pub top: isize,
    pub width: usize,
    pub height: usize,
    /// RGB over black.
    pub rgb: &'a [f32],
    pub alpha: &'a [f32],
    /// Whether it hides what the window is about, 0 or 1.
    pub nearer: &'a [f32],
}

/// A picture's red, green and blue, one after the other.
pub(crate) type Planes = [Vec<f32>; 3];

/// What the window's pixels are compared with.
pub(crate) struct Expected {
    pub(crate) live: Planes,
    pub(crate) room: Planes,
    pub(crate) noise: Vec<f32>,
    pub(crate) hidden: Vec<f32>,
}

fn planes(pixels: usize) -> Planes {
    std::array::from_fn(|_| vec![0.0; pixels])
}

/// Live picture, room at its exposure and noise, averaged over the shrunk pixels.
#[inline(always)]
pub(crate) fn expected(cut: &Cut<'_>, window: &Window, exposure: &Exposure) -> Expected {
    let (width, shrink) = (window.width, window.shrink);
    let pixels = width * window.height;
    let mut seen = Expected {
        live: planes(pixels),
        room: planes(pixels),
        noise: vec![0.0; pixels],
        hidden: vec![0.0; pixels],
    };
    for row in 0..window.height {
        let here = row * width..(row + 1) * width;
        for y in row * shrink..(row + 1) * shrink {
            add_shrunk(&mut seen.live, here.clone(), cut.live[y], shrink);
            add_shrunk(&mut seen.room, here.clone(), cut.background[y], shrink);
            let parts = cut.noise[y].chunks_exact(shrink);
            for (to, part) in seen.noise[here.clone()].iter_mut().zip(parts) {
                *to += part.iter().sum::<f32>();
            }
        }
    }
    let share = 1.0 / (shrink * shrink) as f32;
    for plane in &mut seen.live {
        plane.iter_mut().for_each(|v| *v *= share * (1.0 / 255.0));
    }
    seen.noise
        .iter_mut()
        .for_each(|v| *v = (*v * share).max(1e-3));
    let [across, down] = window.lens.map(|side| 2.0 / side as f32);
    let middle = |first: usize, k: usize| first as f32 + (k as f32 + 0.5) * shrink as f32;
    for (channel, plane) in seen.room.iter_mut().enumerate() {
        let (gain, offset) = (exposure.gain[channel], exposure.offset[channel]);
        for (row, room) in plane.chunks_exact_mut(width).enumerate() {
            let y = middle(window.top, row) * down - 1.0;
            for (column, value) in room.iter_mut().enumerate() {
                let x = middle(window.left, column) * across - 1.0;
                let gain = gain + (x * x + y * y) * exposure.falloff[channel];
                *value = *value * share * gain + offset;
            }
        }
    }
    seen
}

/// Adds a row of RGB pixels to those that so many of them make one of.
#[inline(always)]
fn add_shrunk<T: Copy + Into<f32>>(to: &mut Planes, here: Range<usize>, from: &[T], shrink: usize) {
    let [red, green, blue] = to.each_mut().map(|plane| &mut plane[here.clone()]);
    let to = red.iter_mut().zip(green).zip(blue);
    // A constant length lets the compiler take several pixels at once.
    if shrink == 1 {
        for (((r, g), b), rgb) in to.zip(from.chunks_exact(3)) {
            *r += rgb[0].into();
            *g += rgb[1].into();
            *b += rgb[2].into();
        }
        return;
    }
    for (((r, g), b), part) in to.zip(from.chunks_exact(3 * shrink)) {
        for rgb in part.chunks_exact(3) {
            *r += rgb[0].into();
            *g += rgb[1].into();
            *b += rgb[2].into();
        }
    }
}

/// The window's pixels along one side that a layer's may reach.
#[inline(always)]
fn reached(first: usize, count: usize, shrink: usize, from: isize, size: usize) -> Range<usize> {
    let (low, shrink) = (from - first as isize, shrink as isize);
    let inside = |place: isize| place.clamp(0, count as isize) as usize;
    let high = low + size as isize;
    inside(low.div_euclid(shrink))..inside((high + shrink - 1).div_euclid(shrink))
}

/// Draws another object into what is expected.
#[inline(always)]
pub(crate) fn lay(
    seen: &mut Expected,
    layer: &Layer<'_>,
    window: &Window,
    exposure: &Exposure,
    neighbour_noise: f32,
) {
    let (width, shrink) = (window.width, window.shrink);
    let share = 1.0 / (shrink * shrink) as f32;
    let rows = reached(window.top, window.height, shrink, layer.top, layer.height);
    let columns = reached(window.left, width, shrink, layer.left, layer.width);
    let mut line = Line::default();
    for row in rows {
        line.sum(layer, window, row, &columns);
        let here = row * width + columns.start..row * width + columns.end;
        for (channel, plane) in seen.room.iter_mut().enumerate() {
            let (gain, offset) = (exposure.gain[channel], exposure.offset[channel]);
            let drawn = line.rgb[channel].iter().zip(&line.alpha);
            for (room, (drawn, alpha)) in plane[here.clone()].iter_mut().zip(drawn) {
                let alpha = alpha * share;
                *room = *room * (1.0 - alpha) + drawn * share * gain + offset * alpha;
            }
        }
        for (hidden, nearer) in seen.hidden[here].iter_mut().zip(&line.nearer) {
            *hidden = hidden.max(nearer * share);
        }
        // The edge of what is drawn may be a pixel off.
        let from = columns.start.saturating_sub(1);
        let past = (columns.end + 1).min(width);
        let widened = line.widened(columns.start - from);
        for beside in row.saturating_sub(1)..(row + 2).min(window.height) {
            let noise = &mut seen.noise[beside * width + from..beside * width + past];
            for (noise, alpha) in noise.iter_mut().zip(&widened) {
                *noise = noise.max(neighbour_noise * (alpha * share));
            }
        }
    }
}

/// Sums of a layer over a row of a window's pixels.
#[derive(Default)]
struct Line {
    rgb: Planes,
    alpha: Vec<f32>,
    nearer: Vec<f32>,
}

impl Line {
    #[inline(always)]
    fn sum(&mut self, layer: &Layer<'_>, window: &Window, row: usize, columns: &Range<usize>) {
        let [red, green, blue] = &mut self.rgb;
        let sums = [red, green, blue, &mut self.alpha, &mut self.nearer];
        let [red, green, blue, alpha, nearer] = sums.map(|sums| {
            sums.clear();
            sums.resize(columns.len(), 0.0);
            &mut sums[..]
        });
        let shrink = window.shrink as isize;
        let top = (window.top + row * window.shrink) as isize - layer.top;
        let left = (window.left + columns.start * window.shrink) as isize - layer.left;
        let right = left + columns.len() as isize * shrink;
        let (first, last) = (left.max(0), right.min(layer.width as isize));
        for y in top.max(0)..(top + shrink).min(layer.height as isize) {
            let line = y as usize * layer.width;
            for x in first..last {
                let place = line + x as usize;
                // A constant divisor lets the compiler take several pixels at once.
                let k = match shrink {
                    1 => x - left,
                    _ => (x - left) / shrink,
                } as usize;
                red[k] += layer.rgb[3 * place];
                green[k] += layer.rgb[3 * place + 1];
                blue[k] += layer.rgb[3 * place + 2];
                alpha[k] += layer.alpha[place];
                nearer[k] += layer.alpha[place] * layer.nearer[place];
            }
        }
    }

    /// The largest alpha of every pixel and its two neighbours, from `before` pixels before the first
    /// to one after the last.
    #[inline(always)]
    fn widened(&self, before: usize) -> Vec<f32> {
        let count = self.alpha.len();
        let mut padded = vec![0.0; count + 4];
        padded[2..count + 2].copy_from_slice(&self.alpha);
        let mut largest = vec![0.0; count + 2];
        for (k, value) in largest.iter_mut().enumerate() {
            *value = padded[k].max(padded[k + 1]).max(padded[k + 2]);
        }
        largest.split_off(1 - before)
    }
}
