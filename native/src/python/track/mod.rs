//! The tracker's kernels as Python calls them.

pub mod cut;
pub mod kernels;
pub mod learn;
pub mod light;
pub mod memory;
pub mod poses;
pub mod reduction;
pub mod relight;
pub mod request;
pub mod seen_window;
pub mod setting;
pub mod support;
