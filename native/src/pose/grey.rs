//! How a splat's grey changes with the direction it is seen from: the slope of its harmonics.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use crate::lanes::patch::{load3, Block, Lanes};
use crate::lanes::vector::{all3, dot};
use crate::project::posed::{PosedCloud, View};
use crate::scene::cloud::LANES;

/// d grey / d position, in camera axes: the colour's dependence on the direction.
#[inline(always)]
pub fn grey_slope<V: Lanes>(
    posed: &PosedCloud,
    view: &View,
    luma: &[f32; 3],
    index: usize,
    place: &[Block; 3],
    colour: &[Block; 3],
) -> [Block; 3] {
    let count = posed.cloud.sh_count.min((view.sh_degree + 1).pow(2));
    let mut out = [[0.0; LANES]; 3];
    if count == 1 {
        return out;
    }
    let rotation = posed.rotation.map(|row| row.map(|v| v as f32));
    let at = load3::<V>(place);
    let mut inverse_length = [0.0; LANES];
    for lane in 0..LANES {
        let square: f32 = (0..3).map(|axis| place[axis][lane].powi(2)).sum();
        inverse_length[lane] = if square > 0.0 {
            1.0 / square.sqrt()
        } else {
            0.0
        };
    }
    let inverse_length = V::load(&inverse_length);
    let in_camera = [
        at[0].mul(inverse_length),
        at[1].mul(inverse_length),
        at[2].mul(inverse_length),
    ];
    let [x, y, z] = [
        dot(&column3(&rotation, 0), &in_camera),
        dot(&column3(&rotation, 1), &in_camera),
        dot(&column3(&rotation, 2), &in_camera),
    ];
    // A colour clamped at 0 stays there.
    let mut free_luma = [[0.0; LANES]; 3];
    for channel in 0..3 {
        for lane in 0..LANES {
            if colour[channel][lane] > 0.0 {
                free_luma[channel][lane] = luma[channel];
            }
        }
    }
    let greys = Greys {
        luma: load3::<V>(&free_luma),
        rows: posed.cloud.sh_of(index),
    };
    let slope = greys.slope(count, [x, y, z]);
    let turned = [
        dot(&all3(&rotation[0]), &slope),
        dot(&all3(&rotation[1]), &slope),
        dot(&all3(&rotation[2]), &slope),
    ];
    let radial = dot(&turned, &in_camera);
    for axis in 0..3 {
        in_camera[axis]
            .mul_sub_from(radial, turned[axis])
            .mul(inverse_length)
            .store(&mut out[axis]);
    }
    out
}

/// Grey coefficients of eight splats.
struct Greys<'a, V> {
    luma: [V; 3],
    rows: &'a [Block],
}

impl<V: Lanes> Greys<'_, V> {
    /// Slope of the harmonics of degree 1 and more in (x, y, z), for `count` of them.
    #[inline(always)]
    fn slope(&self, count: usize, [x, y, z]: [V; 3]) -> [V; 3] {
        const C1: f32 = 0.488_602_5;
        let mut slope = [self.of(3, -C1), self.of(1, -C1), self.of(2, C1)];
        let (xx, yy, zz) = (x.mul(x), y.mul(y), z.mul(z));
        let zero = V::all(0.0);
        if count >= 9 {
            const C2: [f32; 3] = [1.092_548_5, 0.315_391_57, 0.546_274_24];
            self.take(&mut slope, 4, C2[0], [y, x, zero]);
            self.take(&mut slope, 5, -C2[0], [zero, z, y]);
            self.take(
                &mut slope,
                6,
                C2[1],
                [times(-2.0, x), times(-2.0, y), times(4.0, z)],
            );
            self.take(&mut slope, 7, -C2[0], [z, zero, x]);
            self.take(&mut slope, 8, C2[2], [times(2.0, x), times(-2.0, y), zero]);
        }
        if count >= 16 {
            const C3: [f32; 5] = [
                0.590_043_6,
                2.890_611_4,
                0.457_045_8,
                0.373_176_34,
                1.445_305_7,
            ];
            let (xy, xz, yz) = (x.mul(y), x.mul(z), y.mul(z));
            let difference = times(3.0, xx.sub(yy));
            self.take(&mut slope, 9, -C3[0], [times(6.0, xy), difference, zero]);
            self.take(&mut slope, 10, C3[1], [yz, xz, xy]);
            let (minus_xy, four_zz) = (times(-2.0, xy), times(4.0, zz));
            let inner = four_zz.sub(xx).sub(times(3.0, yy));
            self.take(&mut slope, 11, -C3[2], [minus_xy, inner, times(8.0, yz)]);
            let outer = times(6.0, zz).sub(times(3.0, xx.add(yy)));
            self.take(
                &mut slope,
                12,
                C3[3],
                [times(-6.0, xz), times(-6.0, yz), outer],
            );
            let inner = four_zz.sub(yy).sub(times(3.0, xx));
            self.take(&mut slope, 13, -C3[2], [inner, minus_xy, times(8.0, xz)]);
            self.take(
                &mut slope,
                14,
                C3[4],
                [times(2.0, xz), times(-2.0, yz), xx.sub(yy)],
            );
            self.take(&mut slope, 15, -C3[0], [difference, times(-6.0, xy), zero]);
        }
        slope
    }

    #[inline(always)]
    fn of(&self, k: usize, gain: f32) -> V {
        let sum = self.luma[0].mul(V::load(&self.rows[3 * k]));
        let sum = self.luma[1].mul_add(V::load(&self.rows[3 * k + 1]), sum);
        let sum = self.luma[2].mul_add(V::load(&self.rows[3 * k + 2]), sum);
        sum.mul(V::all(gain))
    }

    /// Adds coefficient `k` times the slope of its basis function.
    #[inline(always)]
    fn take(&self, slope: &mut [V; 3], k: usize, gain: f32, along: [V; 3]) {
        let share = self.of(k, gain);
        slope[0] = share.mul_add(along[0], slope[0]);
        slope[1] = share.mul_add(along[1], slope[1]);
        slope[2] = share.mul_add(along[2], slope[2]);
    }
}

#[inline(always)]
fn times<V: Lanes>(factor: f32, value: V) -> V {
    V::all(factor).mul(value)
}

#[inline(always)]
fn column3<V: Lanes>(matrix: &[[f32; 3]; 3], column: usize) -> [V; 3] {
    [
        V::all(matrix[0][column]),
        V::all(matrix[1][column]),
        V::all(matrix[2][column]),
    ]
}
