//! Runs a kernel written for lanes or patches with the instructions this machine has.

use crate::lanes::patch::{LaneWork, PatchWork};
use crate::lanes::portable::Portable;
#[cfg(target_arch = "x86_64")]
use crate::lanes::{avx2, avx512};
use crate::machine::simd::{Level, Simd};

/// Runs a kernel written for `Lanes` with these instructions.
#[inline(always)]
pub fn run_lanes<W: LaneWork>(simd: Simd, work: W) -> W::Output {
    match simd.level() {
        Level::Scalar => work.run::<Portable>(),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` found AVX2 and FMA before it made these values.
        Level::Avx2 | Level::Avx512 => unsafe { avx2::run(work) },
        #[cfg(target_arch = "aarch64")]
        Level::Neon => work.run::<Portable>(),
    }
}

/// Runs a kernel written for `Patch` with registers as wide as these instructions have.
#[inline(always)]
pub fn run_patches<W: PatchWork>(simd: Simd, work: W) -> W::Output {
    match simd.level() {
        Level::Scalar => work.run::<Portable>(),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` found AVX2 and FMA before it made this value.
        Level::Avx2 => unsafe { avx2::run_patches(work) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` found these sets before it made this value.
        Level::Avx512 => unsafe { avx512::run_patches(work) },
        #[cfg(target_arch = "aarch64")]
        Level::Neon => work.run::<Portable>(),
    }
}
