//! A photo that a rendering is compared with, and what of SSIM depends on the photo alone.

use crate::machine::simd::Simd;
use crate::train::depth_bounds::DepthBounds;
use crate::train::ssim_window::{blur_column, blur_row, REACH};

/// Red, green, blue.
pub const CHANNELS: usize = 3;

/// A photo and its windowed statistics; planes of `width * height`, one after the other.
pub struct Target {
    pub width: usize,
    pub height: usize,
    pub(crate) colour: Vec<u8>,
    pub(crate) mean: Vec<f32>,
    pub(crate) variance: Vec<f32>,
    pub bounds: Option<DepthBounds>,
}

impl Target {
    /// From `width * height` RGB pixels, row by row.
    pub fn new(pixels: &[u8], width: usize, height: usize, simd: Simd) -> Target {
        let plane = width * height;
        let mut target = Target {
            width,
            height,
            colour: vec![0; CHANNELS * plane],
            mean: vec![0.0; CHANNELS * plane],
            variance: vec![0.0; CHANNELS * plane],
            bounds: None,
        };
        for (place, pixel) in pixels.chunks_exact(CHANNELS).enumerate() {
            for (channel, &value) in pixel.iter().enumerate() {
                target.colour[channel * plane + place] = value;
            }
        }
        let mut along = [vec![0.0; CHANNELS * plane], vec![0.0; CHANNELS * plane]];
        simd.run(
            #[inline(always)]
            || {
                let mut padded = vec![0.0; width + 2 * REACH];
                for (row, colours) in target.colour.chunks_exact(width).enumerate() {
                    let span = row * width..(row + 1) * width;
                    for (power, along) in along.iter_mut().enumerate() {
                        for (to, &colour) in padded[REACH..].iter_mut().zip(colours) {
                            let value = unit(colour);
                            *to = if power == 0 { value } else { value * value };
                        }
                        blur_row(&padded, &mut along[span.clone()]);
                    }
                }
                let nothing = vec![0.0; width];
                for row in 0..CHANNELS * height {
                    let span = row * width..(row + 1) * width;
                    let (mean, variance) = (
                        &mut target.mean[span.clone()],
                        &mut target.variance[span.clone()],
                    );
                    blur_column(&along[0], row, height, &nothing, mean);
                    blur_column(&along[1], row, height, &nothing, variance);
                    for (square, &mean) in variance.iter_mut().zip(&*mean) {
                        *square -= mean * mean;
                    }
                }
            },
        );
        target
    }

    /// Bytes held.
    pub fn size(&self) -> usize {
        let bounds = self
            .bounds
            .as_ref()
            .map_or(0, |bounds| 8 * bounds.near.len());
        9 * self.colour.len() + bounds
    }
}

/// A channel's byte as a value from 0 to 1.
#[inline(always)]
pub fn unit(colour: u8) -> f32 {
    f32::from(colour) * (1.0 / 255.0)
}
