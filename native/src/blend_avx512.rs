//! The blend kernel for AVX-512: sixteen pixels (4×4) at a time, else as `blend_avx2`.
//!
//! Every sample goes through the same operations in the same order as there, so both kernels give
//! the same bits. A square is the two blocks of a tile that lie one above the other.

use std::arch::x86_64::*;

use crate::bin::TILE;
use crate::blend::{
    PixelBlock, Tile, TileSplat, TileWork, ALPHA_MAX, ALPHA_OF, BLOCKS, BLOCKS_ACROSS, BLOCK_WIDTH,
    TRANSMITTANCE_STOP,
};
use crate::blend_avx2::{fetch_ahead, BATCH, RUN};
use crate::project::STEP_DOUBT;

/// Splats whose masks are read together.
const GROUP: usize = 64;
const SQUARES: usize = BLOCKS / 2;
const SQUARE_HEIGHT: usize = 4;

/// Working memory of one tile's batch.
struct Batch {
    splats: [TileSplat; BATCH],
    /// One bit per square that the splat touches.
    masks: [u16; BATCH],
    /// Splats of each square, in order; room for the bytes that each append stores.
    lists: [[u8; BATCH + GROUP]; SQUARES],
    lengths: [usize; SQUARES],
}

/// As `blend::blend_tile`.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
pub fn blend_tile<const TRACK_OBJECTS: bool>(tile: &mut Tile, work: &TileWork) {
    let mut batch = Batch {
        splats: [TileSplat::default(); BATCH],
        masks: [0; BATCH],
        lists: [[0; BATCH + GROUP]; SQUARES],
        lengths: [0; SQUARES],
    };
    for chosen in work.slots.chunks(BATCH) {
        let live = live_squares(tile);
        if live == 0 {
            return;
        }
        for (place, &slot) in chosen.iter().enumerate() {
            fetch_ahead(work, chosen, place);
            let splat = TileSplat::new(work, slot);
            batch.masks[place] = square_mask(&splat) & live;
            batch.splats[place] = splat;
        }
        batch.masks[chosen.len()..].fill(0);
        list_by_square(&mut batch, chosen.len());
        for square in 0..SQUARES {
            let list = &batch.lists[square][..batch.lengths[square]];
            let chosen = Chosen {
                splats: &batch.splats,
                slots: chosen,
                work,
            };
            blend_square::<TRACK_OBJECTS>(tile, square, list, &chosen);
        }
    }
}

/// The blocks that make up a square.
#[inline(always)]
fn blocks_of(square: usize) -> [usize; 2] {
    let upper = square / BLOCKS_ACROSS * 2 * BLOCKS_ACROSS + square % BLOCKS_ACROSS;
    [upper, upper + BLOCKS_ACROSS]
}

/// One bit per square that still takes light.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn live_squares(tile: &Tile) -> u16 {
    let mut live = 0;
    for square in 0..SQUARES {
        let mut pixels = blocks_of(square)
            .into_iter()
            .flat_map(|block| &tile.blocks[block].transmittance);
        live |= u16::from(pixels.any(|&t| t >= TRANSMITTANCE_STOP)) << square;
    }
    live
}

