//! What is asked for when a picture is drawn.

use rayon::ThreadPool;

use crate::machine::simd::Simd;
use crate::project::posed::View;
use crate::project::scope::Scope;

/// Largest width and height, set by the 16-bit rows and tile columns.
pub const MAX_SIDE: usize = 32_768;

/// Where the picture goes: row-major, `width * height` pixels each, all zero before the first use.
pub struct Picture<'a> {
    /// Three values a pixel.
    pub rgb: &'a mut [f32],
    pub alpha: &'a mut [f32],
    pub depth: &'a mut [f32],
    pub ids: &'a mut [i32],
}

/// What shows where no splat is.
#[derive(Clone, Copy)]
pub enum Background<'a> {
    Plain([f32; 3]),
    /// Row-major, three values a pixel.
    Picture(&'a [f32]),
}

impl Background<'_> {
    /// Colour at a place of the picture, counted in pixels row by row.
    #[inline(always)]
    pub fn at(&self, place: usize) -> [f32; 3] {
        match self {
            Background::Plain(colour) => *colour,
            Background::Picture(values) => {
                std::array::from_fn(|channel| values[3 * place + channel])
            }
        }
    }
}

/// How to draw.
pub struct Job<'a> {
    pub view: View,
    pub scope: &'a Scope,
    pub background: Background<'a>,
    pub simd: Simd,
    pub pool: &'a ThreadPool,
}
