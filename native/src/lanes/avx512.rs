//! `Patch` in AVX-512 registers: the sixteen pixels (4×4) of two blocks, one above the other.
//!
//! As in `avx2`, the methods are safe to call only below `run_patches`, which has the
//! instructions enabled; everything is inlined into it.

use std::arch::x86_64::*;

use crate::lanes::arithmetic::arithmetic;
use crate::lanes::patch::{Patch, PatchWork};
use crate::lanes::square_avx512::square_mask;
use crate::lanes::vector::Vector;
use crate::tile::pixels::BLOCK_WIDTH;
use crate::tile::splat::TileSplat;

/// Pixels of a register.
const LANES: usize = 16;

/// The register; named only in functions that enable its instructions.
#[derive(Clone, Copy)]
pub(crate) struct Avx512(pub(crate) __m512);

/// Runs a kernel sixteen pixels at a time.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2")]
pub fn run_patches<W: PatchWork>(work: W) -> W::Output {
    work.run::<Avx512>()
}

// SAFETY of every block below: only functions that enable the instructions name `Avx512`, and their
// callers have made sure of them; loads and stores go to arrays of sixteen floats and need no
// alignment.
impl Vector for Avx512 {
    type Array = [f32; LANES];
    const LANES: usize = LANES;

    arithmetic!(
        Avx512: _mm512_set1_ps _mm512_loadu_ps _mm512_storeu_ps _mm512_add_ps _mm512_sub_ps _mm512_mul_ps
        _mm512_fmadd_ps _mm512_fnmadd_ps _mm512_min_ps _mm512_rcp14_ps
        _mm512_slli_epi32 _mm512_castps_si512 _mm512_castsi512_ps _mm512_add_epi32
    );

    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see above.
        Avx512(unsafe { _mm512_abs_ps(self.0) })
    }
    #[inline(always)]
    fn at_least(self, other: Self) -> Self {
        // SAFETY: see above.
        Avx512(unsafe {
            let lanes = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(self.0, other.0);
            _mm512_castsi512_ps(_mm512_movm_epi32(lanes))
        })
    }
    #[inline(always)]
    fn and(self, mask: Self) -> Self {
        // SAFETY: see above.
        Avx512(unsafe { _mm512_and_ps(self.0, mask.0) })
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: see above.
        unsafe { u32::from(_mm512_movepi32_mask(_mm512_castps_si512(self.0))) }
    }
    #[inline(always)]
    fn sums(values: [Self; 4]) -> [f32; 4] {
        let mut sums = [0.0; 4];
        // SAFETY: see above; `sums` takes the four floats that are stored.
        unsafe {
            // Quarters of two values at a time, then lanes of quarters.
            let half = |value: __m512| {
                let high = _mm512_extractf32x8_ps::<1>(value);
                _mm256_add_ps(_mm512_castps512_ps256(value), high)
            };
            let low = _mm256_hadd_ps(half(values[0].0), half(values[1].0));
            let high = _mm256_hadd_ps(half(values[2].0), half(values[3].0));
            let both = _mm256_hadd_ps(low, high);
            let upper = _mm256_extractf128_ps::<1>(both);
            let sum = _mm_add_ps(_mm256_castps256_ps128(both), upper);
            _mm_storeu_ps(sums.as_mut_ptr(), sum);
        }
        sums
    }
}

impl Patch for Avx512 {
    #[inline(always)]
    fn patch_mask(splat: &TileSplat) -> u32 {
        // SAFETY: see above.
        u32::from(unsafe { square_mask(splat) })
    }
    #[inline(always)]
    fn of_picture(picture: &[f32], width: usize) -> Self {
        let row = |k: usize| picture[k * width..k * width + BLOCK_WIDTH].as_ptr();
        // SAFETY: see above; every row is four readable floats.
        Avx512(unsafe {
            let first = _mm512_castps128_ps512(_mm_loadu_ps(row(0)));
            let second = _mm512_insertf32x4::<1>(first, _mm_loadu_ps(row(1)));
            let third = _mm512_insertf32x4::<2>(second, _mm_loadu_ps(row(2)));
            _mm512_insertf32x4::<3>(third, _mm_loadu_ps(row(3)))
        })
    }
    #[inline(always)]
    fn transposed(bytes: &[u8; 64]) -> [u64; 8] {
        let mut words = [0; 8];
        // SAFETY: see above; `bytes` is 64 readable bytes.
        unsafe {
            let column = _mm512_loadu_si512(bytes.as_ptr().cast());
            for (bit, word) in words.iter_mut().enumerate() {
                *word = _mm512_test_epi8_mask(
                    column,
                    _mm512_set1_epi8(1u8.wrapping_shl(bit as u32) as i8),
                );
            }
        }
        words
    }
}