/// One bit per square that the alpha = 1/255 ellipse touches, from the span of every row of pixels.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
#[inline]
pub(crate) fn square_mask(splat: &TileSplat) -> u16 {
    const SLACK_PX: f32 = 0.01;
    const SLACK_POWER: f32 = 1e-3;
    const LAST_COLUMN: f32 = TILE as f32 - 1.0;
    let rows = _mm512_setr_ps(
        0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
    );
    let zero = _mm512_setzero_ps();
    let inverse_a = _mm512_set1_ps(splat.inverse_a);
    let v = _mm512_fmadd_ps(_mm512_set1_ps(splat.c), rows, _mm512_set1_ps(splat.v0));
    let left_over = _mm512_fnmadd_ps(v, v, _mm512_set1_ps(splat.power + SLACK_POWER));
    let is_touched = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(left_over, zero);
    let root = _mm512_sqrt_ps(_mm512_max_ps(left_over, zero));
    let half = _mm512_fmadd_ps(root, inverse_a, _mm512_set1_ps(SLACK_PX));
    let row = _mm512_fmadd_ps(_mm512_set1_ps(splat.b), rows, _mm512_set1_ps(splat.u0));
    let first = _mm512_max_ps(_mm512_fnmsub_ps(row, inverse_a, half), zero);
    let last = _mm512_min_ps(
        _mm512_fnmadd_ps(row, inverse_a, half),
        _mm512_set1_ps(LAST_COLUMN),
    );
    let first = _mm512_roundscale_ps::<{ _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC }>(first);
    let last = _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(last);
    let is_touched = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(is_touched, first, last);
    // Empty spans may be far outside; they are masked below, so what the conversion makes of them
    // does not matter (variable shifts by 32 and more give 0).
    let first_square = _mm512_srai_epi32::<2>(_mm512_cvttps_epi32(first));
    let last_square = _mm512_srai_epi32::<2>(_mm512_cvttps_epi32(last));
    let all = _mm512_set1_epi32((1 << BLOCKS_ACROSS) - 1);
    let from_first = _mm512_sllv_epi32(all, first_square);
    let beyond_last = _mm512_sub_epi32(_mm512_set1_epi32(BLOCKS_ACROSS as i32 - 1), last_square);
    let to_last = _mm512_srlv_epi32(all, beyond_last);
    let nibble = _mm512_maskz_and_epi32(is_touched, from_first, to_last);
    let shifts = _mm512_setr_epi32(0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12);
    _mm512_reduce_or_epi32(_mm512_sllv_epi32(nibble, shifts)) as u16
}

/// Turns a mask of squares per splat into a list of splats per square.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn list_by_square(batch: &mut Batch, count: usize) {
    batch.lengths = [0; SQUARES];
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

/// A batch as the inner loop sees it.
#[derive(Clone, Copy)]
struct Chosen<'a> {
    splats: &'a [TileSplat; BATCH],
    /// Record of each splat of the batch.
    slots: &'a [u32],
    work: &'a TileWork<'a>,
}

impl Chosen<'_> {
    /// Takes the lanes of `doubtful` (one bit each) to the judge; the others keep their verdict.
    #[cold]
    #[inline(never)]
    fn settle(&self, place: usize, square: usize, mut verdict: u16, doubtful: u16) -> u16 {
        for lane in (0..16).filter(|lane| doubtful >> lane & 1 == 1) {
            let x = square % BLOCKS_ACROSS * BLOCK_WIDTH + lane % BLOCK_WIDTH;
            let y = square / BLOCKS_ACROSS * SQUARE_HEIGHT + lane / BLOCK_WIDTH;
            let is_drawn = self.work.is_drawn(self.slots[place], x, y);
            verdict = verdict & !(1 << lane) | u16::from(is_drawn) << lane;
        }
        verdict
    }
}

/// The state of a square in registers.
#[derive(Clone, Copy)]
struct Pixels {
    transmittance: __m512,
    colour: [__m512; 3],
    depth: __m512,
    weight: __m512,
    object: __m512,
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn blend_square<const TRACK_OBJECTS: bool>(
    tile: &mut Tile,
    square: usize,
    list: &[u8],
    chosen: &Chosen,
) {
    if list.is_empty() {
        return;
    }
    let [upper, lower] = blocks_of(square);
    let before = load_pixels(&tile.blocks[upper], &tile.blocks[lower]);
    let (mut after, nearest) = blend_list::<TRACK_OBJECTS, false>(before, square, list, chosen);
    if _mm512_cmp_ps_mask::<_CMP_LT_OQ>(nearest, _mm512_set1_ps(STEP_DOUBT)) != 0 {
        after = blend_carefully::<TRACK_OBJECTS>(before, square, list, chosen);
    }
    let [low, high] = halves(&after);
    store_pixels(&mut tile.blocks[upper], &low);
    store_pixels(&mut tile.blocks[lower], &high);
}

/// The rare second pass, in which doubtful samples go to the judge. Kept apart so that the call
/// costs the first pass no registers.
#[cold]
#[inline(never)]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn blend_carefully<const TRACK_OBJECTS: bool>(
    before: Pixels,
    square: usize,
    list: &[u8],
    chosen: &Chosen,
) -> Pixels {
    blend_list::<TRACK_OBJECTS, true>(before, square, list, chosen).0
}

