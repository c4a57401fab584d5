//! Wide splats over one tile: which blocks they may touch, and how they are blended along the rays.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use crate::camera::lens::Lens;
use crate::lanes::patch::{load3, Block, LaneWork, Lanes};
use crate::lanes::vector::alpha_of;
use crate::project::record::{Record, HALF_LOG2_E};
use crate::project::tile_box::TILE;
use crate::project::wide::{dot, Cone, Vector, WideSplat};
use crate::tile::pixels::{
    PixelBlock, Tile, ALPHA_MAX, BLOCKS, BLOCKS_ACROSS, BLOCK_HEIGHT, BLOCK_PIXELS, BLOCK_WIDTH,
    TRANSMITTANCE_STOP,
};

/// Samples whose log2(255 · alpha) is this near to 0 are decided in double precision.
const DOUBT: f32 = 1e-3;
/// What rounding may add to the terms that say whether a ray sees a splat, relative to them.
const SLACK: f32 = 1e-5;

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

/// Blends one wide splat into the blocks of a tile, as `portable::blend_tile` does the others.
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
