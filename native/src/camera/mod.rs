//! Camera models: where a point of space falls in the picture, how that place moves with the point
//! (first and second derivatives), and which part of space a window of the picture sees.

pub(crate) mod angles;
#[cfg(test)]
pub(crate) mod checks;
pub mod cone;
pub mod curvature;
pub mod fisheye;
pub mod kannala_brandt;
pub mod lens;
pub mod pinhole;
pub(crate) mod round;
pub mod window;
