//! Pixels of a tile as one value, so that a kernel is written once and compiled for every
//! instruction set: eight of them (a block), or a patch of as many as a register holds.

use crate::lanes::vector::Vector;
use crate::tile::pixels::{BLOCKS, BLOCKS_ACROSS, BLOCK_HEIGHT, BLOCK_PIXELS, BLOCK_WIDTH};
use crate::tile::splat::TileSplat;

/// One value per pixel of a block.
pub type Block = [f32; BLOCK_PIXELS];

/// A register over a patch of a tile: `BLOCK_WIDTH` pixels wide and as high as the lanes allow,
/// patches counted along the rows of the tile.
pub trait Patch: Vector {
    /// One bit per patch that the splat's alpha = 1/255 ellipse may touch.
    fn patch_mask(splat: &TileSplat) -> u32;

    /// The patch whose first pixel starts `picture`, whose rows are `width` apart.
    #[inline(always)]
    fn of_picture(picture: &[f32], width: usize) -> Self {
        let mut lanes = Self::Array::default();
        for (row, to) in lanes.as_mut().chunks_exact_mut(BLOCK_WIDTH).enumerate() {
            to.copy_from_slice(&picture[row * width..row * width + BLOCK_WIDTH]);
        }
        Self::load(&lanes)
    }

    /// Bit `k` of byte `j` becomes bit `j` of word `k`.
    #[inline(always)]
    fn transposed(bytes: &[u8; 64]) -> [u64; 8] {
        let mut words = [0; 8];
        for (j, &byte) in bytes.iter().enumerate() {
            for (k, word) in words.iter_mut().enumerate() {
                *word |= u64::from(byte >> k & 1) << j;
            }
        }
        words
    }
}

/// A register over one block.
pub trait Lanes: Patch<Array = Block> {
    /// Lane `j` of value `k` becomes lane `k` of value `j`.
    fn transposed_lanes(values: [Self; BLOCK_PIXELS]) -> [Self; BLOCK_PIXELS];

    /// One bit per block of a tile that the splat's alpha = 1/255 ellipse may touch.
    #[inline(always)]
    fn block_mask(splat: &TileSplat) -> u32 {
        Self::patch_mask(splat)
    }
}

/// A kernel: what `dispatch::run_lanes` runs with the instructions it stands for.
pub trait LaneWork {
    type Output;
    fn run<V: Lanes>(self) -> Self::Output;
}

/// A kernel that takes registers of any width: what `dispatch::run_patches` runs.
pub trait PatchWork {
    type Output;
    fn run<V: Patch>(self) -> Self::Output;
}

/// Columns and rows, in their block, of a block's pixels.
const COLUMNS: Block = [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];
const ROWS: Block = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];

/// Three values loaded. Kernels write this out instead of
/// mapping closures over arrays: a closure is compiled without the vector instructions.
#[inline(always)]
pub fn load3<V: Lanes>(rows: &[Block; 3]) -> [V; 3] {
    [V::load(&rows[0]), V::load(&rows[1]), V::load(&rows[2])]
}

/// Columns and rows of a block's pixels in its tile.
#[inline(always)]
pub fn pixels_of<V: Lanes>(block: usize) -> (V, V) {
    let left = (block % BLOCKS_ACROSS * BLOCK_WIDTH) as f32;
    let top = (block / BLOCKS_ACROSS * BLOCK_HEIGHT) as f32;
    let (x, y) = (V::load(&COLUMNS), V::load(&ROWS));
    (x.add(V::all(left)), y.add(V::all(top)))
}

/// One bit per block in which a pixel lets at least `limit` of the light through.
#[inline(always)]
pub fn live_blocks(transmittance: &[Block; BLOCKS], limit: f32) -> u32 {
    let mut live = 0;
    for (index, block) in transmittance.iter().enumerate() {
        live |= u32::from(block.iter().any(|&t| t >= limit)) << index;
    }
    live
}
