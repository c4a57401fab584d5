//! How a splat's picture changes when its object moves: what the pose kernel needs of every splat.
//!
//! With whitened offsets (u, v), d ln(alpha) is `constant + [u, v, uu, uv, vv] · quadratic`, exactly.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use crate::camera::LOW_PASS;
use crate::curvature::Curved;
use crate::ewa;
use crate::lanes::{all3, load3, Block, Lanes};
use crate::project::{PosedCloud, Record, View};
use crate::scene::{BLOCKS_PER_CHUNK, LANES};

/// A small motion in camera axes: `x += shift + turn × x`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Twist {
    pub shift: [f32; 3],
    pub turn: [f32; 3],
}

/// Change of one splat per unit of one degree of freedom.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Change {
    /// Coefficients of u, v, uu, uv, vv in d ln(alpha).
    pub quadratic: [f32; 5],
    /// d ln(opacity), from the Mip filter.
    pub constant: f32,
    pub grey: f32,
}

/// Changes of one splat for all degrees of freedom.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Motion<const D: usize> {
    pub changes: [Change; D],
    pub grey: f32,
}

impl<const D: usize> Default for Motion<D> {
    fn default() -> Self {
        Motion {
            changes: [Change::default(); D],
            grey: 0.0,
        }
    }
}

/// What is the same for all splats of one call.
pub struct Directions<const D: usize> {
    pub twists: [Twist; D],
    /// Grey = luma · (red, green, blue).
    pub luma: [f32; 3],
}

/// Values of eight splats, one row each.
struct Geometry {
    at: [Block; 3],
    centre: [[Block; 3]; 2],
    jacobian: [[Block; 3]; 2],
    bend: [[[Block; 3]; 3]; 2],
    /// Covariance in camera axes times the transposed Jacobian.
    spread: [[Block; 3]; 2],
    whitening: [Block; 3],
    /// Half of inverse sharp minus inverse soft covariance (xx, xy, yy).
    gain: [Block; 3],
}

/// Fills the motions of the records that `project_chunk` made of `chunk`, in the same order.
#[inline(always)]
pub fn fill_chunk<V: Lanes, L: Curved, const D: usize>(
    posed: &PosedCloud,
    lens: &L,
    view: &View,
    directions: &Directions<D>,
    chunk: usize,
    records: &[Record],
    motions: &mut [Motion<D>],
) {
    let blocks = &posed.cloud.blocks;
    let first = chunk * BLOCKS_PER_CHUNK;
    let last = (first + BLOCKS_PER_CHUNK).min(blocks.len());
    let mut done = 0;
    for index in first..last {
        let block = &blocks[index];
        let mut places = [usize::MAX; LANES];
        let before = done;
        for lane in 0..LANES {
            if done < records.len() && records[done].index == block.index[lane] {
                places[lane] = done;
                done += 1;
            }
        }
        if done == before {
            continue;
        }
        let mut colour = [[0.0; LANES]; 3];
        for (lane, &place) in places.iter().enumerate() {
            if place != usize::MAX {
                for channel in 0..3 {
                    colour[channel][lane] = records[place].colour[channel];
                }
            }
        }
        let geometry = geometry_of(posed, lens, index);
        let slope = grey_slope::<V, D>(posed, view, directions, index, &geometry, &colour);
        for (k, twist) in directions.twists.iter().enumerate() {
            let rows = changes::<V>(&geometry, &slope, twist, view.antialias);
            for (lane, &place) in places.iter().enumerate() {
                if place != usize::MAX {
                    motions[place].changes[k] = Change {
                        quadratic: std::array::from_fn(|term| rows[term][lane]),
                        constant: rows[5][lane],
                        grey: rows[6][lane],
                    };
                }
            }
        }
        for (lane, &place) in places.iter().enumerate() {
            if place != usize::MAX {
                motions[place].grey = (0..3)
                    .map(|channel| directions.luma[channel] * colour[channel][lane])
                    .sum();
            }
        }
    }
}

