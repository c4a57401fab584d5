//! The blend kernel for AVX2 + FMA: eight pixels (4×2) at a time, block after block.
//!
//! A batch of splats is first turned into one list of splats per block (exact spans of each row of
//! pixels, then a bit transpose), so that the inner loop has no branches to guess and keeps a
//! block's pixels in registers.

use std::arch::x86_64::*;

use crate::bin::TILE;
use crate::blend::{
    PixelBlock, Tile, TileSplat, TileWork, ALPHA_MAX, ALPHA_OF, BLOCKS, BLOCKS_ACROSS,
    BLOCK_HEIGHT, BLOCK_WIDTH, TRANSMITTANCE_STOP,
};
use crate::project::STEP_DOUBT;
use crate::simd::prefetch;

/// Splats listed at a time; their constants stay in the first-level cache.
pub const BATCH: usize = 128;
/// Splats whose masks are transposed together.
const GROUP: usize = 32;
/// Splats blended into a block between two looks at whether it still takes light.
pub const RUN: usize = 8;
/// Bytes per splat's mask of blocks.
const MASK_BYTES: usize = BLOCKS / 8;

/// Bit positions of every byte value, packed to the front.
static POSITIONS: [[u8; 8]; 256] = positions();

const fn positions() -> [[u8; 8]; 256] {
    let mut table = [[0; 8]; 256];
    let mut value = 0;
    while value < 256 {
        let (mut bit, mut count) = (0, 0);
        while bit < 8 {
            if value >> bit & 1 == 1 {
                table[value][count] = bit as u8;
                count += 1;
            }
            bit += 1;
        }
        value += 1;
    }
    table
}

/// Working memory of one tile's batch.
struct Batch {
    splats: [TileSplat; BATCH],
    /// Byte `j` of the block mask of each splat.
    masks: [[u8; BATCH]; MASK_BYTES],
    /// Splats of each block, in order; room for the eight bytes that each append stores.
    lists: [[u8; BATCH + 8]; BLOCKS],
    lengths: [usize; BLOCKS],
}

/// As `blend::blend_tile`.
#[target_feature(enable = "avx2,fma")]
pub fn blend_tile<const TRACK_OBJECTS: bool>(tile: &mut Tile, work: &TileWork) {
    let mut batch = Batch {
        splats: [TileSplat::default(); BATCH],
        masks: [[0; BATCH]; MASK_BYTES],
        lists: [[0; BATCH + 8]; BLOCKS],
        lengths: [0; BLOCKS],
    };
    for chosen in work.slots.chunks(BATCH) {
        let live = live_blocks(tile);
        if live == 0 {
            return;
        }
        for (place, &slot) in chosen.iter().enumerate() {
            fetch_ahead(work, chosen, place);
            let splat = TileSplat::new(work, slot);
            let mask = block_mask(&splat) & live;
            for (bytes, byte) in batch.masks.iter_mut().zip(mask.to_le_bytes()) {
                bytes[place] = byte;
            }
            batch.splats[place] = splat;
        }
        for bytes in &mut batch.masks {
            bytes[chosen.len()..].fill(0);
        }
        list_by_block(&mut batch, chosen.len());
        for (index, block) in tile.blocks.iter_mut().enumerate() {
            let list = &batch.lists[index][..batch.lengths[index]];
            let chosen = Chosen {
                splats: &batch.splats,
                slots: chosen,
                work,
            };
            blend_block::<TRACK_OBJECTS>(block, index, list, &chosen);
        }
    }
}

/// Asks for the record of a splat a few places on: records lie in scene order, so that the machine
/// cannot foresee which comes next.
#[inline(always)]
pub fn fetch_ahead(work: &TileWork, slots: &[u32], place: usize) {
    const PLACES: usize = 12;
    if let Some(&slot) = slots.get(place + PLACES) {
        prefetch(&work.records[slot as usize]);
    }
}

/// One bit per block that still takes light.
#[target_feature(enable = "avx2,fma")]
fn live_blocks(tile: &Tile) -> u32 {
    let mut live = 0;
    for (index, block) in tile.blocks.iter().enumerate() {
        let is_live = block.transmittance.iter().any(|&t| t >= TRANSMITTANCE_STOP);
        live |= u32::from(is_live) << index;
    }
    live
}

