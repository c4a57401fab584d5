//! Splats seen so wide that a flat ellipse does not do: their alpha is that of the 3D Gaussian's
//! peak along each pixel's ray (the response of 3DGUT, Wu et al. 2024).
//!
//! With A the whitening (A Σ Aᵀ = 1), m = A·mean and w = A·ray, the squared distance between the
//! ray and the mean is |m|² sin²(m, w) where the ray comes nearer to the mean, else |m|². The scales
//! are blurred by the low pass of 0.3 px² as seen at the splat's range.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use rayon::prelude::*;

use crate::bin::TILE;
use crate::blend::{
    PixelBlock, Tile, ALPHA_MAX, BLOCKS, BLOCKS_ACROSS, BLOCK_HEIGHT, BLOCK_PIXELS, BLOCK_WIDTH,
    TRANSMITTANCE_STOP,
};
use crate::camera::{Lens, LOW_PASS, VISIBLE_SIGMAS};
use crate::lanes::{alpha_of, load3, Block, LaneWork, Lanes};
use crate::project::{tiles_within, PosedCloud, Record, TileBox};
use crate::scene::Original;
use crate::scope::{Scope, Window};

type Vector = [f64; 3];
type Matrix = [[f64; 3]; 3];

/// Samples whose log2(255 · alpha) is this near to 0 are decided in double precision.
const DOUBT: f32 = 1e-3;
/// What rounding may add to the terms that say whether a ray sees a splat, relative to them.
const SLACK: f32 = 1e-5;

/// The rays that see a splat: steep · |(x1, x2)| - reach · x0 <= 0, x as in `WideSplat::rows`.
#[derive(Clone, Copy)]
struct Cone {
    reach: f32,
    steep: f32,
    /// Whether the eye is in the midst of what can be seen, or nearly: then all rays see it.
    is_around: bool,
}

/// A wide splat before one camera.
pub struct WideSplat {
    /// With x = `rows` · ray: squared distance = (x1² + x2²) / (x0² + (x1² + x2²) / `square`).
    rows: Matrix,
    /// |m|²
    square: f64,
    /// log2(255 · opacity)
    power: f64,
    /// `rows` in single precision.
    short_rows: [[f32; 3]; 3],
    cone: Cone,
    mean: Vector,
    /// Blurred covariance in camera axes.
    covariance: Matrix,
}

impl WideSplat {
    pub fn new<L: Lens>(posed: &PosedCloud, lens: &L, original: &Original) -> WideSplat {
        let mean = posed.to_camera(original.mean.map(f64::from));
        let blur = LOW_PASS * dot(&mean, &mean) / lens.focal().powi(2);
        let scales = original
            .scale
            .map(|scale| (f64::from(scale).powi(2) + blur).sqrt());
        let axes = axes_in_camera(posed, original);
        // Row k of the whitening is axis k over its scale.
        let whitening: Matrix =
            std::array::from_fn(|k| std::array::from_fn(|r| axes[r][k] / scales[k]));
        let m = whitening.map(|row| dot(&row, &mean));
        let length = dot(&m, &m).sqrt().max(1e-9);
        let ahead = m.map(|v| v / length);
        let [side, up] = perpendicular(&ahead);
        let pulled = |v: &Vector, gain: f64| -> Vector {
            std::array::from_fn(|r| gain * (0..3).map(|k| whitening[k][r] * v[k]).sum::<f64>())
        };
        let rows = [
            pulled(&ahead, 1.0),
            pulled(&side, length),
            pulled(&up, length),
        ];
        let power = (255.0 * f64::from(original.opacity.min(1.0))).log2();
        let (square, reach_square) = (length * length, power.max(0.0) / HALF_LOG2_E);
        WideSplat {
            rows,
            square,
            power,
            short_rows: rows.map(|row| row.map(|v| v as f32)),
            cone: Cone {
                reach: reach_square.sqrt() as f32,
                steep: (1.0 - reach_square / square).max(0.0).sqrt() as f32,
                is_around: square <= reach_square * 1.001,
            },
            mean,
            covariance: std::array::from_fn(|r| {
                std::array::from_fn(|c| {
                    (0..3)
                        .map(|k| axes[r][k] * axes[c][k] * scales[k] * scales[k])
                        .sum()
                })
            }),
        }
    }