/// Blends a list of splats; also returns how near any sample came to the 1/255 step, per lane.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
#[inline]
fn blend_list<const TRACK_OBJECTS: bool, const CAREFUL: bool>(
    mut pixels: Pixels,
    square: usize,
    list: &[u8],
    chosen: &Chosen,
) -> (Pixels, __m512) {
    let left = (square % BLOCKS_ACROSS * BLOCK_WIDTH) as f32;
    let top = (square / BLOCKS_ACROSS * SQUARE_HEIGHT) as f32;
    let x = _mm512_setr_ps(
        0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0,
    );
    let y = _mm512_setr_ps(
        0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0,
    );
    let x = _mm512_add_ps(_mm512_set1_ps(left), x);
    let y = _mm512_add_ps(_mm512_set1_ps(top), y);
    let stop = _mm512_set1_ps(TRANSMITTANCE_STOP);
    let mut nearest = _mm512_set1_ps(f32::INFINITY);
    for run in list.chunks(RUN) {
        for &place in run {
            let place = place as usize % BATCH;
            let splat = &chosen.splats[place];
            let power = power_at(splat, x, y);
            let distance = _mm512_abs_ps(power);
            nearest = _mm512_min_ps(nearest, distance);
            let mut is_drawn = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(power, _mm512_setzero_ps());
            if CAREFUL {
                let doubt = _mm512_set1_ps(STEP_DOUBT);
                let doubtful = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(distance, doubt);
                if doubtful != 0 {
                    is_drawn = chosen.settle(place, square, is_drawn, doubtful);
                }
            }
            blend_one::<TRACK_OBJECTS>(&mut pixels, splat, power, is_drawn);
        }
        if _mm512_cmp_ps_mask::<_CMP_GE_OQ>(pixels.transmittance, stop) == 0 {
            break;
        }
    }
    (pixels, nearest)
}

/// log2(255 · alpha) of a splat at sixteen pixels.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
#[inline]
fn power_at(splat: &TileSplat, x: __m512, y: __m512) -> __m512 {
    let u = _mm512_fmadd_ps(
        _mm512_set1_ps(splat.a),
        x,
        _mm512_fmadd_ps(_mm512_set1_ps(splat.b), y, _mm512_set1_ps(splat.u0)),
    );
    let v = _mm512_fmadd_ps(_mm512_set1_ps(splat.c), y, _mm512_set1_ps(splat.v0));
    let power = _mm512_fnmadd_ps(v, v, _mm512_set1_ps(splat.power));
    _mm512_fnmadd_ps(u, u, power)
}

