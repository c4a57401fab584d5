//! Splats onto the picture: each one becomes an ellipse with a colour and a depth (EWA projection), or,
//! where it is seen too wide for that, a cone of rays.

pub mod chunk;
pub mod ewa;
pub mod judge;
pub mod posed;
pub mod record;
pub mod scope;
pub mod tile_box;
pub mod wide;
