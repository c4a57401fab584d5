//! Splat clouds prepared for drawing, and the colour of a splat seen from a direction (spherical
//! harmonics).

pub mod cloud;
pub mod sh;
pub mod sh_slope;
