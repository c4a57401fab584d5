//! `Lanes` in AVX2 + FMA registers.
//!
//! The methods are safe to call only below `run`, which has the instructions enabled; everything
//! is inlined into it.

use std::arch::x86_64::*;

use crate::lanes::arithmetic::arithmetic;
use crate::lanes::block_avx2::block_mask;
use crate::lanes::patch::{Block, LaneWork, Lanes, Patch, PatchWork};
use crate::lanes::vector::Vector;
use crate::tile::pixels::{BLOCK_PIXELS, BLOCK_WIDTH};
use crate::tile::splat::TileSplat;

/// The register; named only in functions that enable its instructions.
#[derive(Clone, Copy)]
pub(crate) struct Avx2(pub(crate) __m256);

/// Runs a kernel with AVX2 and FMA, and with twice the registers where the machine has them: the
/// results are the same to the bit.
#[target_feature(enable = "avx2,fma")]
pub fn run<W: LaneWork>(work: W) -> W::Output {
    if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") {
        // SAFETY: both were found just now.
        unsafe { run_with_more_registers(work) }
    } else {
        work.run::<Avx2>()
    }
}

/// As `run`, for a kernel of any width.
#[target_feature(enable = "avx2,fma")]
pub fn run_patches<W: PatchWork>(work: W) -> W::Output {
    work.run::<Avx2>()
}

#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn run_with_more_registers<W: LaneWork>(work: W) -> W::Output {
    work.run::<Avx2>()
}

// SAFETY of every block below: only functions that enable AVX2 and FMA name `Avx2`, and their callers
// have made sure of both; loads and stores go to arrays of eight floats and need no alignment.
impl Vector for Avx2 {
    type Array = Block;
    const LANES: usize = BLOCK_PIXELS;

    arithmetic!(
        Avx2: _mm256_set1_ps _mm256_loadu_ps _mm256_storeu_ps _mm256_add_ps _mm256_sub_ps _mm256_mul_ps
        _mm256_fmadd_ps _mm256_fnmadd_ps _mm256_min_ps _mm256_rcp_ps
        _mm256_slli_epi32 _mm256_castps_si256 _mm256_castsi256_ps _mm256_add_epi32
    );

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn at_least(self, other: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_cmp_ps::<_CMP_GE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn and(self, mask: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_and_ps(self.0, mask.0) })
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: see above.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
    #[inline(always)]
    fn sums(values: [Self; 4]) -> [f32; 4] {
        let mut sums = [0.0; 4];
        // SAFETY: see above; `sums` takes the four floats that are stored.
        unsafe {
            let low = _mm256_hadd_ps(values[0].0, values[1].0);
            let high = _mm256_hadd_ps(values[2].0, values[3].0);
            let both = _mm256_hadd_ps(low, high);
            let sum = _mm_add_ps(
                _mm256_castps256_ps128(both),
                _mm256_extractf128_ps::<1>(both),
            );
            _mm_storeu_ps(sums.as_mut_ptr(), sum);
        }
        sums
    }
}

impl Patch for Avx2 {
    #[inline(always)]
    fn patch_mask(splat: &TileSplat) -> u32 {
        // SAFETY: see above.
        unsafe { block_mask(splat) }
    }
    #[inline(always)]
    fn of_picture(picture: &[f32], width: usize) -> Self {
        let row = |k: usize| picture[k * width..k * width + BLOCK_WIDTH].as_ptr();
        // SAFETY: see above; both rows are four readable floats.
        Avx2(unsafe { _mm256_loadu2_m128(row(1), row(0)) })
    }
    #[inline(always)]
    fn transposed(bytes: &[u8; 64]) -> [u64; 8] {
        let mut words = [0; 8];
        for (half, bytes) in bytes.chunks_exact(32).enumerate() {
            // SAFETY: see above; `bytes` is 32 readable bytes.
            unsafe {
                let mut column = _mm256_loadu_si256(bytes.as_ptr().cast());
                for word in words.iter_mut().rev() {
                    let bits = _mm256_movemask_epi8(column) as u32;
                    *word |= u64::from(bits) << (32 * half);
                    column = _mm256_add_epi8(column, column);
                }
            }
        }
        words
    }
}

impl Lanes for Avx2 {
    #[inline(always)]
    fn transposed_lanes(values: [Self; BLOCK_PIXELS]) -> [Self; BLOCK_PIXELS] {
        // SAFETY: see above.
        unsafe {
            let [a, b, c, d] = transposed_quarters(values[0], values[1], values[2], values[3]);
            let [e, f, g, h] = transposed_quarters(values[4], values[5], values[6], values[7]);
            [
                Avx2(_mm256_permute2f128_ps::<0x20>(a, e)),
                Avx2(_mm256_permute2f128_ps::<0x20>(b, f)),
                Avx2(_mm256_permute2f128_ps::<0x20>(c, g)),
                Avx2(_mm256_permute2f128_ps::<0x20>(d, h)),
                Avx2(_mm256_permute2f128_ps::<0x31>(a, e)),
                Avx2(_mm256_permute2f128_ps::<0x31>(b, f)),
                Avx2(_mm256_permute2f128_ps::<0x31>(c, g)),
                Avx2(_mm256_permute2f128_ps::<0x31>(d, h)),
            ]
        }
    }
}

/// The 4×4 transpose of each half of four registers.
#[target_feature(enable = "avx2")]
#[inline]
fn transposed_quarters(p: Avx2, q: Avx2, r: Avx2, s: Avx2) -> [__m256; 4] {
    let (low, high) = (_mm256_unpacklo_ps(p.0, q.0), _mm256_unpackhi_ps(p.0, q.0));
    let (below, above) = (_mm256_unpacklo_ps(r.0, s.0), _mm256_unpackhi_ps(r.0, s.0));
    [
        _mm256_shuffle_ps::<0x44>(low, below),
        _mm256_shuffle_ps::<0xee>(low, below),
        _mm256_shuffle_ps::<0x44>(high, above),
        _mm256_shuffle_ps::<0xee>(high, above),
    ]
}