/// Blends one splat into sixteen pixels; see `blend::blend_splat` for the same in plain code.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
#[inline]
fn blend_one<const TRACK_OBJECTS: bool>(
    pixels: &mut Pixels,
    splat: &TileSplat,
    power: __m512,
    is_drawn: __mmask16,
) {
    let stop = _mm512_set1_ps(TRANSMITTANCE_STOP);
    // Only the masked operations wait for the splat before: that chain sets the pace.
    let alpha = _mm512_min_ps(alpha_of(power), _mm512_set1_ps(ALPHA_MAX));
    let before = pixels.transmittance;
    let takes = _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(is_drawn, before, stop);
    let weight = _mm512_maskz_mul_ps(takes, alpha, before);
    pixels.transmittance = _mm512_mask_fnmadd_ps(before, takes, alpha, before);
    for (sum, &value) in pixels.colour.iter_mut().zip(&splat.colour) {
        *sum = _mm512_fmadd_ps(weight, _mm512_set1_ps(value), *sum);
    }
    pixels.depth = _mm512_fmadd_ps(weight, _mm512_set1_ps(splat.depth), pixels.depth);
    if TRACK_OBJECTS {
        let is_heavier = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(weight, pixels.weight);
        let object = _mm512_castsi512_ps(_mm512_set1_epi32(splat.object));
        pixels.object = _mm512_mask_mov_ps(pixels.object, is_heavier, object);
        pixels.weight = _mm512_max_ps(pixels.weight, weight);
    }
}

/// 2^power / 255 for -118 < power < 127; anything else gives bits that the caller masks.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
#[inline]
fn alpha_of(power: __m512) -> __m512 {
    // Adding 1.5·2²³ rounds to a whole number and leaves it in the low bits.
    let magic = _mm512_set1_ps(12_582_912.0);
    let shifted = _mm512_add_ps(power, magic);
    let part = _mm512_sub_ps(power, _mm512_sub_ps(shifted, magic));
    let mut sum = _mm512_set1_ps(ALPHA_OF[5]);
    for k in (0..5).rev() {
        sum = _mm512_fmadd_ps(sum, part, _mm512_set1_ps(ALPHA_OF[k]));
    }
    let exponent = _mm512_slli_epi32::<23>(_mm512_castps_si512(shifted));
    _mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(sum), exponent))
}

/// The state of a block in registers: transmittance, three colours, depth, weight, object.
type Half = [__m256; 7];

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn load_pixels(upper: &PixelBlock, lower: &PixelBlock) -> Pixels {
    let (low, high) = (load_half(upper), load_half(lower));
    let joined = |k: usize| _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low[k]), high[k]);
    Pixels {
        transmittance: joined(0),
        colour: [joined(1), joined(2), joined(3)],
        depth: joined(4),
        weight: joined(5),
        object: joined(6),
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn load_half(block: &PixelBlock) -> Half {
    // SAFETY: every source is an array of eight 4-byte values; the loads need no alignment.
    unsafe {
        [
            _mm256_loadu_ps(block.transmittance.as_ptr()),
            _mm256_loadu_ps(block.colour[0].as_ptr()),
            _mm256_loadu_ps(block.colour[1].as_ptr()),
            _mm256_loadu_ps(block.colour[2].as_ptr()),
            _mm256_loadu_ps(block.depth.as_ptr()),
            _mm256_loadu_ps(block.weight.as_ptr()),
            _mm256_loadu_ps(block.object.as_ptr().cast()),
        ]
    }
}

/// The two blocks of a square.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn halves(pixels: &Pixels) -> [Half; 2] {
    let all = [
        pixels.transmittance,
        pixels.colour[0],
        pixels.colour[1],
        pixels.colour[2],
        pixels.depth,
        pixels.weight,
        pixels.object,
    ];
    [
        all.map(|value| _mm512_castps512_ps256(value)),
        all.map(|value| _mm512_extractf32x8_ps::<1>(value)),
    ]
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
fn store_pixels(block: &mut PixelBlock, half: &Half) {
    // SAFETY: every target is an array of eight 4-byte values; the stores need no alignment.
    unsafe {
        _mm256_storeu_ps(block.transmittance.as_mut_ptr(), half[0]);
        for (target, &value) in block.colour.iter_mut().zip(&half[1..4]) {
            _mm256_storeu_ps(target.as_mut_ptr(), value);
        }
        _mm256_storeu_ps(block.depth.as_mut_ptr(), half[4]);
        _mm256_storeu_ps(block.weight.as_mut_ptr(), half[5]);
        _mm256_storeu_ps(block.object.as_mut_ptr().cast(), half[6]);
    }
}