    /// log2(255 · alpha) along a ray.
    fn power_along(&self, ray: &Vector) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k| dot(&self.rows[k], ray));
        let across = y * y + z * z;
        let square = if x > 0.0 {
            across / (x * x + across / self.square)
        } else {
            self.square
        };
        self.power - HALF_LOG2_E * square
    }

    /// Tiles that the splat may touch; None if there are none.
    pub fn tiles<L: Lens>(&self, lens: &L, scope: &Scope) -> Option<TileBox> {
        if self.power.is_nan() || self.power < 0.0 {
            return None;
        }
        let reach = self.power / HALF_LOG2_E;
        // Tangent planes l of the visible ellipsoid through the eye: lᵀ planes l = 0.
        let planes: Matrix = std::array::from_fn(|r| {
            std::array::from_fn(|c| self.mean[r] * self.mean[c] - reach * self.covariance[r][c])
        });
        let is_inside = self.square <= reach * (1.0 + 1e-9);
        let [x, y] = if is_inside {
            EVERYWHERE
        } else {
            lens.box_of_cone(&planes, &self.mean)
        };
        const SLACK_PX: f64 = 0.01;
        let widened = |[low, high]: [f64; 2]| [low - SLACK_PX, high + SLACK_PX];
        tiles_within(widened(x), widened(y), scope)
    }

    /// A record whose ellipse is degenerate: its tiles are those of `tiles`.
    pub fn record(&self, tiles: &TileBox) -> Record {
        let left = i32::from(tiles.columns[0]) * TILE as i32;
        let right = (i32::from(tiles.columns[1]) + 1) * TILE as i32;
        let half = 0.5 * (right - left) as f32;
        let reach = (self.power.max(0.0) as f32).sqrt().max(1e-3);
        Record {
            base: [(left + right) / 2, 0],
            // One pixel less on each side, so that rounding reaches into no other tile.
            inverse_a: (half - 1.0) / reach,
            log2_opacity: (self.power - f64::from(crate::scene::LOG2_255)) as f32,
            ..Record::default()
        }
    }
}

const HALF_LOG2_E: f64 = std::f64::consts::LOG2_E / 2.0;

/// A box of the picture without borders.
pub const EVERYWHERE: [[f64; 2]; 2] = [[f64::NEG_INFINITY, f64::INFINITY]; 2];

/// False only if no wide splat of a group can touch the window.
pub fn can_see_wide<L: Lens>(
    lens: &L,
    group: &crate::camera::Group,
    exact_above: f64,
    window: &Window,
) -> bool {
    let distance = dot(&group.centre, &group.centre).sqrt();
    let nearest = (distance - group.radius).max(0.0);
    if group.max_scale <= exact_above * nearest {
        return false;
    }
    let farthest = distance + group.radius;
    let blurred = group
        .max_scale
        .hypot(LOW_PASS.sqrt() * farthest / lens.focal());
    lens.sees_ball(
        &group.centre,
        group.radius + VISIBLE_SIGMAS * blurred,
        window,
    )
}

/// The wide splats of one picture, ready for its tiles.
#[derive(Default)]
pub struct WideSplats {
    splats: Vec<WideSplat>,
    /// Which of them each record is; means nothing for those that are not wide.
    places: Vec<u32>,
}

impl WideSplats {
    /// `slots` are those of `records` that hold splats of `objects`.
    pub fn new<L: Lens>(
        objects: &[PosedCloud],
        lens: &L,
        records: &[Record],
        slots: impl Iterator<Item = usize>,
    ) -> WideSplats {
        let wide: Vec<usize> = slots.filter(|&slot| records[slot].is_wide()).collect();
        let mut places = vec![0; records.len()];
        for (place, &slot) in wide.iter().enumerate() {
            places[slot] = place as u32;
        }
        let prepared = |&slot: &usize| {
            let record = &records[slot];
            let posed = &objects[record.object as usize];
            WideSplat::new(posed, lens, &posed.cloud.originals[record.index as usize])
        };
        WideSplats {
            splats: wide.par_iter().map(prepared).collect(),
            places,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.splats.is_empty()
    }

    #[inline(always)]
    pub fn at(&self, slot: u32) -> &WideSplat {
        &self.splats[self.places[slot as usize] as usize]
    }
}

/// Blocks whose boxes of rays are looked at together.
const GROUPS: usize = BLOCKS / BLOCK_PIXELS;

/// Directions of a tile's pixels: that of its middle, and what has to be added to it.
pub struct TileRays {
    middle: Vector,
    offsets: [[Block; 3]; BLOCKS],
    /// Middle and half the size of the box that holds a block's offsets, block by block.
    middles: [[Block; 3]; GROUPS],
    halves: [[Block; 3]; GROUPS],
    /// Largest offset of the whole tile along each axis.
    reach: [f32; 3],
}

impl TileRays {
    #[inline(always)]
    pub fn new<L: Lens>(lens: &L, left: usize, top: usize) -> TileRays {
        let half = 0.5 * TILE as f64;
        let mut rays = TileRays {
            middle: lens.ray(left as f64 + half, top as f64 + half),
            offsets: [[[0.0; BLOCK_PIXELS]; 3]; BLOCKS],
            middles: [[[0.0; BLOCK_PIXELS]; 3]; GROUPS],
            halves: [[[0.0; BLOCK_PIXELS]; 3]; GROUPS],
            reach: [0.0; 3],
        };
        for block in 0..BLOCKS {
            let x = (left + block % BLOCKS_ACROSS * BLOCK_WIDTH) as f64 + 0.5;
            let y = (top + block / BLOCKS_ACROSS * BLOCK_HEIGHT) as f64 + 0.5;
            let mut offsets = [[0.0; BLOCK_PIXELS]; 3];
            for lane in 0..BLOCK_PIXELS {
                let (column, row) = (lane % BLOCK_WIDTH, lane / BLOCK_WIDTH);
                let ray = lens.ray(x + column as f64, y + row as f64);
                for axis in 0..3 {
                    offsets[axis][lane] = (ray[axis] - rays.middle[axis]) as f32;
                }
            }
            let (group, place) = (block / BLOCK_PIXELS, block % BLOCK_PIXELS);
            for axis in 0..3 {
                let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
                for &offset in &offsets[axis] {
                    low = low.min(offset);
                    high = high.max(offset);
                }
                rays.middles[group][axis][place] = 0.5 * (low + high);
                rays.halves[group][axis][place] = 0.5 * (high - low);
                rays.reach[axis] = rays.reach[axis].max(high.max(-low));
            }
            rays.offsets[block] = offsets;
        }
        rays
    }

