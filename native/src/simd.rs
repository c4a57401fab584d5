//! Which instructions to use: chosen at run time, never at build time.

use crate::blend::{self, Tile, TileWork};
#[cfg(target_arch = "x86_64")]
use crate::blend_avx2;
use crate::lanes::{LaneWork, Portable};
#[cfg(target_arch = "x86_64")]
use crate::lanes_avx2;

/// An instruction set that this machine has; only `Simd::detect` makes other ones than `SCALAR`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Simd(Level);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Simd {
    /// Portable code only.
    pub const SCALAR: Simd = Simd(Level::Scalar);

    /// The widest set this machine has.
    pub fn detect() -> Simd {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return Simd(Level::Avx2);
        }
        Simd::SCALAR
    }

    /// As Python writes it.
    pub fn name(self) -> &'static str {
        match self.0 {
            Level::Scalar => "scalar",
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => "avx2",
        }
    }

    /// Runs portable code compiled for wider registers: the compiler vectorises the loops of what
    /// is inlined into `work`. Results stay the same to the bit, since nothing is fused or
    /// reordered.
    #[inline(always)]
    pub fn run<R>(self, work: impl FnOnce() -> R) -> R {
        match self.0 {
            Level::Scalar => work(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe { run_avx2(work) },
        }
    }

    /// Runs a kernel written for `Lanes` with these instructions.
    #[inline(always)]
    pub fn run_lanes<W: LaneWork>(self, work: W) -> W::Output {
        match self.0 {
            Level::Scalar => work.run::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe { lanes_avx2::run(work) },
        }
    }

    /// `blend::blend_tile` with these instructions.
    pub fn blend_tile<const TRACK_OBJECTS: bool>(self, tile: &mut Tile, work: &TileWork) {
        match self.0 {
            Level::Scalar => {
                blend::blend_tile::<TRACK_OBJECTS>(tile, work);
            }
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe {
                blend_avx2::blend_tile::<TRACK_OBJECTS>(tile, work);
            },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2<R>(work: impl FnOnce() -> R) -> R {
    work()
}
