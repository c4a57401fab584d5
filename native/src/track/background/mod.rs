//! What the camera would see without the object: the background as learned, what is expected in front
//! of it, and where the picture differs from that.

pub mod change;
pub mod expected;
pub mod learn;
