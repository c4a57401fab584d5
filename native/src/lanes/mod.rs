//! Several pixels in one register: a kernel is written once and compiled for every instruction set.

#[cfg(target_arch = "x86_64")]
mod arithmetic;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
#[cfg(target_arch = "x86_64")]
pub(crate) mod block_avx2;
pub mod dispatch;
pub mod patch;
pub mod portable;
#[cfg(target_arch = "x86_64")]
pub(crate) mod square_avx512;
pub mod vector;
