//! What an object looks like: cut out of the picture, drawn under its light, and compared.

pub mod compared;
pub mod cut;
pub mod light_fit;
pub mod memory;
pub mod poses;
pub mod reduction;
pub mod relight;
pub mod similarity;
pub mod support;
pub mod unknown;