/// One bit per block that the alpha = 1/255 ellipse touches, from the span of every row of pixels.
#[target_feature(enable = "avx2,fma")]
pub(crate) fn block_mask(splat: &TileSplat) -> u32 {
    const SLACK_PX: f32 = 0.01;
    const SLACK_POWER: f32 = 1e-3;
    let b = _mm256_set1_ps(splat.b);
    let c = _mm256_set1_ps(splat.c);
    let u0 = _mm256_set1_ps(splat.u0);
    let v0 = _mm256_set1_ps(splat.v0);
    let inverse_a = _mm256_set1_ps(splat.inverse_a);
    let power = _mm256_set1_ps(splat.power + SLACK_POWER);
    let slack = _mm256_set1_ps(SLACK_PX);
    let zero = _mm256_setzero_ps();
    let mut rows = _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0);
    let mut bits = _mm256_setzero_si256();
    let mut shifts = _mm256_setr_epi32(0, 0, 4, 4, 8, 8, 12, 12);
    for _ in 0..TILE / 8 {
        let v = _mm256_fmadd_ps(c, rows, v0);
        let left_over = _mm256_fnmadd_ps(v, v, power);
        let is_touched = _mm256_cmp_ps::<_CMP_GE_OQ>(left_over, zero);
        let root = _mm256_sqrt_ps(_mm256_max_ps(left_over, zero));
        let half = _mm256_fmadd_ps(root, inverse_a, slack);
        let row = _mm256_fmadd_ps(b, rows, u0);
        let first = _mm256_fnmsub_ps(row, inverse_a, half);
        let last = _mm256_fnmadd_ps(row, inverse_a, half);
        let nibble = blocks_between(first, last);
        let nibble = _mm256_and_si256(nibble, _mm256_castps_si256(is_touched));
        bits = _mm256_or_si256(bits, _mm256_sllv_epi32(nibble, shifts));
        rows = _mm256_add_ps(rows, _mm256_set1_ps(8.0));
        shifts = _mm256_add_epi32(shifts, _mm256_set1_epi32(16));
    }
    let half = _mm_or_si128(
        _mm256_castsi256_si128(bits),
        _mm256_extracti128_si256::<1>(bits),
    );
    let quarter = _mm_or_si128(half, _mm_unpackhi_epi64(half, half));
    let word = _mm_or_si128(quarter, _mm_shuffle_epi32::<1>(quarter));
    _mm_cvtsi128_si32(word) as u32
}

/// For each lane, four bits: the blocks along a row that hold a pixel in `first..=last`.
#[target_feature(enable = "avx2,fma")]
fn blocks_between(first: __m256, last: __m256) -> __m256i {
    const LAST_COLUMN: f32 = TILE as f32 - 1.0;
    let first = _mm256_ceil_ps(_mm256_max_ps(first, _mm256_setzero_ps()));
    let last = _mm256_floor_ps(_mm256_min_ps(last, _mm256_set1_ps(LAST_COLUMN)));
    let is_empty = _mm256_cmp_ps::<_CMP_NLE_UQ>(first, last);
    // Empty spans may be far outside; they are masked below, so what the conversion makes of them
    // does not matter (variable shifts by 32 and more give 0).
    let first_block = _mm256_srai_epi32::<2>(_mm256_cvttps_epi32(first));
    let last_block = _mm256_srai_epi32::<2>(_mm256_cvttps_epi32(last));
    let all = _mm256_set1_epi32((1 << BLOCKS_ACROSS) - 1);
    let from_first = _mm256_sllv_epi32(all, first_block);
    let beyond_last = _mm256_sub_epi32(_mm256_set1_epi32(BLOCKS_ACROSS as i32 - 1), last_block);
    let to_last = _mm256_srlv_epi32(all, beyond_last);
    let both = _mm256_and_si256(from_first, to_last);
    _mm256_andnot_si256(_mm256_castps_si256(is_empty), both)
}

/// Turns a mask of blocks per splat into a list of splats per block.
#[target_feature(enable = "avx2,fma")]
fn list_by_block(batch: &mut Batch, count: usize) {
    batch.lengths = [0; BLOCKS];
    for first in (0..count).step_by(GROUP) {
        for (byte, bytes) in batch.masks.iter().enumerate() {
            let group: &[u8; GROUP] = bytes[first..first + GROUP]
                .try_into()
                .expect("a batch is whole groups");
            // SAFETY: `group` is 32 readable bytes; the load needs no alignment.
            let mut column = unsafe { _mm256_loadu_si256(group.as_ptr().cast()) };
            for bit in (0..8).rev() {
                let block = byte * 8 + bit;
                let splats = _mm256_movemask_epi8(column) as u32;
                column = _mm256_add_epi8(column, column);
                let list = &mut batch.lists[block];
                let mut length = batch.lengths[block];
                for (eighth, value) in splats.to_le_bytes().into_iter().enumerate() {
                    let base = (first + 8 * eighth) as u64 * 0x0101_0101_0101_0101;
                    let packed = u64::from_le_bytes(POSITIONS[value as usize]) + base;
                    list[length..length + 8].copy_from_slice(&packed.to_le_bytes());
                    length += value.count_ones() as usize;
                }
                batch.lengths[block] = length;
            }
        }
    }
}

