//! Sixteen pixels in one AVX-512 register: a square, the two blocks of a tile that lie one above the
//! other.

use std::arch::x86_64::*;

use crate::project::tile_box::TILE;
use crate::tile::batch::corner;
use crate::tile::pixels::{BLOCKS, BLOCKS_ACROSS, BLOCK_PIXELS, TRANSMITTANCE_STOP};
use crate::tile::splat::TileSplat;

/// Squares of a tile, pixels of a square, rows of squares.
pub const SQUARES: usize = BLOCKS / 2;
pub const SQUARE_PIXELS: usize = 2 * BLOCK_PIXELS;
pub const ROWS_OF_SQUARES: usize = SQUARES / BLOCKS_ACROSS;

/// The blocks that make up a square.
#[inline(always)]
pub fn blocks_of(square: usize) -> [usize; 2] {
    let upper = square / BLOCKS_ACROSS * 2 * BLOCKS_ACROSS + square % BLOCKS_ACROSS;
    [upper, upper + BLOCKS_ACROSS]
}

/// One bit per square that still takes light; `transmittance` is that of a block.
#[inline(always)]
pub fn live_squares<'a>(transmittance: impl Fn(usize) -> &'a [f32; BLOCK_PIXELS]) -> u16 {
    let is_live = |block| {
        let block: &[f32; BLOCK_PIXELS] = transmittance(block);
        block.iter().any(|&t| t >= TRANSMITTANCE_STOP)
    };
    (0..SQUARES).fold(0, |live, square| {
        let [upper, lower] = blocks_of(square);
        live | u16::from(is_live(upper) | is_live(lower)) << square
    })
}

/// Columns and rows of a square's pixels in its tile.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
pub fn pixels_of(square: usize) -> (__m512, __m512) {
    let (left, top) = corner::<SQUARE_PIXELS>(square);
    let x = _mm512_setr_ps(
        0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0,
    );
    let y = _mm512_setr_ps(
        0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0,
    );
    (
        _mm512_add_ps(_mm512_set1_ps(left as f32), x),
        _mm512_add_ps(_mm512_set1_ps(top as f32), y),
    )
}

/// The values (of four bytes) of the upper and the lower block of a square.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
pub fn load<T: Copy>(upper: &[T; BLOCK_PIXELS], lower: &[T; BLOCK_PIXELS]) -> __m512 {
    const { assert!(size_of::<T>() == 4) };
    // SAFETY: both sources are arrays of eight 4-byte values; the loads need no alignment.
    let (upper, lower) = unsafe {
        (
            _mm256_loadu_ps(upper.as_ptr().cast()),
            _mm256_loadu_ps(lower.as_ptr().cast()),
        )
    };
    _mm512_insertf32x8::<1>(_mm512_castps256_ps512(upper), lower)
}

/// Puts values back where `load` took them.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
pub fn store(values: __m512, upper: &mut [f32; BLOCK_PIXELS], lower: &mut [f32; BLOCK_PIXELS]) {
    // SAFETY: both targets are arrays of eight 4-byte values; the stores need no alignment.
    unsafe {
        _mm256_storeu_ps(upper.as_mut_ptr(), _mm512_castps512_ps256(values));
        _mm256_storeu_ps(lower.as_mut_ptr(), _mm512_extractf32x8_ps::<1>(values));
    }
}

/// As `store`, for whole numbers.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
pub fn store_whole(
    values: __m512i,
    upper: &mut [i32; BLOCK_PIXELS],
    lower: &mut [i32; BLOCK_PIXELS],
) {
    // SAFETY: both targets are arrays of eight 4-byte values; the stores need no alignment.
    unsafe {
        _mm256_storeu_si256(upper.as_mut_ptr().cast(), _mm512_castsi512_si256(values));
        _mm256_storeu_si256(
            lower.as_mut_ptr().cast(),
            _mm512_extracti32x8_epi32::<1>(values),
        );
    }
}

