//! Points of a drawn object that its pose can be measured at: where its silhouette ends, where its
//! picture has structure. `tests/twins/reduction.py` says the same.

use std::ops::Range;

use crate::camera::lens::Lens;
use crate::track::picture::Picture;

/// Alpha of the silhouette.
const HALF: f32 = 0.5;

/// Pixels along a normal at which the width of a part and of the gap beside it is looked at.
const FIRST_STEP: f64 = 0.75;
const STEP: f64 = 0.5;

/// An object drawn alone.
#[derive(Clone, Copy)]
pub struct Drawn<'a> {
    pub rgb: Picture<'a, 3>,
    pub alpha: Picture<'a, 1>,
    pub depth: &'a [f32],
}

/// Silhouette points: `pixels` and `normals`, outward, in the picture, `points` in camera axes.
#[derive(Default)]
pub struct Contour {
    pub pixels: Vec<[f64; 2]>,
    pub points: Vec<[f64; 3]>,
    pub normals: Vec<[f64; 2]>,
    pub inner: Vec<f64>,
    pub outer: Vec<f64>,
    pub colours: Vec<[f32; 3]>,
}

struct Crossing {
    pixel: [f64; 2],
    normal: [f64; 2],
    /// Index of the neighbouring pixel inside the silhouette.
    inside: usize,
}

/// About `limit` crossings of alpha = ½ between pixels, evenly taken.
#[inline(always)]
pub fn contour<L: Lens>(drawn: &Drawn<'_>, lens: &L, limit: usize, reach_px: f64) -> Contour {
    let mut crossings = crossings(&drawn.alpha);
    if crossings.len() > limit {
        crossings.sort_by(|a, b| {
            let key = |c: &Crossing| (c.pixel[1], c.pixel[0]);
            key(a).partial_cmp(&key(b)).expect("pixels are numbers")
        });
        let last = (crossings.len() - 1) as f64;
        let chosen = (0..limit).map(|k| (k as f64 * last / (limit.max(2) - 1) as f64) as usize);
        let mut kept: Vec<Option<Crossing>> = crossings.into_iter().map(Some).collect();
        crossings = chosen.filter_map(|k| kept[k].take()).collect();
    }
    let mut found = Contour::default();
    for Crossing {
        pixel,
        normal,
        inside,
    } in crossings
    {
        let inward = [-normal[0], -normal[1]];
        let inner = run(&drawn.alpha, pixel, inward, reach_px, |alpha| alpha < HALF);
        let outer = run(&drawn.alpha, pixel, normal, reach_px, |alpha| alpha > HALF);
        let deep = along(pixel, inward, (0.5 * inner).min(2.0));
        let covered = drawn.alpha.sample(deep)[0].max(0.3);
        found
            .points
            .push(lifted(lens, pixel, f64::from(drawn.depth[inside])));
        found.pixels.push(pixel);
        found.normals.push(normal);
        found.inner.push(inner);
        found.outer.push(outer);
        found
            .colours
            .push(drawn.rgb.sample(deep).map(|c| c / covered));
    }
    found
}

/// The point seen at a pixel: depth along z for a pinhole, range for a fisheye.
pub fn lifted<L: Lens>(lens: &L, [u, v]: [f64; 2], depth: f64) -> [f64; 3] {
    let ray = lens.ray(u, v);
    let unit = match lens.circle() {
        Some(_) => (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]).sqrt(),
        None => ray[2],
    };
    ray.map(|part| part * depth / unit)
}

#[inline(always)]
pub(crate) fn along(pixel: [f64; 2], heading: [f64; 2], distance: f64) -> [f64; 2] {
    [
        pixel[0] + distance * heading[0],
        pixel[1] + distance * heading[1],
    ]
}

#[inline(always)]
fn crossings(alpha: &Picture<'_, 1>) -> Vec<Crossing> {
    let mut found = Vec::new();
    for axis in 0..2 {
        let [wide, high] = [
            alpha.width - usize::from(axis == 0),
            alpha.height - usize::from(axis == 1),
        ];
        let step = if axis == 0 { 1 } else { alpha.width };
        for row in 0..high {
            let line = &alpha.values[row * alpha.width..];
            for column in changes(&line[..wide], &line[step..][..wide]).flatten() {
                let [near, far] = [line[column] - HALF, line[column + step] - HALF];
                if near * far >= 0.0 {
                    continue;
                }
                let next = if axis == 0 {
                    [column + 1, row]
                } else {
                    [column, row + 1]
                };
                let inside = if near > 0.0 { [column, row] } else { next };
                let slope = slope_at(alpha, inside);
                let length = slope[0].hypot(slope[1]);
                // Each stretch of contour is taken once, from the axis it crosses more steeply.
                let steeper = if axis == 0 {
                    slope[0].abs() >= slope[1].abs()
                } else {
                    slope[1].abs() > slope[0].abs()
                };
                if length <= 1e-4 || !steeper {
                    continue;
                }
                let mut pixel = [column as f64 + 0.5, row as f64 + 0.5];
                pixel[axis] += f64::from(near / (near - far));
                found.push(Crossing {
                    pixel,
                    normal: slope.map(|part| -part / length),
                    inside: inside[1] * alpha.width + inside[0],
                });
            }
        }
    }
    found
}

/// Stretches of two lines in which one may be inside where the other is not.
#[inline(always)]
fn changes<'a>(near: &'a [f32], far: &'a [f32]) -> impl Iterator<Item = Range<usize>> + 'a {
    const STRETCH: usize = 16;
    let stretches = near.chunks(STRETCH).zip(far.chunks(STRETCH)).enumerate();
    stretches.filter_map(|(index, (near, far))| {
        let mut differ = false;
        for (near, far) in near.iter().zip(far) {
            differ |= (*near < HALF) != (*far < HALF);
        }
        let first = index * STRETCH;
        differ.then(|| first..first + near.len())
    })
}

/// Derivative at a pixel of the picture blurred by a Gaussian of one pixel, the border repeated.
#[inline(always)]
fn slope_at(alpha: &Picture<'_, 1>, [column, row]: [usize; 2]) -> [f64; 2] {
    const REACH: isize = 3;
    // exp(-step²/2), and its derivative's factor.
    const WEIGHTS: [f64; 4] = [1.0, 0.606_530_66, 0.135_335_28, 0.011_108_997];
    let mut slope = [0.0; 2];
    for dy in -REACH..=REACH {
        let y = (row as isize + dy).clamp(0, alpha.height as isize - 1) as usize;
        for dx in -REACH..=REACH {
            let x = (column as isize + dx).clamp(0, alpha.width as isize - 1) as usize;
            let value = f64::from(alpha.values[y * alpha.width + x]);
            let weight = WEIGHTS[dx.unsigned_abs()] * WEIGHTS[dy.unsigned_abs()] * value;
            slope[0] += dx as f64 * weight;
            slope[1] += dy as f64 * weight;
        }
    }
    slope
}

/// Pixels one can go along a heading before `is_left` says that alpha has crossed ½ again.
#[inline(always)]
fn run(
    alpha: &Picture<'_, 1>,
    pixel: [f64; 2],
    heading: [f64; 2],
    reach_px: f64,
    is_left: impl Fn(f32) -> bool,
) -> f64 {
    let mut distance = FIRST_STEP;
    while distance < reach_px + 0.01 {
        if is_left(alpha.sample(along(pixel, heading, distance))[0]) {
            return (distance - 0.25).max(1.0);
        }
        distance += STEP;
    }
    reach_px - 0.25
}
