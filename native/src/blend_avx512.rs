//! The blend kernel for AVX-512: sixteen pixels (a square) at a time, else as `blend_avx2`.
//!
//! Every sample goes through the same operations in the same order as there, so both kernels give
//! the same bits.

use std::arch::x86_64::*;

use crate::batch::{Batch, PatchList, BATCH, RUN, SPARE};
use crate::blend::{PixelBlock, Tile, TileSplat, TileWork, ALPHA_MAX, TRANSMITTANCE_STOP};
use crate::project::STEP_DOUBT;
use crate::square_avx512::{
    alpha_of, blocks_of, live_squares, load, pixels_of, power_at, square_masks, store, store_whole,
    whitened, SQUARES, SQUARE_PIXELS,
};

/// Splats whose masks are read together.
const GROUP: usize = SPARE;

const WHOLE: &str = "a batch is whole fours of splats";

/// As `blend::blend_tile`.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
pub fn blend_tile<const TRACK_OBJECTS: bool>(tile: &mut Tile, work: &TileWork) {
    let mut batch = Batch::empty();
    for slots in work.slots.chunks(BATCH) {
        let live = live_squares(|block| &tile.blocks[block].transmittance);
        if live == 0 {
            return;
        }
        batch.gather(work, slots);
        for first in (0..slots.len()).step_by(4) {
            let masks = square_masks(batch.splats[first..].first_chunk().expect(WHOLE));
            for (place, mask) in (first..slots.len()).zip(masks) {
                batch.masks[place] = mask & live;
            }
        }
        list_by_square(&mut batch, slots.len());
        for square in 0..SQUARES {
            blend_square::<TRACK_OBJECTS>(tile, &batch.of_patch(square, slots, work));
        }
    }
}

/// Blends a batch that reaches everywhere into every square: nothing but the inner loop.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
pub fn blend_everywhere(tile: &mut Tile, everything: &PatchList) {
    for square in 0..SQUARES {
        blend_square::<false>(tile, &everything.with_patch(square));
    }
}

/// Turns a mask of squares per splat into a list of splats per square.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn list_by_square(batch: &mut Batch<u16, SQUARES>, count: usize) {
    let counting: [u8; GROUP] = std::array::from_fn(|k| k as u8);
    // SAFETY: `counting` is 64 readable bytes; the load needs no alignment.
    let counting = unsafe { _mm512_loadu_si512(counting.as_ptr().cast()) };
    for first in (0..count).step_by(GROUP) {
        let (low, high) = batch.masks[first..first + GROUP].split_at(GROUP / 2);
        // SAFETY: both halves are 64 readable bytes; the loads need no alignment.
        let (low, high) = unsafe {
            (
                _mm512_loadu_si512(low.as_ptr().cast()),
                _mm512_loadu_si512(high.as_ptr().cast()),
            )
        };
        let places = _mm512_add_epi8(counting, _mm512_set1_epi8(first as i8));
        for square in 0..SQUARES {
            let bit = _mm512_set1_epi16(1 << square);
            let chosen = u64::from(_mm512_test_epi16_mask(low, bit))
                | u64::from(_mm512_test_epi16_mask(high, bit)) << (GROUP / 2);
            let length = batch.lengths[square];
            let target = &mut batch.lists[square][length..length + GROUP];
            let packed = _mm512_maskz_compress_epi8(chosen, places);
            // SAFETY: `target` is 64 writable bytes; the store needs no alignment.
            unsafe { _mm512_storeu_si512(target.as_mut_ptr().cast(), packed) };
            batch.lengths[square] = length + chosen.count_ones() as usize;
        }
    }
}

/// The state of a square in registers.
#[derive(Clone, Copy)]
struct Pixels {
    transmittance: __m512,
    colour: [__m512; 3],
    depth: __m512,
    weight: __m512,
    object: __m512i,
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn blend_square<const TRACK_OBJECTS: bool>(tile: &mut Tile, todo: &PatchList) {
    if todo.list.is_empty() {
        return;
    }
    let [upper, lower] = blocks_of(todo.patch);
    let before = load_pixels(&tile.blocks[upper], &tile.blocks[lower]);
    let (mut after, nearest) = blend_list::<TRACK_OBJECTS, false>(before, todo);
    if _mm512_cmp_ps_mask::<_CMP_LT_OQ>(nearest, _mm512_set1_ps(STEP_DOUBT)) != 0 {
        after = blend_carefully::<TRACK_OBJECTS>(before, todo);
    }
    let (above, below) = tile.blocks.split_at_mut(lower);
    store_pixels(&mut above[upper], &mut below[0], &after);
}

/// The rare second pass, in which doubtful samples go to the judge. Kept apart so that the call
/// costs the first pass no registers.
#[cold]
#[inline(never)]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn blend_carefully<const TRACK_OBJECTS: bool>(before: Pixels, todo: &PatchList) -> Pixels {
    blend_list::<TRACK_OBJECTS, true>(before, todo).0
}

