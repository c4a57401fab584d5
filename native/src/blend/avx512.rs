//! The blend kernel for AVX-512: sixteen pixels (a square) at a time, else as `avx2`.
//!
//! Every sample goes through the same operations in the same order as there, so both kernels give
//! the same bits.

use std::arch::x86_64::*;
use std::mem::MaybeUninit;

use crate::lanes::avx512::Avx512;
use crate::lanes::square_avx512::{
    blocks_of, live_squares, load, row_terms, square_masks, store, store_whole, ROWS_OF_SQUARES,
    SQUARES, SQUARE_PIXELS,
};
use crate::lanes::vector::alpha_of;
use crate::project::record::STEP_DOUBT;
use crate::tile::batch::{corner, Batch, PatchList, BATCH, RUN, SPARE};
use crate::tile::pixels::{PixelBlock, Tile, ALPHA_MAX, BLOCKS_ACROSS, TRANSMITTANCE_STOP};
use crate::tile::splat::{TileSplat, TileWork};

/// Splats whose terms lie in one register.
const QUAD: usize = 4;
/// Splats whose masks are read together.
const GROUP: usize = SPARE;

/// Of two numbers the one nearer to 0, without its sign.
const SMALLER_SIZE: i32 = 0b10_10;

const WHOLE: &str = "a batch is whole fours of splats";

/// What of a batch's splats depends on the row of pixels alone (see `row_terms`), for one row of
/// squares: a quarter of a register each, so that a broadcast gives it to all columns of a square.
struct RowTerms {
    /// `b·y + u0`
    rows: [MaybeUninit<__m512>; BATCH / QUAD],
    /// `power - v²`
    left_over: [MaybeUninit<__m512>; BATCH / QUAD],
}

/// Filling them with zeros first would cost as much as filling them.
struct BatchTerms([RowTerms; ROWS_OF_SQUARES]);

impl BatchTerms {
    #[inline(always)]
    fn empty() -> Self {
        BatchTerms(
            [const {
                RowTerms {
                    rows: [MaybeUninit::uninit(); BATCH / QUAD],
                    left_over: [MaybeUninit::uninit(); BATCH / QUAD],
                }
            }; ROWS_OF_SQUARES],
        )
    }

    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
    #[inline]
    fn fill(&mut self, quad: usize, splats: &[TileSplat; QUAD]) {
        for (terms, [row, left_over]) in self.0.iter_mut().zip(row_terms(splats)) {
            terms.rows[quad].write(row);
            terms.left_over[quad].write(left_over);
        }
    }
}

impl RowTerms {
    /// The terms of one splat, for all columns.
    ///
    /// # Safety
    /// `BatchTerms::fill` has been called for the quad of `place`.
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
    #[inline]
    unsafe fn of_splat(&self, place: usize) -> (__m512, __m512) {
        let place = place % BATCH;
        let of = |terms: &[MaybeUninit<__m512>; BATCH / QUAD]| {
            let start: *const f32 = terms.as_ptr().cast();
            // SAFETY: the four values lie within `terms` and, says the caller, have been written.
            _mm512_broadcast_f32x4(unsafe { _mm_loadu_ps(start.add(QUAD * place)) })
        };
        (of(&self.rows), of(&self.left_over))
    }
}

/// As `portable::blend_tile`.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
pub fn blend_tile<const TRACK_OBJECTS: bool>(tile: &mut Tile, work: &TileWork) {
    let mut batch = Batch::empty();
    let mut terms = BatchTerms::empty();
    for slots in work.slots.chunks(BATCH) {
        let live = live_squares(|block| &tile.blocks[block].transmittance);
        if live == 0 {
            return;
        }
        batch.gather(work, slots);
        for first in (0..slots.len()).step_by(QUAD) {
            let quad = batch.splats[first..].first_chunk().expect(WHOLE);
            let masks = square_masks(quad);
            terms.fill(first / QUAD, quad);
            for (place, mask) in (first..slots.len()).zip(masks) {
                batch.masks[place] = mask & live;
            }
        }
        list_by_square(&mut batch, slots.len());
        for square in 0..SQUARES {
            let todo = batch.of_patch(square, slots, work);
            // SAFETY: the terms of all splats of `slots` have been filled in, and no others are listed.
            unsafe { blend_square::<TRACK_OBJECTS>(tile, &todo, &terms) };
        }
    }
}