/// A batch as the inner loop sees it.
#[derive(Clone, Copy)]
struct Chosen<'a> {
    splats: &'a [TileSplat; BATCH],
    /// Record of each splat of the batch.
    slots: &'a [u32],
    work: &'a TileWork<'a>,
}

impl Chosen<'_> {
    /// Takes the lanes of `doubtful` (one bit each) to the judge; the others keep their verdict.
    #[cold]
    #[inline(never)]
    fn settle(&self, place: usize, block: usize, mut verdict: u32, doubtful: u32) -> [u32; 8] {
        for lane in (0..8).filter(|lane| doubtful >> lane & 1 == 1) {
            let x = block % BLOCKS_ACROSS * BLOCK_WIDTH + lane % BLOCK_WIDTH;
            let y = block / BLOCKS_ACROSS * BLOCK_HEIGHT + lane / BLOCK_WIDTH;
            let is_drawn = self.work.is_drawn(self.slots[place], x, y);
            verdict = verdict & !(1 << lane) | u32::from(is_drawn) << lane;
        }
        std::array::from_fn(|lane| 0u32.wrapping_sub(verdict >> lane & 1))
    }
}

/// The state of a block in registers.
#[derive(Clone, Copy)]
struct Pixels {
    transmittance: __m256,
    colour: [__m256; 3],
    depth: __m256,
    weight: __m256,
    object: __m256,
}

#[target_feature(enable = "avx2,fma")]
fn blend_block<const TRACK_OBJECTS: bool>(
    block: &mut PixelBlock,
    index: usize,
    list: &[u8],
    chosen: &Chosen,
) {
    if list.is_empty() {
        return;
    }
    let before = load_pixels(block);
    let (mut after, nearest) = blend_list::<TRACK_OBJECTS, false>(before, index, list, chosen);
    let is_doubtful = _mm256_cmp_ps::<_CMP_LT_OQ>(nearest, _mm256_set1_ps(STEP_DOUBT));
    if _mm256_movemask_ps(is_doubtful) != 0 {
        after = blend_carefully::<TRACK_OBJECTS>(before, index, list, chosen);
    }
    store_pixels(block, &after);
}

/// The rare second pass, in which doubtful samples go to the judge. Kept apart so that the call
/// costs the first pass no registers.
#[cold]
#[inline(never)]
#[target_feature(enable = "avx2,fma")]
fn blend_carefully<const TRACK_OBJECTS: bool>(
    before: Pixels,
    index: usize,
    list: &[u8],
    chosen: &Chosen,
) -> Pixels {
    blend_list::<TRACK_OBJECTS, true>(before, index, list, chosen).0
}

/// Blends a list of splats; also returns how near any sample came to the 1/255 step, per lane.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn blend_list<const TRACK_OBJECTS: bool, const CAREFUL: bool>(
    mut pixels: Pixels,
    index: usize,
    list: &[u8],
    chosen: &Chosen,
) -> (Pixels, __m256) {
    let left = (index % BLOCKS_ACROSS * BLOCK_WIDTH) as f32;
    let top = (index / BLOCKS_ACROSS * BLOCK_HEIGHT) as f32;
    let x = _mm256_add_ps(
        _mm256_set1_ps(left),
        _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0),
    );
    let y = _mm256_add_ps(
        _mm256_set1_ps(top),
        _mm256_setr_ps(0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0),
    );
    let mut nearest = _mm256_set1_ps(f32::INFINITY);
    for run in list.chunks(RUN) {
        for &place in run {
            let place = place as usize % BATCH;
            let splat = &chosen.splats[place];
            let power = power_at(splat, x, y);
            let distance = _mm256_andnot_ps(_mm256_set1_ps(-0.0), power);
            nearest = _mm256_min_ps(nearest, distance);
            let mut is_drawn = _mm256_cmp_ps::<_CMP_GE_OQ>(power, _mm256_setzero_ps());
            if CAREFUL {
                let is_doubtful = _mm256_cmp_ps::<_CMP_LT_OQ>(distance, _mm256_set1_ps(STEP_DOUBT));
                let verdict = _mm256_movemask_ps(is_drawn) as u32;
                let doubtful = _mm256_movemask_ps(is_doubtful) as u32;
                let lanes = chosen.settle(place, index, verdict, doubtful);
                // SAFETY: `lanes` is an array of eight 4-byte values; the load needs no alignment.
                is_drawn = unsafe { _mm256_loadu_ps(lanes.as_ptr().cast()) };
            }
            blend_one::<TRACK_OBJECTS>(&mut pixels, splat, power, is_drawn);
        }
        let stop = _mm256_set1_ps(TRANSMITTANCE_STOP);
        let is_live = _mm256_cmp_ps::<_CMP_GE_OQ>(pixels.transmittance, stop);
        if _mm256_movemask_ps(is_live) == 0 {
            break;
        }
    }
    (pixels, nearest)
}

