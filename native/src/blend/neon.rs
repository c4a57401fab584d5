//! The blend kernel for NEON: eight pixels (a block) at a time in pairs of registers, one for each row
//! of the block, else as `avx2`.
//!
//! Every sample goes through the same operations in the same order as there.

use std::arch::aarch64::*;

use crate::blend::by_blocks::blend_by_blocks;
use crate::project::record::STEP_DOUBT;
use crate::project::tile_box::TILE;
use crate::tile::alpha::ALPHA_OF;
use crate::tile::batch::{corner, Batch, PatchList, BATCH, RUN};
use crate::tile::pixels::{
    PixelBlock, Tile, ALPHA_MAX, BLOCKS, BLOCKS_ACROSS, BLOCK_HEIGHT, BLOCK_PIXELS, BLOCK_WIDTH,
    TRANSMITTANCE_STOP,
};
use crate::tile::splat::{TileSplat, TileWork};

/// One value for each pixel of a block, row by row.
type Rows = [float32x4_t; BLOCK_HEIGHT];

blend_by_blocks!("neon");

/// One bit per block that still takes light.
#[target_feature(enable = "neon")]
fn live_blocks(tile: &Tile) -> u32 {
    let mut live = 0;
    for (index, block) in tile.blocks.iter().enumerate() {
        live |= u32::from(takes_light(load(&block.transmittance))) << index;
    }
    live
}

/// Whether any pixel of a block takes light.
#[target_feature(enable = "neon")]
#[inline]
fn takes_light(transmittance: Rows) -> bool {
    vmaxvq_f32(vmaxq_f32(transmittance[0], transmittance[1])) >= TRANSMITTANCE_STOP
}

/// One bit per block that the alpha = 1/255 ellipse touches, from the span of every row of pixels.
#[target_feature(enable = "neon")]
#[inline]
fn block_mask(splat: &TileSplat) -> u32 {
    const SLACK_PX: f32 = 0.01;
    const SLACK_POWER: f32 = 1e-3;
    const LAST_COLUMN: f32 = TILE as f32 - 1.0;
    let zero = vdupq_n_f32(0.0);
    let inverse_a = vdupq_n_f32(splat.inverse_a);
    let all = vdupq_n_u32((1 << BLOCKS_ACROSS) - 1);
    let mut rows = four([0.0, 1.0, 2.0, 3.0]);
    let mut mask = 0;
    for quarter in 0..TILE / BLOCKS_ACROSS {
        let v = vfmaq_f32(vdupq_n_f32(splat.v0), vdupq_n_f32(splat.c), rows);
        let left_over = vfmsq_f32(vdupq_n_f32(splat.power + SLACK_POWER), v, v);
        let is_touched = vcgeq_f32(left_over, zero);
        let root = vsqrtq_f32(vmaxq_f32(left_over, zero));
        let half = vfmaq_f32(vdupq_n_f32(SLACK_PX), root, inverse_a);
        let row = vfmaq_f32(vdupq_n_f32(splat.u0), vdupq_n_f32(splat.b), rows);
        let first = vfmsq_f32(vnegq_f32(half), row, inverse_a);
        let last = vfmsq_f32(half, row, inverse_a);
        let first = vrndpq_f32(vmaxq_f32(first, zero));
        let last = vrndmq_f32(vminq_f32(last, vdupq_n_f32(LAST_COLUMN)));
        let is_touched = vandq_u32(is_touched, vcleq_f32(first, last));
        // Empty spans may be far outside; they are masked below, so what the shifts make of them
        // does not matter.
        let first_block = vshrq_n_s32::<2>(vcvtq_s32_f32(first));
        let last_block = vshrq_n_s32::<2>(vcvtq_s32_f32(last));
        let beyond_last = vsubq_s32(last_block, vdupq_n_s32(BLOCKS_ACROSS as i32 - 1));
        let from_first = vshlq_u32(all, first_block);
        let to_last = vshlq_u32(all, beyond_last);
        let nibble = vandq_u32(vandq_u32(from_first, to_last), is_touched);
        let upper = vgetq_lane_u32::<0>(nibble) | vgetq_lane_u32::<1>(nibble);
        let lower = vgetq_lane_u32::<2>(nibble) | vgetq_lane_u32::<3>(nibble);
        mask |= (upper | lower << BLOCKS_ACROSS) << (8 * quarter);
        rows = vaddq_f32(rows, vdupq_n_f32(4.0));
    }
    mask
}

/// Turns a mask of blocks per splat into a list of splats per block.
#[target_feature(enable = "neon")]
fn list_by_block(batch: &mut Batch<u32, BLOCKS>, count: usize) {
    for place in 0..count {
        let mut mask = batch.masks[place];
        while mask != 0 {
            let block = mask.trailing_zeros() as usize % BLOCKS;
            mask &= mask - 1;
            let length = batch.lengths[block];
            batch.lists[block][length] = place as u8;
            batch.lengths[block] = length + 1;
        }
    }
}

