//! Splats seen so wide that a flat ellipse does not do: their alpha is that of the 3D Gaussian's
//! peak along each pixel's ray (the response of 3DGUT, Wu et al. 2024).
//!
//! With A the whitening (A Σ Aᵀ = 1), m = A·mean and w = A·ray, the squared distance between the
//! ray and the mean is |m|² sin²(m, w) where the ray comes nearer to the mean, else |m|². The scales
//! are blurred by the low pass of 0.3 px² as seen at the splat's range.

use crate::bin::TILE;
use crate::blend::{
    alpha_of, PixelBlock, Tile, TileWork, ALPHA_MAX, BLOCKS, BLOCK_PIXELS, TRANSMITTANCE_STOP,
};
use crate::camera::{Lens, LOW_PASS, VISIBLE_SIGMAS};
use crate::lanes::Block;
use crate::project::{tiles_within, PosedCloud, Record, TileBox};
use crate::scene::Original;
use crate::scope::{Scope, Window};

type Vector = [f64; 3];
type Matrix = [[f64; 3]; 3];

/// Samples whose log2(255 · alpha) is this near to 0 are decided in double precision.
const DOUBT: f32 = 1e-3;

/// A wide splat before one camera.
pub struct WideSplat {
    /// With x = `rows` · ray: squared distance = (x1² + x2²) / (x0² + (x1² + x2²) / `square`).
    rows: Matrix,
    /// |m|²
    square: f64,
    /// log2(255 · opacity)
    power: f64,
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
        WideSplat {
            rows: [
                pulled(&ahead, 1.0),
                pulled(&side, length),
                pulled(&up, length),
            ],
            square: length * length,
            power: (255.0 * f64::from(original.opacity.min(1.0))).log2(),
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
        if !(self.power >= 0.0) {
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

/// Directions of a tile's pixels: that of its middle, and what has to be added to it.
pub struct TileRays {
    middle: Vector,
    offsets: [[Block; 3]; BLOCKS],
}

impl TileRays {
    pub fn new<L: Lens>(lens: &L, left: usize, top: usize) -> TileRays {
        let half = 0.5 * TILE as f64;
        let middle = lens.ray(left as f64 + half, top as f64 + half);
        let mut offsets = [[[0.0; BLOCK_PIXELS]; 3]; BLOCKS];
        for y in 0..TILE {
            for x in 0..TILE {
                let ray = lens.ray((left + x) as f64 + 0.5, (top + y) as f64 + 0.5);
                let (block, lane) = Tile::place(x, y);
                for axis in 0..3 {
                    offsets[block][axis][lane] = (ray[axis] - middle[axis]) as f32;
                }
            }
        }
        TileRays { middle, offsets }
    }

    fn ray(&self, block: usize, lane: usize) -> Vector {
        std::array::from_fn(|axis| self.middle[axis] + f64::from(self.offsets[block][axis][lane]))
    }
}

/// A wide splat over one tile, in single precision.
pub struct WideTile<'a> {
    splat: &'a WideSplat,
    rays: &'a TileRays,
    rows: [[f32; 3]; 3],
    middle: [f32; 3],
    square: f32,
    inverse_square: f32,
    power: f32,
}

impl<'a> WideTile<'a> {
    pub fn new(splat: &'a WideSplat, rays: &'a TileRays) -> WideTile<'a> {
        WideTile {
            splat,
            rays,
            rows: splat.rows.map(|row| row.map(|v| v as f32)),
            middle: splat.rows.map(|row| dot(&row, &rays.middle) as f32),
            square: splat.square as f32,
            inverse_square: (1.0 / splat.square) as f32,
            power: splat.power as f32,
        }
    }

    /// log2(255 · alpha) of a block's pixels, on the right side of 0.
    #[inline(always)]
    pub fn powers(&self, block: usize) -> Block {
        let offsets = &self.rays.offsets[block];
        let mut powers = [0.0; BLOCK_PIXELS];
        for lane in 0..BLOCK_PIXELS {
            let d = [offsets[0][lane], offsets[1][lane], offsets[2][lane]];
            let x = self.middle[0] + dot3(&self.rows[0], &d);
            let y = self.middle[1] + dot3(&self.rows[1], &d);
            let z = self.middle[2] + dot3(&self.rows[2], &d);
            let across = y * y + z * z;
            let peak = across / (x * x + across * self.inverse_square);
            let square = if x > 0.0 { peak } else { self.square };
            powers[lane] = self.power - HALF_LOG2_E as f32 * square;
        }
        let mut is_doubtful = false;
        for power in &powers {
            is_doubtful |= power.abs() < DOUBT;
        }
        if is_doubtful {
            self.settle(block, &mut powers);
        }
        powers
    }

    #[cold]
    #[inline(never)]
    fn settle(&self, block: usize, powers: &mut Block) {
        for (lane, power) in powers.iter_mut().enumerate() {
            if power.abs() < DOUBT {
                *power = self.splat.power_along(&self.rays.ray(block, lane)) as f32;
            }
        }
    }
}

/// Blends one wide splat into a tile, as `blend::blend_tile` does the others.
#[inline(always)]
pub fn blend_wide<const TRACK_OBJECTS: bool>(tile: &mut Tile, wide: &WideTile, record: &Record) {
    for (index, block) in tile.blocks.iter_mut().enumerate() {
        if !block.transmittance.iter().any(|&t| t >= TRANSMITTANCE_STOP) {
            continue;
        }
        let powers = wide.powers(index);
        if powers.iter().any(|&power| power >= 0.0) {
            blend_block::<TRACK_OBJECTS>(block, &powers, record);
        }
    }
}

#[inline(always)]
fn blend_block<const TRACK_OBJECTS: bool>(block: &mut PixelBlock, powers: &Block, record: &Record) {
    for lane in 0..BLOCK_PIXELS {
        let transmittance = block.transmittance[lane];
        let is_drawn = powers[lane] >= 0.0 && transmittance >= TRANSMITTANCE_STOP;
        let alpha = alpha_of(powers[lane].max(0.0)).min(ALPHA_MAX);
        let weight = if is_drawn { alpha * transmittance } else { 0.0 };
        block.transmittance[lane] = transmittance - weight;
        for channel in 0..3 {
            block.colour[channel][lane] += weight * record.colour[channel];
        }
        block.depth[lane] += weight * record.depth;
        if TRACK_OBJECTS {
            let is_heavier = weight > block.weight[lane];
            block.weight[lane] = if is_heavier {
                weight
            } else {
                block.weight[lane]
            };
            let object = record.object as i32;
            block.object[lane] = if is_heavier {
                object
            } else {
                block.object[lane]
            };
        }
    }
}

/// The next wide splat of a list of slots.
#[inline(always)]
pub fn next_wide(work: &TileWork) -> Option<usize> {
    let is_wide = |&slot: &u32| work.records[slot as usize].is_wide();
    work.slots.iter().position(is_wide)
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

#[inline(always)]
fn dot3(p: &[f32; 3], q: &[f32; 3]) -> f32 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

fn dot(p: &Vector, q: &Vector) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}
