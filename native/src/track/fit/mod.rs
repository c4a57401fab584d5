//! Poses fitted to a picture: edges found along a drawn outline, the least-squares step, its score.

pub mod edges;
pub mod judge;
pub mod light;
pub mod solve;
