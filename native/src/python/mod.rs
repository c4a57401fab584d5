//! What Python sees of the crate: classes and functions that check their arguments and call the rest.

pub mod alone;
pub mod check;
pub mod cloud;
pub mod engine;
pub mod gradients;
pub mod lens;
pub mod probe;
pub mod request;
pub mod stereo;
pub mod still;
pub mod track;
pub mod train;