    fn ray(&self, block: usize, lane: usize) -> Vector {
        std::array::from_fn(|axis| self.middle[axis] + f64::from(self.offsets[block][axis][lane]))
    }
}

/// A wide splat over one tile, in single precision.
pub struct WideTile<'a> {
    splat: &'a WideSplat,
    rays: &'a TileRays,
    middle: [f32; 3],
    /// What rounding may add to what `Cone` compares.
    rounding: f32,
}

/// Which blocks of its tile a wide splat may touch, one bit each.
pub struct TouchedBlocks<'a>(pub &'a WideTile<'a>);

impl LaneWork for TouchedBlocks<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<V: Lanes>(self) -> u32 {
        self.0.touched_blocks::<V>()
    }
}

impl<'a> WideTile<'a> {
    #[inline(always)]
    pub fn new(splat: &'a WideSplat, rays: &'a TileRays) -> WideTile<'a> {
        let middle = splat.rows.map(|row| dot(&row, &rays.middle) as f32);
        let [x, y, z] = middle.map(f32::abs);
        let Cone { reach, steep, .. } = splat.cone;
        WideTile {
            splat,
            rays,
            middle,
            rounding: SLACK * (reach * x + steep * (y + z)),
        }
    }

    /// False only if no ray of the tile sees the splat: over a box of rays what `Cone` compares is no
    /// less than at the middle minus what the halves add up to.
    #[inline(always)]
    pub fn may_touch(&self) -> bool {
        let Cone {
            reach,
            steep,
            is_around,
        } = self.splat.cone;
        let mut spread = [0.0f32; 3];
        for k in 0..3 {
            for axis in 0..3 {
                spread[k] += self.splat.short_rows[k][axis].abs() * self.rays.reach[axis];
            }
        }
        let [x, y, z] = self.middle;
        let room = reach * (x + spread[0]) + steep * (spread[1] + spread[2]) + self.rounding;
        let across = steep * steep * (y * y + z * z);
        is_around || (room >= 0.0 && room * room >= across)
    }

    /// As `may_touch`, block by block.
    #[inline(always)]
    fn touched_blocks<V: Lanes>(&self) -> u32 {
        let cone = &self.splat.cone;
        if cone.is_around {
            return u32::MAX;
        }
        let [x, y, z] = self.middle;
        let (reach, steep) = (V::all(cone.reach), V::all(cone.steep));
        let rounding = V::all(self.rounding);
        let mut touched = 0;
        for group in 0..GROUPS {
            let middles = load3::<V>(&self.rays.middles[group]);
            let halves = load3::<V>(&self.rays.halves[group]);
            let mut at = [V::all(x), V::all(y), V::all(z)];
            let mut spread = [V::all(0.0); 3];
            for k in 0..3 {
                for axis in 0..3 {
                    let entry = self.splat.short_rows[k][axis];
                    at[k] = V::all(entry).mul_add(middles[axis], at[k]);
                    spread[k] = V::all(entry.abs()).mul_add(halves[axis], spread[k]);
                }
            }
            let room = steep.mul_add(spread[1].add(spread[2]), rounding);
            let room = reach.mul_add(at[0].add(spread[0]), room);
            let (across_y, across_z) = (steep.mul(at[1]), steep.mul(at[2]));
            let across = across_y.mul_add(across_y, across_z.mul(across_z));
            let is_near = room.mul(room).at_least(across);
            let touches = is_near.and(room.at_least(V::all(0.0)));
            touched |= touches.bits() << (group * BLOCK_PIXELS);
        }
        touched
    }

    /// log2(255 · alpha) of a block's pixels, on the right side of 0.
    #[inline(always)]
    fn powers<V: Lanes>(&self, block: usize) -> V {
        let offsets = load3::<V>(&self.rays.offsets[block]);
        let [x, y, z] = self.middle;
        let mut at = [V::all(x), V::all(y), V::all(z)];
        for k in 0..3 {
            for axis in 0..3 {
                at[k] = V::all(self.splat.short_rows[k][axis]).mul_add(offsets[axis], at[k]);
            }
        }
        let across = at[1].mul_add(at[1], at[2].mul(at[2]));
        let inverse_square = V::all((1.0 / self.splat.square) as f32);
        let along = at[0].mul_add(at[0], across.mul(inverse_square));
        let is_ahead = at[0].at_least(V::all(0.0));
        let away = V::all(self.splat.square as f32);
        let away = away.sub(away.and(is_ahead));
        let square = across.mul(along.reciprocal()).and(is_ahead).add(away);
        let power =
            square.mul_sub_from(V::all(HALF_LOG2_E as f32), V::all(self.splat.power as f32));
        let is_sure = power.abs().at_least(V::all(DOUBT)).bits();
        if is_sure == (1 << BLOCK_PIXELS) - 1 {
            return power;
        }
        let mut powers = [0.0; BLOCK_PIXELS];
        power.store(&mut powers);
        self.settle(block, &mut powers, is_sure);
        V::load(&powers)
    }

    #[cold]
    #[inline(never)]
    fn settle(&self, block: usize, powers: &mut Block, is_sure: u32) {
        for (lane, power) in powers.iter_mut().enumerate() {
            if is_sure >> lane & 1 == 0 {
                *power = self.splat.power_along(&self.rays.ray(block, lane)) as f32;
            }
        }
    }
}