/// For each of four splats, one bit per square that its alpha = 1/255 ellipse touches, a hair
/// generously: from the spans of the rows of pixels, four rows of squares and four splats at a time.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
pub fn square_masks(splats: &[TileSplat; 4]) -> [u16; 4] {
    const SLACK_PX: f32 = 0.01;
    const SLACK_POWER: f32 = 1e-3;
    /// Makes up for the approximate root, whose relative error is 2⁻¹⁴.
    const SLACK_ROOT: f32 = 1.0 + 1e-4;
    const LAST_COLUMN: f32 = TILE as f32 - 1.0;
    let [quarter, half, last] = thirds(splats);
    let b = _mm512_permute_ps::<0b01_01_01_01>(quarter);
    let u0 = _mm512_permute_ps::<0b10_10_10_10>(quarter);
    let c = _mm512_permute_ps::<0b11_11_11_11>(quarter);
    let v0 = _mm512_permute_ps::<0b00_00_00_00>(half);
    let power = _mm512_permute_ps::<0b01_01_01_01>(half);
    let inverse_a = _mm512_permute_ps::<0b11_11_11_11>(last);
    let power = _mm512_add_ps(power, _mm512_set1_ps(SLACK_POWER));
    let widening = _mm512_mul_ps(inverse_a, _mm512_set1_ps(SLACK_ROOT));
    let mut rows = _mm512_setr_ps(
        0.0, 4.0, 8.0, 12.0, 0.0, 4.0, 8.0, 12.0, 0.0, 4.0, 8.0, 12.0, 0.0, 4.0, 8.0, 12.0,
    );
    let mut first = _mm512_set1_ps(TILE as f32);
    let mut last = _mm512_set1_ps(-1.0);
    for _ in 0..TILE / BLOCKS_ACROSS {
        let v = _mm512_fmadd_ps(c, rows, v0);
        let left_over = _mm512_fnmadd_ps(v, v, power);
        let is_touched = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(left_over, _mm512_setzero_ps());
        let root = _mm512_mul_ps(left_over, _mm512_rsqrt14_ps(left_over));
        let half = _mm512_fmadd_ps(root, widening, _mm512_set1_ps(SLACK_PX));
        let row = _mm512_fmadd_ps(b, rows, u0);
        let from = _mm512_fnmsub_ps(row, inverse_a, half);
        let to = _mm512_fnmadd_ps(row, inverse_a, half);
        let from = _mm512_roundscale_ps::<{ _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC }>(from);
        let to = _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(to);
        let is_touched = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(is_touched, from, to);
        first = _mm512_mask_min_ps(first, is_touched, first, from);
        last = _mm512_mask_max_ps(last, is_touched, last, to);
        rows = _mm512_add_ps(rows, _mm512_set1_ps(1.0));
    }
    let first = _mm512_max_ps(first, _mm512_setzero_ps());
    let last = _mm512_min_ps(last, _mm512_set1_ps(LAST_COLUMN));
    let is_touched = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(first, last);
    let nibble = squares_between(is_touched, first, last);
    let shifts = _mm512_setr_epi32(0, 4, 8, 12, 0, 4, 8, 12, 0, 4, 8, 12, 0, 4, 8, 12);
    let bits = _mm512_sllv_epi32(nibble, shifts);
    let bits = _mm512_or_si512(bits, _mm512_shuffle_epi32::<0b10_11_00_01>(bits));
    let bits = _mm512_or_si512(bits, _mm512_shuffle_epi32::<0b01_00_11_10>(bits));
    // The first lane of each splat, cut to 16 bits.
    let masks = _mm512_maskz_compress_epi32(0b0001_0001_0001_0001, bits);
    let masks = _mm_cvtsi128_si64(_mm256_castsi256_si128(_mm512_cvtepi32_epi16(masks))) as u64;
    std::array::from_fn(|k| (masks >> (16 * k)) as u16)
}

/// What of four splats depends on the row of pixels alone, for each row of squares: `b·y + u0` and
/// `power - v²` of the row's four rows of pixels, splat after splat.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
pub fn row_terms(splats: &[TileSplat; 4]) -> [[__m512; 2]; ROWS_OF_SQUARES] {
    let [quarter, half, _] = thirds(splats);
    let b = _mm512_permute_ps::<0b01_01_01_01>(quarter);
    let u0 = _mm512_permute_ps::<0b10_10_10_10>(quarter);
    let c = _mm512_permute_ps::<0b11_11_11_11>(quarter);
    let v0 = _mm512_permute_ps::<0b00_00_00_00>(half);
    let power = _mm512_permute_ps::<0b01_01_01_01>(half);
    let mut rows = _mm512_setr_ps(
        0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0,
    );
    let mut terms = [[_mm512_setzero_ps(); 2]; ROWS_OF_SQUARES];
    for term in &mut terms {
        let v = _mm512_fmadd_ps(c, rows, v0);
        *term = [_mm512_fmadd_ps(b, rows, u0), _mm512_fnmadd_ps(v, v, power)];
        rows = _mm512_add_ps(rows, _mm512_set1_ps(4.0));
    }
    terms
}

/// The first, middle and last four values of each of four splats: (a, b, u0, c), (v0, power, red,
/// green) and (blue, depth, object, inverse a).
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn thirds(splats: &[TileSplat; 4]) -> [__m512; 3] {
    const { assert!(size_of::<TileSplat>() == 3 * size_of::<__m128>()) };
    let start: *const __m128 = splats.as_ptr().cast();
    let mut thirds = [_mm512_setzero_ps(); 3];
    for (k, third) in thirds.iter_mut().enumerate() {
        // SAFETY: four splats are twelve times four floats; the loads need no alignment.
        let at = |splat: usize| unsafe { _mm_loadu_ps(start.add(3 * splat + k).cast()) };
        let low = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(at(0)), at(1));
        *third = _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(low, at(2)), at(3));
    }
    thirds
}

/// For each lane, four bits: the squares along a row that hold a pixel in `first..=last`; none where
/// the lane is not touched.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
#[inline]
fn squares_between(is_touched: __mmask16, first: __m512, last: __m512) -> __m512i {
    // Empty spans may be far outside; they are masked below, so what the conversion makes of them
    // does not matter (variable shifts by 32 and more give 0).
    let first_square = _mm512_srai_epi32::<2>(_mm512_cvttps_epi32(first));
    let last_square = _mm512_srai_epi32::<2>(_mm512_cvttps_epi32(last));
    let all = _mm512_set1_epi32((1 << BLOCKS_ACROSS) - 1);
    let from_first = _mm512_sllv_epi32(all, first_square);
    let beyond_last = _mm512_sub_epi32(_mm512_set1_epi32(BLOCKS_ACROSS as i32 - 1), last_square);
    let to_last = _mm512_srlv_epi32(all, beyond_last);
    _mm512_maskz_and_epi32(is_touched, from_first, to_last)
}

/// As `square_masks`, for a single splat.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
#[inline]
pub fn square_mask(splat: &TileSplat) -> u16 {
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
    let nibble = squares_between(is_touched, first, last);
    let shifts = _mm512_setr_epi32(0, 0, 0, 0, 4, 4, 4, 4, 8, 8, 8, 8, 12, 12, 12, 12);
    _mm512_reduce_or_epi32(_mm512_sllv_epi32(nibble, shifts)) as u16
}
