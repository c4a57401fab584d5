//! How a photo's exposure and vignetting change the colours that are drawn.

use crate::train::target::CHANNELS;

/// What the photo shows of a colour drawn: gain · falloff · colour + bias, per channel, with
/// falloff = 1 + f₀·r² + f₁·r⁴ and r the distance from the centre over that of the corners.
#[derive(Clone, Copy, Debug)]
pub struct Exposure {
    pub gain: [f32; CHANNELS],
    pub bias: [f32; CHANNELS],
    pub falloff: [f32; 2],
}

impl Exposure {
    /// r² of a row's pixels, and the falloff there.
    #[inline(always)]
    pub fn fill_row(&self, y: usize, height: usize, squares: &mut [f32], falloff: &mut [f32]) {
        let width = squares.len();
        let centre = [0.5 * width as f32, 0.5 * height as f32];
        let per_square = 1.0 / (centre[0] * centre[0] + centre[1] * centre[1]);
        let dy = y as f32 + 0.5 - centre[1];
        for (x, (square, fall)) in squares.iter_mut().zip(falloff).enumerate() {
            let dx = x as f32 + 0.5 - centre[0];
            *square = per_square * (dx * dx + dy * dy);
            *fall = 1.0 + *square * (self.falloff[0] + *square * self.falloff[1]);
        }
    }
}