/// Double precision, since second derivatives cancel.
#[inline(always)]
fn geometry_of<L: Curved>(posed: &PosedCloud, lens: &L, index: usize) -> Geometry {
    const HALF_LOG2_E: f64 = std::f64::consts::LOG2_E / 2.0;
    let zero = [0.0; LANES];
    let mut out = Geometry {
        at: [zero; 3],
        centre: [[zero; 3]; 2],
        jacobian: [[zero; 3]; 2],
        bend: [[[zero; 3]; 3]; 2],
        spread: [[zero; 3]; 2],
        whitening: [zero; 3],
        gain: [zero; 3],
    };
    let block = &posed.cloud.blocks[index];
    let turn = &posed.rotation;
    for lane in 0..LANES {
        let mean = std::array::from_fn(|axis| f64::from(block.mean[axis][lane]));
        let factor: [f64; 9] = std::array::from_fn(|entry| f64::from(block.factor[entry][lane]));
        let at = posed.to_camera(mean);
        let seen = lens.project(at);
        let bend = lens.bend(at);
        // R F, then J R F, whose rows' products are the covariance.
        let turned: [[f64; 3]; 3] = std::array::from_fn(|r| {
            std::array::from_fn(|k| {
                turn[r][0] * factor[k] + turn[r][1] * factor[3 + k] + turn[r][2] * factor[6 + k]
            })
        });
        let m: [[f64; 3]; 2] = std::array::from_fn(|r| {
            let j = &seen.jacobian[r];
            std::array::from_fn(|k| j[0] * turned[0][k] + j[1] * turned[1][k] + j[2] * turned[2][k])
        });
        let print = ewa::covariances(&m);
        for axis in 0..3 {
            out.at[axis][lane] = at[axis] as f32;
            for row in 0..2 {
                out.centre[row][axis][lane] = bend.centre[row][axis] as f32;
                out.jacobian[row][axis][lane] = seen.jacobian[row][axis] as f32;
                for other in 0..3 {
                    out.bend[row][axis][other][lane] = bend.jacobian[row][axis][other] as f32;
                }
                let t = &turned[axis];
                out.spread[row][axis][lane] =
                    (t[0] * m[row][0] + t[1] * m[row][1] + t[2] * m[row][2]) as f32;
            }
        }
        let [xx, xy, yy] = print.soft;
        let a = (HALF_LOG2_E * yy / print.soft_determinant).sqrt();
        out.whitening[0][lane] = a as f32;
        out.whitening[1][lane] = (-a * xy / yy) as f32;
        out.whitening[2][lane] = (HALF_LOG2_E / yy).sqrt() as f32;
        let (sharp, soft) = (0.5 / print.sharp_determinant, 0.5 / print.soft_determinant);
        out.gain[0][lane] = ((yy - LOW_PASS) * sharp - yy * soft) as f32;
        out.gain[1][lane] = (-xy * sharp + xy * soft) as f32;
        out.gain[2][lane] = ((xx - LOW_PASS) * sharp - xx * soft) as f32;
    }
    out
}

