//! Pixels of a tile as one value, so that a kernel is written once and compiled for every
//! instruction set: eight of them (a block), or a patch of as many as a register holds.

use crate::bin::TILE;
use crate::blend::{
    self, TileSplat, ALPHA_OF, BLOCKS, BLOCKS_ACROSS, BLOCK_HEIGHT, BLOCK_PIXELS, BLOCK_WIDTH,
};

/// One value per pixel of a block.
pub type Block = [f32; BLOCK_PIXELS];

/// Arithmetic on the lanes of a register. Masks have all bits of a lane set or none.
pub trait Vector: Copy {
    /// The lanes in memory.
    type Array: Copy + Default + AsRef<[f32]> + AsMut<[f32]>;
    const LANES: usize;
    fn all(value: f32) -> Self;
    fn load(from: &Self::Array) -> Self;
    fn store(self, to: &mut Self::Array);
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// 1 / self, to about the last digit.
    fn reciprocal(self) -> Self;
    /// self · factor + term, rounded once where the machine can.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// term - self · factor, rounded once where the machine can.
    fn mul_sub_from(self, factor: Self, term: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// Mask of self >= other.
    fn at_least(self, other: Self) -> Self;
    fn and(self, mask: Self) -> Self;
    /// One bit per lane of a mask.
    fn bits(self) -> u32;
    /// Adds the low bits of `shifted` to the exponent.
    fn scale_by(self, shifted: Self) -> Self;
    /// Sums over the lanes of four values.
    fn sums(values: [Self; 4]) -> [f32; 4];
    /// Asks for memory that will be read soon.
    fn prefetch<T>(place: &T);
}

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

/// A kernel: what `Simd::run_lanes` runs with the instructions it stands for.
pub trait LaneWork {
    type Output;
    fn run<V: Lanes>(self) -> Self::Output;
}

/// A kernel that takes registers of any width: what `Simd::run_patches` runs.
pub trait PatchWork {
    type Output;
    fn run<V: Patch>(self) -> Self::Output;
}

/// 2^power / 255 for -118 < power < 127; anything else gives bits that the caller masks.
#[inline(always)]
pub fn alpha_of<V: Vector>(power: V) -> V {
    // Adding 1.5·2²³ rounds to a whole number and leaves it in the low bits.
    let magic = V::all(12_582_912.0);
    let shifted = power.add(magic);
    let part = power.sub(shifted.sub(magic));
    let mut sum = V::all(ALPHA_OF[5]);
    for k in (0..5).rev() {
        sum = sum.mul_add(part, V::all(ALPHA_OF[k]));
    }
    sum.scale_by(shifted)
}

const COLUMNS: Block = [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];
const ROWS: Block = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];

/// Three values loaded, and three values everywhere. Kernels spell such things out instead of
/// mapping closures over arrays: a closure is compiled without the vector instructions.
#[inline(always)]
pub fn load3<V: Lanes>(rows: &[Block; 3]) -> [V; 3] {
    [V::load(&rows[0]), V::load(&rows[1]), V::load(&rows[2])]
}

#[inline(always)]
pub fn all3<V: Vector>(values: &[f32; 3]) -> [V; 3] {
    [V::all(values[0]), V::all(values[1]), V::all(values[2])]
}

/// Columns and rows of a block's pixels in its tile.
#[inline(always)]
pub fn pixels_of<V: Lanes>(block: usize) -> (V, V) {
    let left = (block % BLOCKS_ACROSS * BLOCK_WIDTH) as f32;
    let top = (block / BLOCKS_ACROSS * BLOCK_HEIGHT) as f32;
    let (x, y) = (V::load(&COLUMNS), V::load(&ROWS));
    (x.add(V::all(left)), y.add(V::all(top)))
}

/// Whitened offsets (u, v) of a block's pixels from a splat's centre.
#[inline(always)]
pub fn whitened<V: Vector>(splat: &TileSplat, x: V, y: V) -> (V, V) {
    let row = V::all(splat.b).mul_add(y, V::all(splat.u0));
    let u = V::all(splat.a).mul_add(x, row);
    let v = V::all(splat.c).mul_add(y, V::all(splat.v0));
    (u, v)
}

/// log2(255 · alpha), in the order of operations of the forward kernel.
#[inline(always)]
pub fn power_at<V: Vector>(splat: &TileSplat, u: V, v: V) -> V {
    u.mul_sub_from(u, v.mul_sub_from(v, V::all(splat.power)))
}

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
            if let Some((first, last)) = blend::columns_touched(splat, row, v) {
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

/// One bit per block in which a pixel lets at least `limit` of the light through.
#[inline(always)]
pub fn live_blocks(transmittance: &[Block; BLOCKS], limit: f32) -> u32 {
    let mut live = 0;
    for (index, block) in transmittance.iter().enumerate() {
        live |= u32::from(block.iter().any(|&t| t >= limit)) << index;
    }
    live
}

/// The lanes of `bits` as a mask.
#[inline(always)]
pub fn mask_of<V: Vector>(bits: u32) -> V {
    of_lanes(|lane| f32::from_bits(0u32.wrapping_sub(bits >> lane & 1)))
}

/// A value from what each lane holds.
#[inline(always)]
pub fn of_lanes<V: Vector>(value: impl Fn(usize) -> f32) -> V {
    let mut lanes = V::Array::default();
    for (lane, to) in lanes.as_mut().iter_mut().enumerate() {
        *to = value(lane);
    }
    V::load(&lanes)
}
