//! Whole pictures: clouds in, colour, opacity, depth and object of every pixel out.

pub mod alone;
pub mod engine;
pub mod job;
pub mod scratch;
pub mod still;
pub mod tile;
