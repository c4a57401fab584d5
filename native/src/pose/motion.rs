//! How a splat's picture changes when its object moves: what the pose kernel needs of every splat.
//!
//! With whitened offsets (u, v), d ln(alpha) is `constant + [u, v, uu, uv, vv] · quadratic`, exactly.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use crate::camera::curvature::Curved;
use crate::camera::lens::LOW_PASS;
use crate::lanes::patch::{load3, Block, Lanes};
use crate::lanes::vector::{all3, dot};
use crate::pose::grey::grey_slope;
use crate::project::ewa;
use crate::project::posed::{PosedCloud, View};
use crate::project::record::{Record, HALF_LOG2_E};
use crate::scene::cloud::{BLOCKS_PER_CHUNK, LANES};

/// A small motion in camera axes: `x += shift + turn × x`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Twist {
    pub shift: [f32; 3],
    pub turn: [f32; 3],
}

/// Change of one splat per unit of one degree of freedom: the coefficients of u, v, uu, uv, vv in
/// d ln(alpha), then what the three constants below name. One register, so that it is stored whole.
pub type Change = Block;
/// d ln(opacity), from the Mip filter.
pub const CONSTANT: usize = 5;
/// d grey.
pub const GREY_SLOPE: usize = 6;
/// The splat's own grey, the same in all its changes.
pub const GREY: usize = 7;

/// Changes of one splat for all degrees of freedom, in whole cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Motion<const D: usize>(pub [Change; D]);

impl<const D: usize> Default for Motion<D> {
    fn default() -> Self {
        Motion([Change::default(); D])
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
        let slope = grey_slope::<V>(posed, view, &directions.luma, index, &geometry.at, &colour);
        let grey = dot(&all3::<V>(&directions.luma), &load3(&colour));
        for (k, twist) in directions.twists.iter().enumerate() {
            let rows = changes::<V>(&geometry, &slope, twist, grey, view.antialias);
            let columns = V::transposed_lanes(rows);
            for (lane, &place) in places.iter().enumerate() {
                if place != usize::MAX {
                    columns[lane].store(&mut motions[place].0[k]);
                }
            }
        }
    }
}

/// Double precision, since second derivatives cancel.
#[inline(always)]
fn geometry_of<L: Curved>(posed: &PosedCloud, lens: &L, index: usize) -> Geometry {
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

/// The entries of a `Change` of eight splats.
#[inline(always)]
fn changes<V: Lanes>(
    geometry: &Geometry,
    grey_slope: &[Block; 3],
    twist: &Twist,
    grey: V,
    antialias: bool,
) -> [V; 8] {
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
    let lean = a.mul_add(centre[0], b.mul(centre[1]));
    let mut constant = V::all(0.0);
    if antialias {
        let gain = load3::<V>(&geometry.gain);
        let mixed = gain[1].mul(xy);
        constant = gain[0].mul_add(xx, gain[2].mul_add(yy, mixed.add(mixed)));
    }
    [
        lean.mul(V::all(TWO_LN_2)),
        c.mul(centre[1]).mul(V::all(TWO_LN_2)),
        e_xx.mul(scale),
        e_xy.mul(double),
        e_yy.mul(scale),
        constant,
        dot(&load3(grey_slope), &straight),
        grey,
    ]
}

#[inline(always)]
fn cross<V: Lanes>(p: &[V; 3], q: &[V; 3]) -> [V; 3] {
    [
        p[2].mul_sub_from(q[1], p[1].mul(q[2])),
        p[0].mul_sub_from(q[2], p[2].mul(q[0])),
        p[1].mul_sub_from(q[0], p[0].mul(q[1])),
    ]
}
