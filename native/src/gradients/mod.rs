//! From gradients of a picture back to gradients of splats and poses; and each stage by itself, to be
//! timed.

pub mod backward;
#[cfg(target_arch = "x86_64")]
pub(crate) mod backward_avx512;
pub mod dispatch;
pub mod probe;
pub mod projection;
pub(crate) mod row_sums;
pub mod tape;
