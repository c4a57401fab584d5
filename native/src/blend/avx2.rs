//! The blend kernel for AVX2 + FMA: eight pixels (4×2) at a time, block after block.
//!
//! Which splats touch which block follows from the exact spans of each row of pixels and a bit
//! transpose; see `batch`.

use std::arch::x86_64::*;

use crate::blend::by_blocks::blend_by_blocks;
use crate::lanes::avx2::Avx2;
use crate::lanes::block_avx2::block_mask;
use crate::lanes::vector::{alpha_of, power_at, whitened};
use crate::project::record::STEP_DOUBT;
use crate::tile::batch::{corner, Batch, PatchList, BATCH, RUN};
use crate::tile::pixels::{PixelBlock, Tile, ALPHA_MAX, BLOCKS, BLOCK_PIXELS, TRANSMITTANCE_STOP};
use crate::tile::splat::{TileSplat, TileWork};

/// Splats whose masks are read together.
const GROUP: usize = 8;

/// Bit positions of every byte value, packed to the front.
static POSITIONS: [[u8; 8]; 256] = positions();

const fn positions() -> [[u8; 8]; 256] {
    let mut table = [[0; 8]; 256];
    let mut value = 0;
    while value < 256 {
        let (mut bit, mut count) = (0, 0);
        while bit < 8 {
            if value >> bit & 1 == 1 {
                table[value][count] = bit as u8;
                count += 1;
            }
            bit += 1;
        }
        value += 1;
    }
    table
}

blend_by_blocks!("avx2,fma,popcnt");

/// One bit per block that still takes light.
#[target_feature(enable = "avx2,fma")]
fn live_blocks(tile: &Tile) -> u32 {
    let mut live = 0;
    for (index, block) in tile.blocks.iter().enumerate() {
        let is_live = block.transmittance.iter().any(|&t| t >= TRANSMITTANCE_STOP);
        live |= u32::from(is_live) << index;
    }
    live
}

/// Turns a mask of blocks per splat into a list of splats per block.
#[target_feature(enable = "avx2,fma,popcnt")]
fn list_by_block(batch: &mut Batch<u32, BLOCKS>, count: usize) {
    for first in (0..count).step_by(GROUP) {
        let masks: &[u32; GROUP] = batch.masks[first..first + GROUP]
            .try_into()
            .expect("a batch is whole groups");
        // SAFETY: `masks` is 32 readable bytes; the load needs no alignment.
        let mut masks = unsafe { _mm256_loadu_si256(masks.as_ptr().cast()) };
        let places = first as u64 * 0x0101_0101_0101_0101;
        for block in (0..BLOCKS).rev() {
            let chosen = _mm256_movemask_ps(_mm256_castsi256_ps(masks)) as usize;
            masks = _mm256_add_epi32(masks, masks);
            let length = batch.lengths[block];
            let packed = u64::from_le_bytes(POSITIONS[chosen]) + places;
            batch.lists[block][length..length + GROUP].copy_from_slice(&packed.to_le_bytes());
            batch.lengths[block] = length + chosen.count_ones() as usize;
        }
    }
}

/// The state of a block in registers.
#[derive(Clone, Copy)]
struct Pixels {
    transmittance: __m256,
    colour: [__m256; 3],
    depth: __m256,
    weight: __m256,
    object: __m256,
}

#[target_feature(enable = "avx2,fma")]
fn blend_block<const TRACK_OBJECTS: bool>(block: &mut PixelBlock, todo: &PatchList) {
    if todo.list.is_empty() {
        return;
    }
    let stop = _mm256_set1_ps(TRANSMITTANCE_STOP);
    let mut pixels = load_pixels(block);
    for run in todo.list.chunks(RUN) {
        let (mut after, nearest) = blend_run::<TRACK_OBJECTS, false>(pixels, run, todo);
        let is_doubtful = _mm256_cmp_ps::<_CMP_LT_OQ>(nearest, _mm256_set1_ps(STEP_DOUBT));
        if _mm256_movemask_ps(is_doubtful) != 0 {
            after = blend_carefully::<TRACK_OBJECTS>(pixels, run, todo);
        }
        pixels = after;
        let is_live = _mm256_cmp_ps::<_CMP_GE_OQ>(pixels.transmittance, stop);
        if _mm256_movemask_ps(is_live) == 0 {
            break;
        }
    }
    store_pixels(block, &pixels);
}

/// The rare second look at a run, in which doubtful samples go to the judge. Kept apart so that the
/// call costs the first no registers.
#[cold]
#[inline(never)]
#[target_feature(enable = "avx2,fma")]
fn blend_carefully<const TRACK_OBJECTS: bool>(
    before: Pixels,
    run: &[u8],
    todo: &PatchList,
) -> Pixels {
    blend_run::<TRACK_OBJECTS, true>(before, run, todo).0
}