/// The state of a block in registers.
#[derive(Clone, Copy)]
struct Pixels {
    transmittance: Rows,
    colour: [Rows; 3],
    depth: Rows,
    weight: Rows,
    object: [int32x4_t; BLOCK_HEIGHT],
}

#[target_feature(enable = "neon")]
fn blend_block<const TRACK_OBJECTS: bool>(block: &mut PixelBlock, todo: &PatchList) {
    if todo.list.is_empty() {
        return;
    }
    let before = load_pixels(block);
    let (mut after, nearest) = blend_list::<TRACK_OBJECTS, false>(before, todo);
    if vminvq_f32(nearest) < STEP_DOUBT {
        after = blend_carefully::<TRACK_OBJECTS>(before, todo);
    }
    store_pixels(block, &after);
}

/// The rare second pass, in which doubtful samples go to the judge. Kept apart so that the call
/// costs the first pass no registers.
#[cold]
#[inline(never)]
#[target_feature(enable = "neon")]
fn blend_carefully<const TRACK_OBJECTS: bool>(before: Pixels, todo: &PatchList) -> Pixels {
    blend_list::<TRACK_OBJECTS, true>(before, todo).0
}

/// Blends a list of splats; also returns how near any sample came to the 1/255 step, per lane.
#[target_feature(enable = "neon")]
#[inline]
fn blend_list<const TRACK_OBJECTS: bool, const CAREFUL: bool>(
    mut pixels: Pixels,
    todo: &PatchList,
) -> (Pixels, float32x4_t) {
    let (left, top) = corner::<BLOCK_PIXELS>(todo.patch);
    let x = vaddq_f32(vdupq_n_f32(left as f32), four([0.0, 1.0, 2.0, 3.0]));
    let mut nearest = vdupq_n_f32(f32::INFINITY);
    for run in todo.list.chunks(RUN) {
        for &place in run {
            let place = place as usize % BATCH;
            let splat = &todo.splats[place];
            let mut power = [vdupq_n_f32(0.0); BLOCK_HEIGHT];
            for (row, power) in power.iter_mut().enumerate() {
                *power = power_at(splat, x, vdupq_n_f32((top + row) as f32));
                nearest = vminq_f32(nearest, vabsq_f32(*power));
            }
            let mut is_drawn = power.map(|power| vcgeq_f32(power, vdupq_n_f32(0.0)));
            if CAREFUL {
                let doubt = vdupq_n_f32(STEP_DOUBT);
                let doubtful = bits(power.map(|power| vcltq_f32(vabsq_f32(power), doubt)));
                is_drawn = masks(todo.settle::<BLOCK_PIXELS>(place, bits(is_drawn), doubtful));
            }
            for row in 0..BLOCK_HEIGHT {
                blend_row::<TRACK_OBJECTS>(&mut pixels, row, splat, power[row], is_drawn[row]);
            }
        }
        if !takes_light(pixels.transmittance) {
            break;
        }
    }
    (pixels, nearest)
}

/// One bit per lane of a mask.
#[target_feature(enable = "neon")]
fn bits(mask: [uint32x4_t; BLOCK_HEIGHT]) -> u32 {
    let lanes = vcvtq_u32_f32(four([1.0, 2.0, 4.0, 8.0]));
    let row = |row: uint32x4_t| vaddvq_u32(vandq_u32(row, lanes));
    row(mask[0]) | row(mask[1]) << BLOCK_WIDTH
}

/// The lanes of `bits` as a mask.
#[target_feature(enable = "neon")]
fn masks(bits: u32) -> [uint32x4_t; BLOCK_HEIGHT] {
    let lanes = vcvtq_u32_f32(four([1.0, 2.0, 4.0, 8.0]));
    let row = |bits: u32| vtstq_u32(vdupq_n_u32(bits), lanes);
    [row(bits), row(bits >> BLOCK_WIDTH)]
}

/// log2(255 · alpha) of a splat at four pixels.
#[target_feature(enable = "neon")]
#[inline]
fn power_at(splat: &TileSplat, x: float32x4_t, y: float32x4_t) -> float32x4_t {
    let row = vfmaq_f32(vdupq_n_f32(splat.u0), vdupq_n_f32(splat.b), y);
    let u = vfmaq_f32(row, vdupq_n_f32(splat.a), x);
    let v = vfmaq_f32(vdupq_n_f32(splat.v0), vdupq_n_f32(splat.c), y);
    vfmsq_f32(vfmsq_f32(vdupq_n_f32(splat.power), v, v), u, u)
}

