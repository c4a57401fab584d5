//! One tile of 16 × 16 pixels: what its pixels have gathered, and its splats in its own coordinates.

pub mod alpha;
pub mod batch;
#[cfg(test)]
pub(crate) mod checks;
pub mod pixels;
pub mod splat;
