//! What of a drawing is kept: its outline, its picture at the window's own pixels, points on it.
//! `tests/twins/reduction.py` says the same.

use crate::camera::lens::Lens;
use crate::track::contour::{along, contour, lifted, Contour, Drawn};
use crate::track::picture::{filtered, gaussian, shrunk, Picture};

/// Alpha above which a pixel is the silhouette's, and solid.
const SILHOUETTE: f32 = 0.5;
const SOLID: f32 = 0.9;
/// How far from what is not solid the picture is taken to be the surface's, px.
const FROM_EDGE: usize = 2;

/// Standard deviation, px, of the blur before colours are picked, and the taps of its filter.
const BLUR_PX: f32 = 0.8;
const BLUR_TAPS: usize = 7;
/// The colour inside a contour is taken at most so far from it, px, where so much is covered.
const DEEP_PX: f64 = 2.0;
const MIN_COVERED: f32 = 0.3;
const MIN_ALPHA: f32 = 1e-6;

/// How much is kept of a drawing; see `tracking.kernels.reduction`.
#[derive(Clone, Copy)]
pub struct OutlineModel {
    /// Pixels of the drawing, each way, per pixel of the window.
    pub finer: usize,
    pub trim_px: usize,
    pub fewest: usize,
    pub most: usize,
    pub around_px2: f64,
    pub reach_px: f64,
}

/// A drawing's outline, and its picture where it shows anything.
pub struct Outlined {
    /// Left, top, width and height in the window.
    pub part: [usize; 4],
    /// The contour's, counted from the part's corner.
    pub pixels: Vec<[f64; 2]>,
    /// Widths in pixels of the window; colours are those of the drawing.
    pub contour: Contour,
    pub rgb: Vec<f32>,
    pub alpha: Vec<f32>,
    pub depth: Vec<f32>,
}

/// Finds the outline of a drawing and shrinks what it shows to the window's own pixels.
#[inline(always)]
pub fn outlined<L: Lens>(drawn: &Drawn<'_>, lens: &L, model: &OutlineModel) -> Outlined {
    let finer = model.finer;
    let alpha = drawn.alpha.values;
    let area = alpha.iter().filter(|&&alpha| alpha > SILHOUETTE).count();
    let around = (model.around_px2 * area as f64).sqrt() as usize / finer;
    let limit = around.clamp(model.fewest, model.most);
    let mut contour = contour(drawn, lens, limit, model.reach_px * finer as f64);
    let scale = 1.0 / finer as f64;
    for width in contour.inner.iter_mut().chain(&mut contour.outer) {
        *width *= scale;
    }
    let part = shown(drawn, model);
    let [left, top, ..] = part;
    let pixels = contour.pixels.iter();
    let pixels = pixels.map(|[x, y]| [scale * x - left as f64, scale * y - top as f64]);
    let pixels = pixels.collect();
    let [rgb, alpha, depth] = seen(drawn, part, finer);
    Outlined {
        part,
        pixels,
        contour,
        rgb,
        alpha,
        depth,
    }
}

/// Left, top, width and height of what shows anything, with a margin, in the window's pixels.
#[inline(always)]
fn shown(drawn: &Drawn<'_>, model: &OutlineModel) -> [usize; 4] {
    let Picture {
        values,
        width,
        height,
    } = drawn.alpha;
    let mut columns = vec![0.0; width];
    let mut rows = Vec::with_capacity(height);
    for row in values.chunks_exact(width) {
        let mut most = 0.0f32;
        for (column, &alpha) in columns.iter_mut().zip(row) {
            *column = alpha.max(*column);
            most = alpha.max(most);
        }
        rows.push(most);
    }
    let [left, right] = within(&columns, model);
    let [top, bottom] = within(&rows, model);
    [left, top, right - left, bottom - top]
}

/// From which pixel of the window to which something shows, with a margin.
fn within(most: &[f32], model: &OutlineModel) -> [usize; 2] {
    let shows = |alpha: &f32| *alpha > 0.0;
    let first = most.iter().position(shows).unwrap_or(0);
    let last = most.iter().rposition(shows).unwrap_or(0);
    let end = last / model.finer + 1 + model.trim_px;
    [
        (first / model.finer).saturating_sub(model.trim_px),
        end.min(most.len() / model.finer),
    ]
}