/// Blends a list of splats; also returns how near any sample came to the 1/255 step, per lane.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn blend_list<const TRACK_OBJECTS: bool, const CAREFUL: bool>(
    mut pixels: Pixels,
    todo: &PatchList,
) -> (Pixels, __m512) {
    let (x, y) = pixels_of(todo.patch);
    let stop = _mm512_set1_ps(TRANSMITTANCE_STOP);
    let mut nearest = _mm512_set1_ps(f32::INFINITY);
    for run in todo.list.chunks(RUN) {
        for &place in run {
            let place = place as usize % BATCH;
            let splat = &todo.splats[place];
            let (u, v) = whitened(splat, x, y);
            let power = power_at(splat, u, v);
            let distance = _mm512_abs_ps(power);
            nearest = _mm512_min_ps(nearest, distance);
            let mut is_drawn = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(power, _mm512_setzero_ps());
            if CAREFUL {
                let doubt = _mm512_set1_ps(STEP_DOUBT);
                let doubtful = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(distance, doubt);
                let (verdict, doubtful) = (u32::from(is_drawn), u32::from(doubtful));
                is_drawn = todo.settle::<SQUARE_PIXELS>(place, verdict, doubtful) as u16;
            }
            blend_one::<TRACK_OBJECTS>(&mut pixels, splat, power, is_drawn);
        }
        if _mm512_cmp_ps_mask::<_CMP_GE_OQ>(pixels.transmittance, stop) == 0 {
            break;
        }
    }
    (pixels, nearest)
}

/// Blends one splat into sixteen pixels; see `blend::blend_splat` for the same in plain code.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn blend_one<const TRACK_OBJECTS: bool>(
    pixels: &mut Pixels,
    splat: &TileSplat,
    power: __m512,
    is_drawn: __mmask16,
) {
    let stop = _mm512_set1_ps(TRANSMITTANCE_STOP);
    // Only what follows the limit waits for the splat before; the multipliers set the pace, so that
    // a difference is better than another product.
    let alpha = _mm512_min_ps(alpha_of(power), _mm512_set1_ps(ALPHA_MAX));
    let before = pixels.transmittance;
    let takes = _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(is_drawn, before, stop);
    let weight = _mm512_maskz_mul_ps(takes, alpha, before);
    pixels.transmittance = _mm512_sub_ps(before, weight);
    for (sum, &value) in pixels.colour.iter_mut().zip(&splat.colour) {
        *sum = _mm512_fmadd_ps(weight, _mm512_set1_ps(value), *sum);
    }
    pixels.depth = _mm512_fmadd_ps(weight, _mm512_set1_ps(splat.depth), pixels.depth);
    if TRACK_OBJECTS {
        let is_heavier = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(weight, pixels.weight);
        pixels.object = _mm512_mask_set1_epi32(pixels.object, is_heavier, splat.object);
        pixels.weight = _mm512_max_ps(pixels.weight, weight);
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn load_pixels(upper: &PixelBlock, lower: &PixelBlock) -> Pixels {
    Pixels {
        transmittance: load(&upper.transmittance, &lower.transmittance),
        colour: [
            load(&upper.colour[0], &lower.colour[0]),
            load(&upper.colour[1], &lower.colour[1]),
            load(&upper.colour[2], &lower.colour[2]),
        ],
        depth: load(&upper.depth, &lower.depth),
        weight: load(&upper.weight, &lower.weight),
        object: _mm512_castps_si512(load(&upper.object, &lower.object)),
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn store_pixels(upper: &mut PixelBlock, lower: &mut PixelBlock, pixels: &Pixels) {
    store(
        pixels.transmittance,
        &mut upper.transmittance,
        &mut lower.transmittance,
    );
    for (k, &value) in pixels.colour.iter().enumerate() {
        store(value, &mut upper.colour[k], &mut lower.colour[k]);
    }
    store(pixels.depth, &mut upper.depth, &mut lower.depth);
    store(pixels.weight, &mut upper.weight, &mut lower.weight);
    store_whole(pixels.object, &mut upper.object, &mut lower.object);
}