/// d grey / d position, in camera axes: the colour's dependence on the direction.
#[inline(always)]
fn grey_slope<V: Lanes, const D: usize>(
    posed: &PosedCloud,
    view: &View,
    directions: &Directions<D>,
    index: usize,
    geometry: &Geometry,
    colour: &[Block; 3],
) -> [Block; 3] {
    let count = posed.cloud.sh_count.min((view.sh_degree + 1).pow(2));
    let mut out = [[0.0; LANES]; 3];
    if count == 1 {
        return out;
    }
    let rotation = posed.rotation.map(|row| row.map(|v| v as f32));
    let at = load3::<V>(&geometry.at);
    let mut inverse_length = [0.0; LANES];
    for lane in 0..LANES {
        let square: f32 = (0..3).map(|axis| geometry.at[axis][lane].powi(2)).sum();
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
    let mut luma = [[0.0; LANES]; 3];
    for channel in 0..3 {
        for lane in 0..LANES {
            let is_free = colour[channel][lane] > 0.0;
            luma[channel][lane] = if is_free {
                directions.luma[channel]
            } else {
                0.0
            };
        }
    }
    let greys = Greys {
        luma: load3::<V>(&luma),
        rows: posed.cloud.sh_of(index),
    };
    const C1: f32 = 0.488_602_5;
    let mut slope = [greys.of(3, -C1), greys.of(1, -C1), greys.of(2, C1)];
    let (xx, yy, zz) = (x.mul(x), y.mul(y), z.mul(z));
    let zero = V::all(0.0);
    if count >= 9 {
        const C2: [f32; 3] = [1.092_548_5, 0.315_391_57, 0.546_274_24];
        greys.take(&mut slope, 4, C2[0], [y, x, zero]);
        greys.take(&mut slope, 5, -C2[0], [zero, z, y]);
        greys.take(
            &mut slope,
            6,
            C2[1],
            [times(-2.0, x), times(-2.0, y), times(4.0, z)],
        );
        greys.take(&mut slope, 7, -C2[0], [z, zero, x]);
        greys.take(&mut slope, 8, C2[2], [times(2.0, x), times(-2.0, y), zero]);
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
        greys.take(&mut slope, 9, -C3[0], [times(6.0, xy), difference, zero]);
        greys.take(&mut slope, 10, C3[1], [yz, xz, xy]);
        let (minus_xy, four_zz) = (times(-2.0, xy), times(4.0, zz));
        let inner = four_zz.sub(xx).sub(times(3.0, yy));
        greys.take(&mut slope, 11, -C3[2], [minus_xy, inner, times(8.0, yz)]);
        let outer = times(6.0, zz).sub(times(3.0, xx.add(yy)));
        greys.take(
            &mut slope,
            12,
            C3[3],
            [times(-6.0, xz), times(-6.0, yz), outer],
        );
        let inner = four_zz.sub(yy).sub(times(3.0, xx));
        greys.take(&mut slope, 13, -C3[2], [inner, minus_xy, times(8.0, xz)]);
        greys.take(
            &mut slope,
            14,
            C3[4],
            [times(2.0, xz), times(-2.0, yz), xx.sub(yy)],
        );
        greys.take(&mut slope, 15, -C3[0], [difference, times(-6.0, xy), zero]);
    }
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

/// The five quadratic coefficients, the constant and the grey of eight splats.
#[inline(always)]
fn changes<V: Lanes>(
    geometry: &Geometry,
    grey_slope: &[Block; 3],
    twist: &Twist,
    antialias: bool,
) -> [Block; 7] {
    const TWO_LN_2: f32 = 2.0 * std::f32::consts::LN_2;
    let at = load3::<V>(&geometry.at);
    let turn = all3::<V>(&twist.turn);
    let straight = all3::<V>(&twist.shift);
    let swing = cross(&turn, &at);
    let shift = [
        swing[0].add(straight[0]),
        swing[1].add(straight[1]),
        swing[2].add(straight[2]),
    ];
    let centre = [
        dot(&load3(&geometry.centre[0]), &shift),
        dot(&load3(&geometry.centre[1]), &shift),
    ];
    // d Σ = sym of 2 (d J + J [turn]ₓ) Σ_camera Jᵀ
    let mut product = [[shift[0]; 2]; 2];
    for row in 0..2 {
        let swung = cross(&load3(&geometry.jacobian[row]), &turn);
        let bend = &geometry.bend[row];
        let tilted = [
            dot(&load3(&bend[0]), &shift).add(swung[0]),
            dot(&load3(&bend[1]), &shift).add(swung[1]),
            dot(&load3(&bend[2]), &shift).add(swung[2]),
        ];
        for other in 0..2 {
            product[row][other] = dot(&tilted, &load3(&geometry.spread[other]));
        }
    }
    let xx = product[0][0].add(product[0][0]);
    let xy = product[0][1].add(product[1][0]);
    let yy = product[1][1].add(product[1][1]);
    let [a, b, c] = load3::<V>(&geometry.whitening);
    // W d Σ Wᵀ with W = [a b; 0 c]
    let left = a.mul_add(xx, b.mul(xy));
    let right = a.mul_add(xy, b.mul(yy));
    let e_xx = a.mul_add(left, b.mul(right));
    let e_xy = c.mul(right);
    let e_yy = c.mul(c).mul(yy);
    let scale = V::all(0.5 * TWO_LN_2 * TWO_LN_2);
    let double = V::all(TWO_LN_2 * TWO_LN_2);
    let mut out = [[0.0; LANES]; 7];
    let lean = a.mul_add(centre[0], b.mul(centre[1]));
    lean.mul(V::all(TWO_LN_2)).store(&mut out[0]);
    c.mul(centre[1]).mul(V::all(TWO_LN_2)).store(&mut out[1]);
    e_xx.mul(scale).store(&mut out[2]);
    e_xy.mul(double).store(&mut out[3]);
    e_yy.mul(scale).store(&mut out[4]);
    if antialias {
        let gain = load3::<V>(&geometry.gain);
        let mixed = gain[1].mul(xy);
        gain[0]
            .mul_add(xx, gain[2].mul_add(yy, mixed.add(mixed)))
            .store(&mut out[5]);
    }
    dot(&load3(grey_slope), &straight).store(&mut out[6]);
    out
}

#[inline(always)]
fn dot<V: Lanes>(p: &[V; 3], q: &[V; 3]) -> V {
    p[0].mul_add(q[0], p[1].mul_add(q[1], p[2].mul(q[2])))
}

#[inline(always)]
fn cross<V: Lanes>(p: &[V; 3], q: &[V; 3]) -> [V; 3] {
    [
        p[2].mul_sub_from(q[1], p[1].mul(q[2])),
        p[0].mul_sub_from(q[2], p[2].mul(q[0])),
        p[1].mul_sub_from(q[0], p[0].mul(q[1])),
    ]
}
