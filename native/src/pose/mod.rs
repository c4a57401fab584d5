//! One object's pose from a picture: the normal equations of a Gauss-Newton step.

pub mod engine;
pub mod frame;
pub mod grey;
pub mod motion;
pub mod state;
pub mod sums;
pub mod tile;
