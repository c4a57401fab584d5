//! Which instructions to use: chosen at run time, never at build time.

use crate::blend::{self, Tile};
#[cfg(target_arch = "x86_64")]
use crate::blend_avx2;
use crate::camera::Lens;
use crate::project::{self, PosedCloud, Record, Slots, View};

/// An instruction set that this machine has; only `Simd::detect` makes other ones than `Scalar`.
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

    /// `project::project_chunk` with these instructions; the result is the same to the bit.
    pub fn project_chunk<L: Lens>(
        self,
        posed: &PosedCloud,
        lens: &L,
        view: &View,
        chunk: usize,
        slots: &mut Slots,
    ) -> usize {
        match self.0 {
            Level::Scalar => project::project_chunk(posed, lens, view, chunk, slots),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe { project_chunk_avx2(posed, lens, view, chunk, slots) },
        }
    }

    /// `blend::blend_tile` with these instructions.
    pub fn blend_tile<const TRACK_OBJECTS: bool>(
        self,
        tile: &mut Tile,
        records: &[Record],
        slots: &[u32],
        left: i32,
        top: i32,
    ) {
        match self.0 {
            Level::Scalar => {
                blend::blend_tile::<TRACK_OBJECTS>(tile, records, slots, left, top);
            }
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe {
                blend_avx2::blend_tile::<TRACK_OBJECTS>(tile, records, slots, left, top);
            },
        }
    }
}

/// The portable code, compiled for wider registers: the compiler vectorises its loops over lanes.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn project_chunk_avx2<L: Lens>(
    posed: &PosedCloud,
    lens: &L,
    view: &View,
    chunk: usize,
    slots: &mut Slots,
) -> usize {
    project::project_chunk(posed, lens, view, chunk, slots)
}