/// Blends a run of the list of `todo`; also returns how near any sample came to the 1/255 step, per
/// lane.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn blend_run<const TRACK_OBJECTS: bool, const CAREFUL: bool>(
    mut pixels: Pixels,
    run: &[u8],
    todo: &PatchList,
) -> (Pixels, __m256) {
    let (left, top) = corner::<BLOCK_PIXELS>(todo.patch);
    let x = _mm256_add_ps(
        _mm256_set1_ps(left as f32),
        _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0),
    );
    let y = _mm256_add_ps(
        _mm256_set1_ps(top as f32),
        _mm256_setr_ps(0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0),
    );
    let mut nearest = _mm256_set1_ps(f32::INFINITY);
    for &place in run {
        let place = place as usize % BATCH;
        let splat = &todo.splats[place];
        let (u, v) = whitened(splat, Avx2(x), Avx2(y));
        let power = power_at(splat, u, v).0;
        let distance = _mm256_andnot_ps(_mm256_set1_ps(-0.0), power);
        nearest = _mm256_min_ps(nearest, distance);
        let mut is_drawn = _mm256_cmp_ps::<_CMP_GE_OQ>(power, _mm256_setzero_ps());
        if CAREFUL {
            let is_doubtful = _mm256_cmp_ps::<_CMP_LT_OQ>(distance, _mm256_set1_ps(STEP_DOUBT));
            let verdict = _mm256_movemask_ps(is_drawn) as u32;
            let doubtful = _mm256_movemask_ps(is_doubtful) as u32;
            is_drawn = mask_of(todo.settle::<BLOCK_PIXELS>(place, verdict, doubtful));
        }
        blend_one::<TRACK_OBJECTS>(&mut pixels, splat, power, is_drawn);
    }
    (pixels, nearest)
}

/// The lanes of `bits` as a mask.
#[target_feature(enable = "avx2,fma")]
fn mask_of(bits: u32) -> __m256 {
    let lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    let chosen = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lanes);
    _mm256_castsi256_ps(_mm256_cmpeq_epi32(chosen, lanes))
}

/// Blends one splat into eight pixels; see `portable::blend_splat` for the same in plain code.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn blend_one<const TRACK_OBJECTS: bool>(
    pixels: &mut Pixels,
    splat: &TileSplat,
    power: __m256,
    is_drawn: __m256,
) {
    let stop = _mm256_set1_ps(TRANSMITTANCE_STOP);
    let is_live = _mm256_cmp_ps::<_CMP_GE_OQ>(pixels.transmittance, stop);
    // Only what follows waits for the splat before.
    let alpha = _mm256_min_ps(alpha_of(Avx2(power)).0, _mm256_set1_ps(ALPHA_MAX));
    let alpha = _mm256_and_ps(_mm256_and_ps(alpha, is_drawn), is_live);
    let weight = _mm256_mul_ps(alpha, pixels.transmittance);
    pixels.transmittance = _mm256_sub_ps(pixels.transmittance, weight);
    for (sum, &value) in pixels.colour.iter_mut().zip(&splat.colour) {
        *sum = _mm256_fmadd_ps(weight, _mm256_set1_ps(value), *sum);
    }
    pixels.depth = _mm256_fmadd_ps(weight, _mm256_set1_ps(splat.depth), pixels.depth);
    if TRACK_OBJECTS {
        let is_heavier = _mm256_cmp_ps::<_CMP_GT_OQ>(weight, pixels.weight);
        let object = _mm256_castsi256_ps(_mm256_set1_epi32(splat.object));
        pixels.object = _mm256_blendv_ps(pixels.object, object, is_heavier);
        pixels.weight = _mm256_max_ps(pixels.weight, weight);
    }
}

#[target_feature(enable = "avx2,fma")]
fn load_pixels(block: &PixelBlock) -> Pixels {
    // SAFETY: every source is an array of eight 4-byte values; the loads need no alignment.
    unsafe {
        Pixels {
            transmittance: _mm256_loadu_ps(block.transmittance.as_ptr()),
            colour: [
                _mm256_loadu_ps(block.colour[0].as_ptr()),
                _mm256_loadu_ps(block.colour[1].as_ptr()),
                _mm256_loadu_ps(block.colour[2].as_ptr()),
            ],
            depth: _mm256_loadu_ps(block.depth.as_ptr()),
            weight: _mm256_loadu_ps(block.weight.as_ptr()),
            object: _mm256_loadu_ps(block.object.as_ptr().cast()),
        }
    }
}

#[target_feature(enable = "avx2,fma")]
fn store_pixels(block: &mut PixelBlock, pixels: &Pixels) {
    // SAFETY: every target is an array of eight 4-byte values; the stores need no alignment.
    unsafe {
        _mm256_storeu_ps(block.transmittance.as_mut_ptr(), pixels.transmittance);
        for (target, &value) in block.colour.iter_mut().zip(&pixels.colour) {
            _mm256_storeu_ps(target.as_mut_ptr(), value);
        }
        _mm256_storeu_ps(block.depth.as_mut_ptr(), pixels.depth);
        _mm256_storeu_ps(block.weight.as_mut_ptr(), pixels.weight);
        _mm256_storeu_ps(block.object.as_mut_ptr().cast(), pixels.object);
    }
}
