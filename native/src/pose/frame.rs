//! Patches of a tile, taken from pictures and put into them.

use crate::lanes::patch::Patch;
use crate::lanes::vector::of_lanes;
use crate::project::tile_box::TILE;
use crate::tile::pixels::{BLOCKS_ACROSS, BLOCK_WIDTH};

/// Where a tile lies in a strip of the picture, and how much of it.
pub struct Frame {
    /// Pixels along the strip.
    pub width: usize,
    pub left: usize,
    pub columns: usize,
    pub rows: usize,
}

impl Frame {
    /// A picture's values at the pixels of a patch; 0 outside the picture.
    #[inline(always)]
    pub fn patch_of<V: Patch>(&self, strip: &[f32], patch: usize) -> V {
        let [x, y] = corner::<V>(patch);
        if self.columns == TILE && self.rows == TILE {
            return V::of_picture(&strip[y * self.width + self.left + x..], self.width);
        }
        of_lanes(|lane| {
            let (x, y) = (x + lane % BLOCK_WIDTH, y + lane / BLOCK_WIDTH);
            if x < self.columns && y < self.rows {
                strip[y * self.width + self.left + x]
            } else {
                0.0
            }
        })
    }

    /// Writes a patch into a strip of a picture.
    #[inline(always)]
    pub fn put<V: Patch>(&self, strip: &mut [f32], patch: usize, value: V) {
        let [x, y] = corner::<V>(patch);
        let mut lanes = V::Array::default();
        value.store(&mut lanes);
        if x >= self.columns {
            return;
        }
        let count = BLOCK_WIDTH.min(self.columns - x);
        for (row, from) in lanes.as_ref().chunks_exact(BLOCK_WIDTH).enumerate() {
            if y + row < self.rows {
                let first = (y + row) * self.width + self.left + x;
                strip[first..first + count].copy_from_slice(&from[..count]);
            }
        }
    }
}

/// Column and row, in its tile, of a patch's first pixel.
#[inline(always)]
pub fn corner<V: Patch>(patch: usize) -> [usize; 2] {
    let height = V::LANES / BLOCK_WIDTH;
    [
        patch % BLOCKS_ACROSS * BLOCK_WIDTH,
        patch / BLOCKS_ACROSS * height,
    ]
}
