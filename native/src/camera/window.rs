//! Parts of a picture: windows of whole pixels, and boxes between them.

/// Pixels [left, right) × [top, bottom).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    pub left: usize,
    pub top: usize,
    pub right: usize,
    pub bottom: usize,
    /// Whether it leaves out some of the picture.
    pub is_part: bool,
}

impl Window {
    pub fn whole(width: usize, height: usize) -> Window {
        Window {
            left: 0,
            top: 0,
            right: width,
            bottom: height,
            is_part: false,
        }
    }

    /// Its middle and half its diagonal, px.
    pub fn disc(&self) -> ([f64; 2], f64) {
        let middle = [
            0.5 * (self.left + self.right) as f64,
            0.5 * (self.top + self.bottom) as f64,
        ];
        let wide = self.right.saturating_sub(self.left) as f64;
        let high = self.bottom.saturating_sub(self.top) as f64;
        (middle, 0.5 * wide.hypot(high))
    }
}

/// Columns and rows [low, high], px.
pub type PixelBox = [[f64; 2]; 2];

/// A box of the picture without borders.
pub const EVERYWHERE: [[f64; 2]; 2] = [[f64::NEG_INFINITY, f64::INFINITY]; 2];
