//! Splats fitted to photographs: loss, gradients and optimiser steps.

pub mod adam;
pub mod backward;
pub mod depth_bounds;
pub mod exposure;
pub mod loss;
pub mod splats;
pub(crate) mod ssim_row;
pub(crate) mod ssim_window;
pub mod step;
pub(crate) mod sums;
pub mod target;
pub(crate) mod tile_pixels;