/// Blends one splat into a row of four pixels; see `portable::blend_pixel` for the same in plain code.
#[target_feature(enable = "neon")]
#[inline]
fn blend_row<const TRACK_OBJECTS: bool>(
    pixels: &mut Pixels,
    row: usize,
    splat: &TileSplat,
    power: float32x4_t,
    is_drawn: uint32x4_t,
) {
    let transmittance = pixels.transmittance[row];
    let is_live = vcgeq_f32(transmittance, vdupq_n_f32(TRANSMITTANCE_STOP));
    let alpha = vminq_f32(alpha_of(power), vdupq_n_f32(ALPHA_MAX));
    let takes = vandq_u32(is_drawn, is_live);
    let alpha = vreinterpretq_f32_u32(vandq_u32(vreinterpretq_u32_f32(alpha), takes));
    let weight = vmulq_f32(alpha, transmittance);
    pixels.transmittance[row] = vsubq_f32(transmittance, weight);
    for (sum, &value) in pixels.colour.iter_mut().zip(&splat.colour) {
        sum[row] = vfmaq_f32(sum[row], weight, vdupq_n_f32(value));
    }
    pixels.depth[row] = vfmaq_f32(pixels.depth[row], weight, vdupq_n_f32(splat.depth));
    if TRACK_OBJECTS {
        let is_heavier = vcgtq_f32(weight, pixels.weight[row]);
        let object = vdupq_n_s32(splat.object);
        pixels.object[row] = vbslq_s32(is_heavier, object, pixels.object[row]);
        pixels.weight[row] = vmaxq_f32(pixels.weight[row], weight);
    }
}

/// 2^power / 255 for -118 < power < 127; anything else gives bits that the caller masks.
#[target_feature(enable = "neon")]
#[inline]
fn alpha_of(power: float32x4_t) -> float32x4_t {
    // Adding 1.5·2²³ rounds to a whole number and leaves it in the low bits.
    let magic = vdupq_n_f32(12_582_912.0);
    let shifted = vaddq_f32(power, magic);
    let part = vsubq_f32(power, vsubq_f32(shifted, magic));
    let mut sum = vdupq_n_f32(ALPHA_OF[5]);
    for k in (0..5).rev() {
        sum = vfmaq_f32(vdupq_n_f32(ALPHA_OF[k]), sum, part);
    }
    let exponent = vshlq_n_s32::<23>(vreinterpretq_s32_f32(shifted));
    vreinterpretq_f32_s32(vaddq_s32(vreinterpretq_s32_f32(sum), exponent))
}

#[target_feature(enable = "neon")]
#[inline]
fn four(values: [f32; 4]) -> float32x4_t {
    // SAFETY: `values` is four floats; the load needs no alignment.
    unsafe { vld1q_f32(values.as_ptr()) }
}

#[target_feature(enable = "neon")]
#[inline]
fn load(block: &[f32; BLOCK_PIXELS]) -> Rows {
    // SAFETY: a block is eight floats; the loads need no alignment.
    unsafe {
        [
            vld1q_f32(block.as_ptr()),
            vld1q_f32(block.as_ptr().add(BLOCK_WIDTH)),
        ]
    }
}

#[target_feature(enable = "neon")]
#[inline]
fn store(block: &mut [f32; BLOCK_PIXELS], rows: Rows) {
    // SAFETY: a block is eight floats; the stores need no alignment.
    unsafe {
        vst1q_f32(block.as_mut_ptr(), rows[0]);
        vst1q_f32(block.as_mut_ptr().add(BLOCK_WIDTH), rows[1]);
    }
}

#[target_feature(enable = "neon")]
fn load_pixels(block: &PixelBlock) -> Pixels {
    let objects = block.object.as_ptr();
    Pixels {
        transmittance: load(&block.transmittance),
        colour: [
            load(&block.colour[0]),
            load(&block.colour[1]),
            load(&block.colour[2]),
        ],
        depth: load(&block.depth),
        weight: load(&block.weight),
        // SAFETY: a block has eight objects; the loads need no alignment.
        object: unsafe { [vld1q_s32(objects), vld1q_s32(objects.add(BLOCK_WIDTH))] },
    }
}

#[target_feature(enable = "neon")]
fn store_pixels(block: &mut PixelBlock, pixels: &Pixels) {
    store(&mut block.transmittance, pixels.transmittance);
    for (target, &value) in block.colour.iter_mut().zip(&pixels.colour) {
        store(target, value);
    }
    store(&mut block.depth, pixels.depth);
    store(&mut block.weight, pixels.weight);
    let objects = block.object.as_mut_ptr();
    // SAFETY: a block has eight objects; the stores need no alignment.
    unsafe {
        vst1q_s32(objects, pixels.object[0]);
        vst1q_s32(objects.add(BLOCK_WIDTH), pixels.object[1]);
    }
}
