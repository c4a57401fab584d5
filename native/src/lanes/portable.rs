//! Lanes as plain arrays: any machine, and the twin of the vector kinds.

use crate::lanes::patch::{Block, Lanes, Patch};
use crate::lanes::vector::Vector;
use crate::project::tile_box::TILE;
use crate::tile::pixels::{BLOCKS_ACROSS, BLOCK_HEIGHT, BLOCK_PIXELS, BLOCK_WIDTH};
use crate::tile::splat::{columns_touched, TileSplat};

/// Plain arrays: any machine, and the twin of the vector kinds.
#[derive(Clone, Copy)]
pub struct Portable(Block);

impl Portable {
    #[inline(always)]
    fn with(self, other: Self, op: impl Fn(f32, f32) -> f32) -> Self {
        Portable(std::array::from_fn(|lane| op(self.0[lane], other.0[lane])))
    }
}

impl Vector for Portable {
    type Array = Block;
    const LANES: usize = BLOCK_PIXELS;

    #[inline(always)]
    fn all(value: f32) -> Self {
        Portable([value; BLOCK_PIXELS])
    }
    #[inline(always)]
    fn load(from: &Block) -> Self {
        Portable(*from)
    }
    #[inline(always)]
    fn store(self, to: &mut Block) {
        *to = self.0;
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
    #[inline(always)]
    fn reciprocal(self) -> Self {
        Portable(self.0.map(|v| 1.0 / v))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self.mul(factor).add(term)
    }
    #[inline(always)]
    fn mul_sub_from(self, factor: Self, term: Self) -> Self {
        term.sub(self.mul(factor))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.with(other, f32::min)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Portable(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn at_least(self, other: Self) -> Self {
        self.with(other, |a, b| {
            f32::from_bits(0u32.wrapping_sub((a >= b) as u32))
        })
    }
    #[inline(always)]
    fn and(self, mask: Self) -> Self {
        self.with(mask, |a, b| f32::from_bits(a.to_bits() & b.to_bits()))
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        (0..BLOCK_PIXELS).fold(0, |bits, lane| {
            bits | (self.0[lane].to_bits() >> 31) << lane
        })
    }
    #[inline(always)]
    fn scale_by(self, shifted: Self) -> Self {
        self.with(shifted, |a, b| {
            f32::from_bits(a.to_bits().wrapping_add(b.to_bits() << 23))
        })
    }
    #[inline(always)]
    fn sums(values: [Self; 4]) -> [f32; 4] {
        values.map(|v| v.0.iter().sum())
    }
    #[inline(always)]
    fn prefetch<T>(_: &T) {}
}

impl Patch for Portable {
    #[inline(always)]
    fn patch_mask(splat: &TileSplat) -> u32 {
        let mut mask = 0;
        for y in 0..TILE {
            let v = splat.c * y as f32 + splat.v0;
            let row = splat.b * y as f32 + splat.u0;
            if let Some((first, last)) = columns_touched(splat, row, v) {
                let along = (first / BLOCK_WIDTH..=last / BLOCK_WIDTH)
                    .fold(0, |bits, block| bits | 1 << block);
                mask |= along << (y / BLOCK_HEIGHT * BLOCKS_ACROSS);
            }
        }
        mask
    }
}

impl Lanes for Portable {
    #[inline(always)]
    fn transposed_lanes(values: [Self; BLOCK_PIXELS]) -> [Self; BLOCK_PIXELS] {
        std::array::from_fn(|j| Portable(std::array::from_fn(|k| values[k].0[j])))
    }
}