/// Blends a batch that reaches everywhere into every square: nothing but the inner loop.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
pub fn blend_everywhere(tile: &mut Tile, everything: &PatchList) {
    let mut terms = BatchTerms::empty();
    for (quad, splats) in everything.splats.as_chunks().0.iter().enumerate() {
        terms.fill(quad, splats);
    }
    for square in 0..SQUARES {
        // SAFETY: the terms of the whole batch have been filled in.
        unsafe { blend_square::<false>(tile, &everything.with_patch(square), &terms) };
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

/// The state of a square in registers, column after column.
#[derive(Clone, Copy)]
struct Pixels {
    transmittance: __m512,
    colour: [__m512; 3],
    depth: __m512,
    weight: __m512,
    object: __m512i,
}

/// # Safety
/// `terms` hold those of all splats that `todo` lists.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
unsafe fn blend_square<const TRACK_OBJECTS: bool>(
    tile: &mut Tile,
    todo: &PatchList,
    terms: &BatchTerms,
) {
    if todo.list.is_empty() {
        return;
    }
    let [upper, lower] = blocks_of(todo.patch);
    let terms = &terms.0[todo.patch / BLOCKS_ACROSS];
    let stop = _mm512_set1_ps(TRANSMITTANCE_STOP);
    let mut pixels = load_pixels(&tile.blocks[upper], &tile.blocks[lower]);
    for run in todo.list.chunks(RUN) {
        // SAFETY: what the caller grants.
        let (mut after, nearest) =
            unsafe { blend_run::<TRACK_OBJECTS, false>(pixels, run, todo, terms) };
        if _mm512_cmp_ps_mask::<_CMP_LT_OQ>(nearest, _mm512_set1_ps(STEP_DOUBT)) != 0 {
            // SAFETY: as before.
            after = unsafe { blend_carefully::<TRACK_OBJECTS>(pixels, run, todo, terms) };
        }
        pixels = after;
        if _mm512_cmp_ps_mask::<_CMP_GE_OQ>(pixels.transmittance, stop) == 0 {
            break;
        }
    }
    let (above, below) = tile.blocks.split_at_mut(lower);
    store_pixels(&mut above[upper], &mut below[0], &pixels);
}

/// The rare second look at a run, in which doubtful samples go to the judge. Kept apart so that the
/// call costs the first no registers.
///
/// # Safety
/// As `blend_run`.
#[cold]
#[inline(never)]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
unsafe fn blend_carefully<const TRACK_OBJECTS: bool>(
    before: Pixels,
    run: &[u8],
    todo: &PatchList,
    terms: &RowTerms,
) -> Pixels {
    // SAFETY: what the caller grants.
    unsafe { blend_run::<TRACK_OBJECTS, true>(before, run, todo, terms).0 }
}

/// Blends a run of the list of `todo`; also returns how near any sample came to the 1/255 step, per
/// lane.
///
/// # Safety
/// `terms` hold those of all splats of `run`.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
unsafe fn blend_run<const TRACK_OBJECTS: bool, const CAREFUL: bool>(
    mut pixels: Pixels,
    run: &[u8],
    todo: &PatchList,
    terms: &RowTerms,
) -> (Pixels, __m512) {
    let x = columns_of(todo.patch);
    let mut nearest = _mm512_set1_ps(f32::INFINITY);
    for &place in run {
        let place = place as usize % BATCH;
        let splat = &todo.splats[place];
        // SAFETY: what the caller grants.
        let (row, left_over) = unsafe { terms.of_splat(place) };
        let u = _mm512_fmadd_ps(_mm512_set1_ps(splat.a), x, row);
        let power = _mm512_fnmadd_ps(u, u, left_over);
        nearest = _mm512_range_ps::<SMALLER_SIZE>(nearest, power);
        let mut is_drawn = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(power, _mm512_setzero_ps());
        if CAREFUL {
            let doubt = _mm512_set1_ps(STEP_DOUBT);
            let doubtful = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(_mm512_abs_ps(power), doubt);
            let (verdict, doubtful) = (transposed_bits(is_drawn), transposed_bits(doubtful));
            let settled =
                todo.settle::<SQUARE_PIXELS>(place, u32::from(verdict), u32::from(doubtful));
            is_drawn = transposed_bits(settled as u16);
        }
        blend_one::<TRACK_OBJECTS>(&mut pixels, splat, power, is_drawn);
    }
    (pixels, nearest)
}

/// Columns, in the tile, of a square's pixels, column after column.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn columns_of(square: usize) -> __m512 {
    let (left, _) = corner::<SQUARE_PIXELS>(square);
    let x = _mm512_setr_ps(
        0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0,
    );
    _mm512_add_ps(_mm512_set1_ps(left as f32), x)
}

/// Turns a square's pixels from row after row to column after column, and back.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn transposed(values: __m512) -> __m512 {
    let places = _mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
    _mm512_permutexvar_ps(places, values)
}

/// As `transposed`, for one bit per pixel.
fn transposed_bits(bits: u16) -> u16 {
    (0..16).fold(0, |turned, lane| {
        turned | (bits >> lane & 1) << (lane % 4 * 4 + lane / 4)
    })
}

/// Blends one splat into sixteen pixels; see `portable::blend_splat` for the same in plain code.
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
    let alpha = _mm512_maskz_min_ps(
        is_drawn,
        alpha_of(Avx512(power)).0,
        _mm512_set1_ps(ALPHA_MAX),
    );
    let before = pixels.transmittance;
    let takes = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(before, stop);
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
        transmittance: transposed(load(&upper.transmittance, &lower.transmittance)),
        colour: [
            transposed(load(&upper.colour[0], &lower.colour[0])),
            transposed(load(&upper.colour[1], &lower.colour[1])),
            transposed(load(&upper.colour[2], &lower.colour[2])),
        ],
        depth: transposed(load(&upper.depth, &lower.depth)),
        weight: transposed(load(&upper.weight, &lower.weight)),
        object: _mm512_castps_si512(transposed(load(&upper.object, &lower.object))),
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn store_pixels(upper: &mut PixelBlock, lower: &mut PixelBlock, pixels: &Pixels) {
    store(
        transposed(pixels.transmittance),
        &mut upper.transmittance,
        &mut lower.transmittance,
    );
    for (k, &value) in pixels.colour.iter().enumerate() {
        store(
            transposed(value),
            &mut upper.colour[k],
            &mut lower.colour[k],
        );
    }
    store(transposed(pixels.depth), &mut upper.depth, &mut lower.depth);
    store(
        transposed(pixels.weight),
        &mut upper.weight,
        &mut lower.weight,
    );
    let object = transposed(_mm512_castsi512_ps(pixels.object));
    store_whole(
        _mm512_castps_si512(object),
        &mut upper.object,
        &mut lower.object,
    );
}