/// Colours, alpha and depth of a part of the drawing at the window's own pixels: what a lens makes
/// of it.
#[inline(always)]
fn seen(drawn: &Drawn<'_>, part: [usize; 4], finer: usize) -> [Vec<f32>; 3] {
    let (width, fine) = (drawn.alpha.width, part.map(|side| finer * side));
    let rgb = cut(drawn.rgb.values, width, fine, 3);
    let alpha = cut(drawn.alpha.values, width, fine, 1);
    let mut depth = cut(drawn.depth, width, fine, 1);
    if finer == 1 {
        return [rgb, alpha, depth];
    }
    for (depth, alpha) in depth.iter_mut().zip(&alpha) {
        *depth *= alpha;
    }
    let size = [part[2], part[3]];
    let alpha = shrunk::<1>(&alpha, size, finer);
    let mut depth = shrunk::<1>(&depth, size, finer);
    for (depth, alpha) in depth.iter_mut().zip(&alpha) {
        *depth /= alpha.max(MIN_ALPHA);
    }
    [shrunk::<3>(&rgb, size, finer), alpha, depth]
}

/// Some columns and rows of a picture: left, top, width and height.
#[inline(always)]
fn cut(values: &[f32], width: usize, part: [usize; 4], channels: usize) -> Vec<f32> {
    let [left, top, wide, high] = part;
    let rows = values.chunks_exact(channels * width).skip(top).take(high);
    let mut kept = Vec::with_capacity(channels * wide * high);
    for row in rows {
        kept.extend_from_slice(&row[channels * left..][..channels * wide]);
    }
    kept
}

/// How many points of a surface are kept, and which have structure.
#[derive(Clone, Copy)]
pub struct SurfaceModel {
    pub most_texture: usize,
    pub most_surface: usize,
    pub least_slope: f32,
}

/// A contour where it lies in a picture.
#[derive(Clone, Copy)]
pub struct Line<'a> {
    pub pixels: &'a [[f64; 2]],
    pub normals: &'a [[f64; 2]],
    pub inner: &'a [f64],
}

/// Points on a drawn object in camera axes, and how it looks there.
#[derive(Default)]
pub struct Looks {
    pub contour_colours: Vec<[f32; 3]>,
    pub texture_points: Vec<[f64; 3]>,
    pub texture_values: Vec<[f32; 3]>,
    /// Change per pixel along x and y, channel by channel.
    pub texture_slopes: Vec<[[f32; 2]; 3]>,
    pub surface_points: Vec<[f64; 3]>,
    pub surface_colours: Vec<[f32; 3]>,
    /// Pixels of the silhouette.
    pub area_px: usize,
}

/// Picks points of a drawing: with structure, evenly over the silhouette, and inside the contour.
#[inline(always)]
pub fn looks<L: Lens>(drawn: &Drawn<'_>, lens: &L, line: Line<'_>, model: &SurfaceModel) -> Looks {
    let (width, height) = (drawn.alpha.width, drawn.alpha.height);
    let kernel: [f32; BLUR_TAPS] = gaussian(BLUR_PX);
    let smooth = filtered(drawn.rgb.values, [width, height], 3, &kernel);
    let colour = |place: usize| {
        [
            smooth[3 * place],
            smooth[3 * place + 1],
            smooth[3 * place + 2],
        ]
    };
    let lifted_at = |place: usize| {
        let pixel = [(place % width) as f64 + 0.5, (place / width) as f64 + 0.5];
        lifted(lens, pixel, f64::from(drawn.depth[place]))
    };
    let mut found = Looks::default();
    for ((&pixel, normal), inner) in line.pixels.iter().zip(line.normals).zip(line.inner) {
        let deep = along(pixel, [-normal[0], -normal[1]], (0.5 * inner).min(DEEP_PX));
        let covered = drawn.alpha.sample(deep)[0].max(MIN_COVERED);
        let seen = drawn.rgb.sample(deep);
        found
            .contour_colours
            .push(seen.map(|value| value / covered));
    }
    for (place, slopes) in evenly(steep(&smooth, drawn, model.least_slope), model.most_texture) {
        found.texture_points.push(lifted_at(place));
        found.texture_values.push(colour(place));
        found.texture_slopes.push(slopes);
    }
    let alpha = drawn.alpha.values;
    let inside: Vec<usize> = (0..alpha.len())
        .filter(|&place| alpha[place] > SILHOUETTE)
        .collect();
    found.area_px = inside.len();
    for place in evenly(inside, model.most_surface) {
        found.surface_points.push(lifted_at(place));
        found
            .surface_colours
            .push(colour(place).map(|value| value / alpha[place]));
    }
    found
}

