//! Eight pixels in one AVX2 register: which blocks of a tile a splat touches.

use std::arch::x86_64::*;

use crate::project::tile_box::TILE;
use crate::tile::pixels::BLOCKS_ACROSS;
use crate::tile::splat::TileSplat;

/// One bit per block that the alpha = 1/255 ellipse touches, from the span of every row of pixels.
#[target_feature(enable = "avx2,fma")]
pub(crate) fn block_mask(splat: &TileSplat) -> u32 {
    const SLACK_PX: f32 = 0.01;
    const SLACK_POWER: f32 = 1e-3;
    let b = _mm256_set1_ps(splat.b);
    let c = _mm256_set1_ps(splat.c);
    let u0 = _mm256_set1_ps(splat.u0);
    let v0 = _mm256_set1_ps(splat.v0);
    let inverse_a = _mm256_set1_ps(splat.inverse_a);
    let power = _mm256_set1_ps(splat.power + SLACK_POWER);
    let slack = _mm256_set1_ps(SLACK_PX);
    let zero = _mm256_setzero_ps();
    let mut rows = _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0);
    let mut bits = _mm256_setzero_si256();
    let mut shifts = _mm256_setr_epi32(0, 0, 4, 4, 8, 8, 12, 12);
    for _ in 0..TILE / 8 {
        let v = _mm256_fmadd_ps(c, rows, v0);
        let left_over = _mm256_fnmadd_ps(v, v, power);
        let is_touched = _mm256_cmp_ps::<_CMP_GE_OQ>(left_over, zero);
        let root = _mm256_sqrt_ps(_mm256_max_ps(left_over, zero));
        let half = _mm256_fmadd_ps(root, inverse_a, slack);
        let row = _mm256_fmadd_ps(b, rows, u0);
        let first = _mm256_fnmsub_ps(row, inverse_a, half);
        let last = _mm256_fnmadd_ps(row, inverse_a, half);
        let nibble = blocks_between(first, last);
        let nibble = _mm256_and_si256(nibble, _mm256_castps_si256(is_touched));
        bits = _mm256_or_si256(bits, _mm256_sllv_epi32(nibble, shifts));
        rows = _mm256_add_ps(rows, _mm256_set1_ps(8.0));
        shifts = _mm256_add_epi32(shifts, _mm256_set1_epi32(16));
    }
    let half = _mm_or_si128(
        _mm256_castsi256_si128(bits),
        _mm256_extracti128_si256::<1>(bits),
    );
    let quarter = _mm_or_si128(half, _mm_unpackhi_epi64(half, half));
    let word = _mm_or_si128(quarter, _mm_shuffle_epi32::<1>(quarter));
    _mm_cvtsi128_si32(word) as u32
}

/// For each lane, four bits: the blocks along a row that hold a pixel in `first..=last`.
#[target_feature(enable = "avx2,fma")]
fn blocks_between(first: __m256, last: __m256) -> __m256i {
    const LAST_COLUMN: f32 = TILE as f32 - 1.0;
    let first = _mm256_ceil_ps(_mm256_max_ps(first, _mm256_setzero_ps()));
    let last = _mm256_floor_ps(_mm256_min_ps(last, _mm256_set1_ps(LAST_COLUMN)));
    let is_empty = _mm256_cmp_ps::<_CMP_NLE_UQ>(first, last);
    // Empty spans may be far outside; they are masked below, so what the conversion makes of them
    // does not matter (variable shifts by 32 and more give 0).
    let first_block = _mm256_srai_epi32::<2>(_mm256_cvttps_epi32(first));
    let last_block = _mm256_srai_epi32::<2>(_mm256_cvttps_epi32(last));
    let all = _mm256_set1_epi32((1 << BLOCKS_ACROSS) - 1);
    let from_first = _mm256_sllv_epi32(all, first_block);
    let beyond_last = _mm256_sub_epi32(_mm256_set1_epi32(BLOCKS_ACROSS as i32 - 1), last_block);
    let to_last = _mm256_srlv_epi32(all, beyond_last);
    let both = _mm256_and_si256(from_first, to_last);
    _mm256_andnot_si256(_mm256_castps_si256(is_empty), both)
}
