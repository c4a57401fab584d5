//! Front-to-back blending of a tile's splats into its pixels, one kernel per instruction set.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
pub mod dispatch;
#[cfg(target_arch = "aarch64")]
mod neon;
pub mod portable;
pub mod wide;