/// At most so many of some values, evenly taken.
fn evenly<T: Copy>(values: Vec<T>, most: usize) -> Vec<T> {
    if values.len() <= most {
        return values;
    }
    let step = (values.len() - 1) as f64 / (most.max(2) - 1) as f64;
    let last = values.len() - 1;
    let chosen = (0..most).map(|k| values[((k as f64 * step) as usize).min(last)]);
    chosen.collect()
}

/// Pixels well inside what is solid where colours change, and by how much along x and y.
#[inline(always)]
fn steep(smooth: &[f32], drawn: &Drawn<'_>, least_slope: f32) -> Vec<(usize, [[f32; 2]; 3])> {
    let (width, height) = (drawn.alpha.width, drawn.alpha.height);
    let inner = inner_pixels(drawn.alpha.values, width, height);
    let mut found = Vec::new();
    for row in 0..height {
        for column in 0..width {
            let place = row * width + column;
            if !inner[place] {
                continue;
            }
            let slopes = slopes_at(smooth, [width, height], [column, row]);
            let steep2: f32 = slopes.iter().flatten().map(|slope| slope * slope).sum();
            if steep2 > least_slope * least_slope {
                found.push((place, slopes));
            }
        }
    }
    found
}

/// Whether all pixels around one are solid; beyond the border nothing is known to be not.
#[inline(always)]
fn inner_pixels(alpha: &[f32], width: usize, height: usize) -> Vec<bool> {
    let mut across = vec![false; alpha.len()];
    for (line, to) in alpha
        .chunks_exact(width)
        .zip(across.chunks_exact_mut(width))
    {
        for (column, is_solid) in to.iter_mut().enumerate() {
            let near = column.saturating_sub(FROM_EDGE)..(column + FROM_EDGE + 1).min(width);
            *is_solid = line[near].iter().all(|&alpha| alpha > SOLID);
        }
    }
    let mut inner = vec![true; alpha.len()];
    for (row, to) in inner.chunks_exact_mut(width).enumerate() {
        for near in row.saturating_sub(FROM_EDGE)..(row + FROM_EDGE + 1).min(height) {
            for (is_inner, is_solid) in to.iter_mut().zip(&across[near * width..][..width]) {
                *is_inner &= is_solid;
            }
        }
    }
    inner
}

/// Derivatives along x and y, smoothed across (Sobel), of three interleaved channels at a pixel.
#[inline(always)]
fn slopes_at(
    values: &[f32],
    [width, height]: [usize; 2],
    [column, row]: [usize; 2],
) -> [[f32; 2]; 3] {
    let rows = [row.saturating_sub(1), row, (row + 1).min(height - 1)];
    let columns = [
        column.saturating_sub(1),
        column,
        (column + 1).min(width - 1),
    ];
    let mut slopes = [[0.0; 2]; 3];
    for (channel, slope) in slopes.iter_mut().enumerate() {
        let at = |y: usize, x: usize| values[3 * (rows[y] * width + columns[x]) + channel];
        let side = |x: usize| at(0, x) + 2.0 * at(1, x) + at(2, x);
        let edge = |y: usize| at(y, 0) + 2.0 * at(y, 1) + at(y, 2);
        *slope = [0.125 * (side(2) - side(0)), 0.125 * (edge(2) - edge(0))];
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_taken_evenly_with_the_first_and_the_last() {
        assert_eq!(evenly((0..9).collect(), 3), [0, 4, 8]);
        assert_eq!(evenly((0..3).collect(), 5), [0, 1, 2]);
    }

    #[test]
    fn what_is_well_inside_has_only_solid_pixels_around_it() {
        let mut alpha = vec![1.0; 42];
        alpha[2 * 7 + 5] = 0.0;
        let inner = inner_pixels(&alpha, 7, 6);
        let columns = |row: usize| (0..7).filter(|x| inner[row * 7 + x]).collect::<Vec<_>>();
        assert_eq!(columns(0), [0, 1, 2]);
        assert_eq!(columns(5), [0, 1, 2, 3, 4, 5, 6]);
    }
}