/// log2(255 · alpha) of a splat at eight pixels.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn power_at(splat: &TileSplat, x: __m256, y: __m256) -> __m256 {
    let u = _mm256_fmadd_ps(
        _mm256_set1_ps(splat.a),
        x,
        _mm256_fmadd_ps(_mm256_set1_ps(splat.b), y, _mm256_set1_ps(splat.u0)),
    );
    let v = _mm256_fmadd_ps(_mm256_set1_ps(splat.c), y, _mm256_set1_ps(splat.v0));
    let power = _mm256_fnmadd_ps(v, v, _mm256_set1_ps(splat.power));
    _mm256_fnmadd_ps(u, u, power)
}

/// Blends one splat into eight pixels; see `blend::blend_splat` for the same in plain code.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn blend_one<const TRACK_OBJECTS: bool>(
    pixels: &mut Pixels,
    splat: &TileSplat,
    power: __m256,
    is_drawn: __m256,
) {
    let stop = _mm256_set1_ps(TRANSMITTANCE_STOP);
    let is_live = _mm256_cmp_ps::<_CMP_GE_OQ>(pixels.transmittance, stop);
    // Only the last of these waits for the splat before: that chain sets the pace.
    let alpha = _mm256_min_ps(alpha_of(power), _mm256_set1_ps(ALPHA_MAX));
    let alpha = _mm256_and_ps(_mm256_and_ps(alpha, is_drawn), is_live);
    let weight = _mm256_mul_ps(alpha, pixels.transmittance);
    pixels.transmittance = _mm256_fnmadd_ps(alpha, pixels.transmittance, pixels.transmittance);
    for (sum, &value) in pixels.colour.iter_mut().zip(&splat.colour) {
        *sum = _mm256_fmadd_ps(weight, _mm256_set1_ps(value), *sum);
    }
    pixels.depth = _mm256_fmadd_ps(weight, _mm256_set1_ps(splat.depth), pixels.depth);
    if TRACK_OBJECTS {
        let is_heavier = _mm256_cmp_ps::<_CMP_GT_OQ>(weight, pixels.weight);
        let object = _mm256_castsi256_ps(_mm256_set1_epi32(splat.object));
        pixels.object = _mm256_blendv_ps(pixels.object, object, is_heavier);
        pixels.weight = _mm256_max_ps(pixels.weight, weight);
    }
}

/// 2^power / 255 for -118 < power < 127; anything else gives bits that the caller masks.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn alpha_of(power: __m256) -> __m256 {
    // Adding 1.5·2²³ rounds to a whole number and leaves it in the low bits.
    let magic = _mm256_set1_ps(12_582_912.0);
    let shifted = _mm256_add_ps(power, magic);
    let part = _mm256_sub_ps(power, _mm256_sub_ps(shifted, magic));
    let mut sum = _mm256_set1_ps(ALPHA_OF[5]);
    for k in (0..5).rev() {
        sum = _mm256_fmadd_ps(sum, part, _mm256_set1_ps(ALPHA_OF[k]));
    }
    let exponent = _mm256_slli_epi32::<23>(_mm256_castps_si256(shifted));
    _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(sum), exponent))
}

#[target_feature(enable = "avx2,fma")]
fn load_pixels(block: &PixelBlock) -> Pixels {
    // SAFETY: every source is an array of eight 4-byte values; the loads need no alignment.
    unsafe {
        Pixels {
            transmittance: _mm256_loadu_ps(block.transmittance.as_ptr()),
            colour: [
                _mm256_loadu_ps(block.colour[0].as_ptr()),
                _mm256_loadu_ps(block.colour[1].as_ptr()),
                _mm256_loadu_ps(block.colour[2].as_ptr()),
            ],
            depth: _mm256_loadu_ps(block.depth.as_ptr()),
            weight: _mm256_loadu_ps(block.weight.as_ptr()),
            object: _mm256_loadu_ps(block.object.as_ptr().cast()),
        }
    }
}

#[target_feature(enable = "avx2,fma")]
fn store_pixels(block: &mut PixelBlock, pixels: &Pixels) {
    // SAFETY: every target is an array of eight 4-byte values; the stores need no alignment.
    unsafe {
        _mm256_storeu_ps(block.transmittance.as_mut_ptr(), pixels.transmittance);
        for (target, &value) in block.colour.iter_mut().zip(&pixels.colour) {
            _mm256_storeu_ps(target.as_mut_ptr(), value);
        }
        _mm256_storeu_ps(block.depth.as_mut_ptr(), pixels.depth);
        _mm256_storeu_ps(block.weight.as_mut_ptr(), pixels.weight);
        _mm256_storeu_ps(block.object.as_mut_ptr().cast(), pixels.object);
    }
}
