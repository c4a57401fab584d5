//! Front-to-back blending of a tile's splats into its pixels, one kernel per instruction set.
//!
//! AVX2 and NEON share how a tile is taken block by block (`by_blocks`), and all kernels share the
//! batches of `tile::batch`. Their inner loops stay apart: an AVX2 block is one register and a NEON
//! block two, and AVX-512 keeps sixteen pixels column after column, since it computes what depends
//! on the row alone for four splats at once.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod by_blocks;
pub mod dispatch;
#[cfg(target_arch = "aarch64")]
mod neon;
pub mod portable;
pub mod wide;
