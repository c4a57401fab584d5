//! What the projection leaves of a splat for the tiles.

use crate::scene::cloud::LOG2_255;

/// log2(e) / 2: turns half a squared Mahalanobis distance into a power of two.
pub(crate) const HALF_LOG2_E: f64 = std::f64::consts::LOG2_E / 2.0;
/// Samples whose log2(255 · alpha) is this near to 0 are decided in double precision.
pub const STEP_DOUBT: f32 = 1e-4;

/// Everything the tile stages need of a splat; one cache line.
///
/// With (dx, dy) = pixel centre - splat centre: `log2(alpha) = log2_opacity - u² - v²`,
/// `u = a·dx + b·dy`, `v = c·dy`.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub struct Record {
    /// Centre = base + offset, split so that a tile-relative position keeps its last bits.
    pub base: [i32; 2],
    pub offset: [f32; 2],
    pub a: f32,
    pub b: f32,
    pub c: f32,
    pub log2_opacity: f32,
    pub colour: [f32; 3],
    pub depth: f32,
    pub inverse_a: f32,
    /// Height above the centre of the rightmost point of the 1/255 ellipse; the leftmost mirrors it.
    pub right_dy: f32,
    pub object: u32,
    pub index: u32,
}

/// What a needle's record cannot hold: at 1000 pixels from its centre single precision would put it
/// a hundredth of its width aside.
#[derive(Clone, Copy, Debug, Default)]
pub struct Needle {
    pub centre: [f64; 2],
    pub a: f64,
    pub b: f64,
}

impl Record {
    /// Whether the splat is so thin and slanted that its tiles take their terms from a `Needle`.
    #[inline(always)]
    pub fn is_needle(&self) -> bool {
        // b / c is the slant of the ellipse in units of its own thickness.
        self.b.abs() > 32.0 * self.c
    }

    /// Whether the splat is one of those that `wide` draws, and the record holds no ellipse.
    #[inline(always)]
    pub fn is_wide(&self) -> bool {
        self.c == 0.0
    }
}

/// Height of the log2-alpha paraboloid above the visible limit at the splat's centre.
#[inline(always)]
pub fn power_of(log2_opacity: f32) -> f32 {
    log2_opacity + LOG2_255
}
