//! How unlike a photo and others are at each of many depths, over planes across the view.
//!
//! Plane sweep (Collins 1996): each plane says where in the other photos a pixel would be. Photos may
//! have been taken from anywhere, ahead as well as aside. Of several, those that look most like it
//! count: in the others something may stand before the place (Kang et al. 2001).

use rayon::prelude::*;

use crate::machine::simd::Simd;
use crate::stereo::census::{unlike, Census, HalfPixels};

/// Others that count: those most like the photo.
pub const COUNTED: usize = 3;
/// What a place costs that fewer than two others can show: a little less than three others that look
/// unlike it by chance, which differ by half of their 48 bits each.
pub const UNSEEN: u8 = 60;
/// Of an other photo that does not show a place; more than any that does.
const OUTSIDE: u8 = u8::MAX;

/// Another photo, and where the photo's pixels are in it.
pub struct Other {
    pub census: HalfPixels,
    /// Of pixel (x, y, 1) at no depth at all: (3, 3) row by row, half pixels.
    pub turn: [[f32; 3]; 3],
    /// To be added per unit of inverse depth, half pixels.
    pub shift: [f32; 3],
}

/// Planes at evenly spaced inverse depths.
#[derive(Clone, Copy)]
pub struct Planes {
    pub first: f32,
    pub step: f32,
    pub count: usize,
}

impl Planes {
    pub fn inverse(&self, plane: f32) -> f32 {
        self.first + self.step * plane
    }
}

/// What every plane costs at every pixel, row by row, the planes of a pixel side by side.
pub struct Costs {
    pub values: Vec<u8>,
    pub planes: usize,
    pub size: [usize; 2],
}

impl Costs {
    /// Of a photo's pixels; `census` is that of its every half pixel.
    pub fn of(
        census: &HalfPixels,
        size: [usize; 2],
        others: &[Other],
        planes: Planes,
        simd: Simd,
    ) -> Costs {
        let mut values = vec![UNSEEN; size[0] * size[1] * planes.count];
        let rows = values.par_chunks_mut((size[0] * planes.count).max(1));
        rows.enumerate()
            .for_each(|(row, out)| fill_row(census, row, others, planes, simd, out));
        Costs {
            values,
            planes: planes.count,
            size,
        }
    }

    #[inline(always)]
    pub fn of_pixel(&self, column: usize, row: usize) -> &[u8] {
        let start = (row * self.size[0] + column) * self.planes;
        &self.values[start..start + self.planes]
    }
}

/// What every plane costs at each pixel of a row.
fn fill_row(
    census: &HalfPixels,
    row: usize,
    others: &[Other],
    planes: Planes,
    simd: Simd,
    out: &mut [u8],
) {
    simd.run(
        #[inline(always)]
        || compare_row(census, row, others, planes, out),
    );
}

#[inline(always)]
fn compare_row(census: &HalfPixels, row: usize, others: &[Other], planes: Planes, out: &mut [u8]) {
    let width = out.len() / planes.count;
    let own: Vec<Census> = (0..width).map(|x| census.at(2 * x, 2 * row)).collect();
    let mut best = Best::new(width);
    let (mut places, mut costs) = (vec![NOWHERE; width], vec![OUTSIDE; width]);
    for plane in 0..planes.count {
        best.forget();
        for other in others {
            find_row(other, row, planes.inverse(plane as f32), &mut places);
            for ((cost, own), place) in costs.iter_mut().zip(&own).zip(&places) {
                *cost = match other.census.values.get(*place as usize) {
                    Some(seen) => unlike(*own, *seen),
                    None => OUTSIDE,
                };
            }
            best.take(&costs);
        }
        for (x, pixel) in out.chunks_exact_mut(planes.count).enumerate() {
            pixel[plane] = best.together(x);
        }
    }
}

/// A place in no photo.
const NOWHERE: u32 = u32::MAX;

/// Half pixels of another photo at which a row's pixels are if they lie at this inverse depth.
#[inline(always)]
fn find_row(other: &Other, row: usize, inverse: f32, places: &mut [u32]) {
    let size = [other.census.width as f32, other.census.height as f32];
    let start: [f32; 3] = std::array::from_fn(|k| {
        other.turn[k][1] * row as f32 + other.turn[k][2] + other.shift[k] * inverse
    });
    let along = [other.turn[0][0], other.turn[1][0], other.turn[2][0]];
    for (x, place) in places.iter_mut().enumerate() {
        let [u, v, z]: [f32; 3] = std::array::from_fn(|k| start[k] + along[k] * x as f32);
        let (u, v) = (u / z + 0.5, v / z + 0.5);
        let is_shown = (z > 0.0) & (u >= 0.0) & (u < size[0]) & (v >= 0.0) & (v < size[1]);
        // Whole numbers up to 2^24 are exact; no photo has more half pixels.
        let at = v.floor() * size[0] + u.floor();
        *place = if is_shown { at as u32 } else { NOWHERE };
    }
}

/// The least costs of a row's pixels, in order.
struct Best([Vec<u8>; COUNTED]);

impl Best {
    fn new(width: usize) -> Best {
        Best(std::array::from_fn(|_| vec![OUTSIDE; width]))
    }

    #[inline(always)]
    fn forget(&mut self) {
        for kept in &mut self.0 {
            kept.fill(OUTSIDE);
        }
    }

    #[inline(always)]
    fn take(&mut self, costs: &[u8]) {
        let [first, second, third] = &mut self.0;
        let kept = first.iter_mut().zip(second).zip(third);
        for (((first, second), third), cost) in kept.zip(costs) {
            let more = (*first).max(*cost);
            *first = (*first).min(*cost);
            let most = (*second).max(more);
            *second = (*second).min(more);
            *third = (*third).min(most);
        }
    }

    /// The sum of the least costs; of two alone, as much as three like them would be.
    #[inline(always)]
    fn together(&self, x: usize) -> u8 {
        let [first, second, third] = [self.0[0][x], self.0[1][x], self.0[2][x]];
        let two = u32::from(first) + u32::from(second);
        if third != OUTSIDE {
            (two + u32::from(third)) as u8
        } else if second != OUTSIDE {
            (two * 3 / 2) as u8
        } else {
            UNSEEN
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_costs_count() {
        let mut best = Best::new(1);
        assert_eq!(best.together(0), UNSEEN);
        for (cost, wanted) in [(9, UNSEEN), (4, 19), (20, 33), (1, 14), (30, 14)] {
            best.take(&[cost]);
            assert_eq!(best.together(0), wanted);
        }
    }
}