/// Blends one wide splat into the blocks of a tile, as `blend::blend_tile` does the others.
pub struct WideBlend<'a, const TRACK_OBJECTS: bool> {
    pub tile: &'a mut Tile,
    pub wide: &'a WideTile<'a>,
    pub record: &'a Record,
    /// One bit each.
    pub blocks: u32,
}

impl<const TRACK_OBJECTS: bool> LaneWork for WideBlend<'_, TRACK_OBJECTS> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        let stop = V::all(TRANSMITTANCE_STOP);
        let mut left = self.blocks;
        while left != 0 {
            let index = left.trailing_zeros() as usize % BLOCKS;
            left &= left - 1;
            let block = &mut self.tile.blocks[index];
            let before = V::load(&block.transmittance);
            let takes_light = before.at_least(stop);
            if takes_light.bits() == 0 {
                continue;
            }
            let power = self.wide.powers::<V>(index);
            let is_drawn = power.at_least(V::all(0.0)).and(takes_light);
            if is_drawn.bits() != 0 {
                let alpha = alpha_of(power).min(V::all(ALPHA_MAX)).and(is_drawn);
                blend_block::<V, TRACK_OBJECTS>(block, before, alpha, self.record);
            }
        }
    }
}

#[inline(always)]
fn blend_block<V: Lanes, const TRACK_OBJECTS: bool>(
    block: &mut PixelBlock,
    before: V,
    alpha: V,
    record: &Record,
) {
    let weight = alpha.mul(before);
    before.sub(weight).store(&mut block.transmittance);
    for (sum, &value) in block.colour.iter_mut().zip(&record.colour) {
        weight.mul_add(V::all(value), V::load(sum)).store(sum);
    }
    let depth = weight.mul_add(V::all(record.depth), V::load(&block.depth));
    depth.store(&mut block.depth);
    if TRACK_OBJECTS {
        let mut weights = [0.0; BLOCK_PIXELS];
        weight.store(&mut weights);
        for lane in 0..BLOCK_PIXELS {
            if weights[lane] > block.weight[lane] {
                block.weight[lane] = weights[lane];
                block.object[lane] = record.object as i32;
            }
        }
    }
}

/// Columns are the ellipsoid's axes, in camera axes.
fn axes_in_camera(posed: &PosedCloud, original: &Original) -> Matrix {
    let axes = original.axes();
    std::array::from_fn(|r| {
        std::array::from_fn(|k| (0..3).map(|j| posed.rotation[r][j] * axes[3 * j + k]).sum())
    })
}

/// Two unit vectors at right angles to a unit vector and to each other (Duff et al. 2017).
fn perpendicular(n: &Vector) -> [Vector; 2] {
    let sign = 1f64.copysign(n[2]);
    let a = -1.0 / (sign + n[2]);
    let b = n[0] * n[1] * a;
    [
        [1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]],
        [b, sign + n[1] * n[1] * a, -n[1]],
    ]
}

fn dot(p: &Vector, q: &Vector) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}
