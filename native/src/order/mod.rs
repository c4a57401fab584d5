//! Projected splats in depth order, and which of them touch which tile of the picture.

pub mod bin;
pub mod slab;
pub mod sort;
