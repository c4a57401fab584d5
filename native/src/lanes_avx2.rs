//! `Lanes` in AVX2 + FMA registers.
//!
//! The methods are safe to call only below `run`, which has the instructions enabled; everything
//! is inlined into it.

use std::arch::x86_64::*;

use crate::blend::TileSplat;
use crate::blend_avx2;
use crate::lanes::{Block, LaneWork, Lanes};

#[derive(Clone, Copy)]
struct Avx2(__m256);

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

#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn run_with_more_registers<W: LaneWork>(work: W) -> W::Output {
    work.run::<Avx2>()
}

// SAFETY of every block below: `Avx2` is private and only `run` names it, whose callers have made
// sure of AVX2 and FMA; loads and stores go to arrays of eight floats and need no alignment.
impl Lanes for Avx2 {
    #[inline(always)]
    fn all(value: f32) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn load(from: &Block) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, to: &mut Block) {
        // SAFETY: see above.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_add_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_sub_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_mul_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_fmadd_ps(self.0, factor.0, term.0) })
    }
    #[inline(always)]
    fn mul_sub_from(self, factor: Self, term: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_fnmadd_ps(self.0, factor.0, term.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe { _mm256_min_ps(self.0, other.0) })
    }
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
    fn scale_by(self, shifted: Self) -> Self {
        // SAFETY: see above.
        Avx2(unsafe {
            let exponent = _mm256_slli_epi32::<23>(_mm256_castps_si256(shifted.0));
            _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(self.0), exponent))
        })
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
    #[inline(always)]
    fn prefetch<T>(place: &T) {
        const LINE: usize = 64;
        let first: *const i8 = std::ptr::from_ref(place).cast();
        for offset in (0..size_of::<T>()).step_by(LINE) {
            // SAFETY: see above; the address lies within `place`, and a prefetch reads nothing.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(first.add(offset)) }
        }
    }
    #[inline(always)]
    fn block_mask(splat: &TileSplat) -> u32 {
        // SAFETY: see above.
        unsafe { blend_avx2::block_mask(splat) }
    }
}
