//! The pixels of a tile and what they have gathered.

use crate::project::tile_box::TILE;

/// Largest alpha of a splat at a pixel, as in 3D Gaussian splatting (Kerbl et al. 2023).
pub const ALPHA_MAX: f32 = 0.99;
/// A pixel takes no more splats once less light than this passes through it.
pub const TRANSMITTANCE_STOP: f32 = 1e-4;

/// Pixels of a block: 4 wide, 2 high, the width of an AVX2 register.
pub const BLOCK_PIXELS: usize = 8;
/// Pixels across and down a block, blocks across a tile, and blocks of a tile.
pub const BLOCK_WIDTH: usize = 4;
pub const BLOCK_HEIGHT: usize = 2;
pub const BLOCKS_ACROSS: usize = TILE / BLOCK_WIDTH;
pub const BLOCKS: usize = TILE * TILE / BLOCK_PIXELS;

/// What eight pixels have gathered so far.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct PixelBlock {
    pub transmittance: [f32; BLOCK_PIXELS],
    pub colour: [[f32; BLOCK_PIXELS]; 3],
    pub depth: [f32; BLOCK_PIXELS],
    /// Largest blend weight so far, and the object it came from; kept only with several objects.
    pub weight: [f32; BLOCK_PIXELS],
    pub object: [i32; BLOCK_PIXELS],
}

/// All pixels of a tile.
#[derive(Clone)]
pub struct Tile {
    pub blocks: [PixelBlock; BLOCKS],
}

impl Tile {
    pub const EMPTY: Tile = Tile {
        blocks: [PixelBlock {
            transmittance: [1.0; BLOCK_PIXELS],
            colour: [[0.0; BLOCK_PIXELS]; 3],
            depth: [0.0; BLOCK_PIXELS],
            weight: [0.0; BLOCK_PIXELS],
            object: [-1; BLOCK_PIXELS],
        }; BLOCKS],
    };

    /// Whether no pixel takes light any more.
    pub fn is_closed(&self) -> bool {
        let takes_light = |&transmittance: &f32| transmittance >= TRANSMITTANCE_STOP;
        let mut pixels = self.blocks.iter().map(|block| &block.transmittance);
        !pixels.any(|block| block.iter().any(takes_light))
    }

    /// Whether the pixel in column `x`, row `y` of the tile still takes light.
    pub fn is_live(&self, x: usize, y: usize) -> bool {
        let (block, lane) = Tile::place(x, y);
        self.blocks[block].transmittance[lane] >= TRANSMITTANCE_STOP
    }

    /// Block and lane of the pixel in column `x`, row `y` of the tile.
    #[inline(always)]
    pub fn place(x: usize, y: usize) -> (usize, usize) {
        let block = y / BLOCK_HEIGHT * BLOCKS_ACROSS + x / BLOCK_WIDTH;
        let lane = y % BLOCK_HEIGHT * BLOCK_WIDTH + x % BLOCK_WIDTH;
        (block, lane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_distinct() {
        let mut seen = vec![false; BLOCKS * BLOCK_PIXELS];
        for y in 0..TILE {
            for x in 0..TILE {
                let (block, lane) = Tile::place(x, y);
                assert!(!std::mem::replace(
                    &mut seen[block * BLOCK_PIXELS + lane],
                    true
                ));
            }
        }
    }
}
