//! Front-to-back blending of one tile: the state of its pixels and the portable kernel.

use crate::bin::TILE;
use crate::ewa::Judge;
use crate::project::{power_of, Needle, Record, STEP_DOUBT};
use crate::simd::prefetch;

pub const ALPHA_MAX: f32 = 0.99;
/// A pixel takes no more splats once less light than this passes through it.
pub const TRANSMITTANCE_STOP: f32 = 1e-4;

/// Pixels of a block: 4 wide, 2 high, the width of an AVX2 register.
pub const BLOCK_PIXELS: usize = 8;
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

/// A splat in a tile's own coordinates: `u = a·x + b·y + u0`, `v = c·y + v0`, with (x, y) counted
/// from the centre of the tile's first pixel.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct TileSplat {
    pub a: f32,
    pub b: f32,
    pub u0: f32,
    pub c: f32,
    pub v0: f32,
    /// log2(255 · opacity): `log2(255 · alpha) = power - u² - v²`, drawn where it is not negative.
    pub power: f32,
    pub colour: [f32; 3],
    pub depth: f32,
    pub object: i32,
    pub inverse_a: f32,
}

impl TileSplat {
    #[inline(always)]
    pub fn new(work: &TileWork, slot: u32) -> TileSplat {
        let record = &work.records[slot as usize];
        let x = (record.base[0] - work.left) as f32 + (record.offset[0] - 0.5);
        let y = (record.base[1] - work.top) as f32 + (record.offset[1] - 0.5);
        TileSplat {
            a: record.a,
            b: record.b,
            u0: if record.is_needle() {
                needle_u0(work, slot)
            } else {
                -(record.a * x + record.b * y)
            },
            c: record.c,
            v0: -(record.c * y),
            power: power_of(record.log2_opacity),
            colour: record.colour,
            depth: record.depth,
            object: record.object as i32,
            inverse_a: record.inverse_a,
        }
    }
}

#[cold]
fn needle_u0(work: &TileWork, slot: u32) -> f32 {
    let needle = &work.needles[slot as usize];
    let x = needle.centre[0] - f64::from(work.left) - 0.5;
    let y = needle.centre[1] - f64::from(work.top) - 0.5;
    -(needle.a * x + needle.b * y) as f32
}

/// Where a tile lies and what may touch it.
#[derive(Clone, Copy)]
pub struct TileWork<'a> {
    pub records: &'a [Record],
    /// For those records that are needles.
    pub needles: &'a [Needle],
    /// Records of the tile's splats, nearest first.
    pub slots: &'a [u32],
    /// First pixel.
    pub left: i32,
    pub top: i32,
    pub judge: &'a dyn Judge,
}

impl TileWork<'_> {
    /// Takes `slots` of the tile one after the other, and asks for their records some places ahead:
    /// these lie in scene order, so that the machine cannot foresee which comes next.
    #[inline(always)]
    pub fn splats<'a>(&'a self, slots: &'a [u32]) -> impl Iterator<Item = TileSplat> + 'a {
        const PLACES: usize = 16;
        let fetch = |&slot: &u32| prefetch(&self.records[slot as usize]);
        slots.iter().take(PLACES).for_each(fetch);
        let upcoming = slots
            .iter()
            .skip(PLACES)
            .map(Some)
            .chain(std::iter::repeat(None));
        slots.iter().zip(upcoming).map(move |(&slot, soon)| {
            soon.map(fetch);
            TileSplat::new(self, slot)
        })
    }

    /// Asks the judge about a pixel given in the tile's own coordinates.
    #[inline(always)]
    pub fn is_drawn(&self, slot: u32, x: usize, y: usize) -> bool {
        let record = &self.records[slot as usize];
        self.judge
            .is_drawn(record, self.left + x as i32, self.top + y as i32)
    }
}

/// Blends a tile's splats, nearest first.
///
/// `TRACK_OBJECTS`: also keep the object with the largest blend weight.
pub fn blend_tile<const TRACK_OBJECTS: bool>(tile: &mut Tile, work: &TileWork) {
    const SPLATS_PER_CHECK: usize = 32;
    for batch in work.slots.chunks(SPLATS_PER_CHECK) {
        let mut live = tile.blocks.iter().flat_map(|block| &block.transmittance);
        if !live.any(|&t| t >= TRANSMITTANCE_STOP) {
            return;
        }
        for &slot in batch {
            blend_splat::<TRACK_OBJECTS>(tile, work, slot);
        }
    }
}

#[inline(always)]
fn blend_splat<const TRACK_OBJECTS: bool>(tile: &mut Tile, work: &TileWork, slot: u32) {
    let splat = TileSplat::new(work, slot);
    for y in 0..TILE {
        let v = splat.c * y as f32 + splat.v0;
        let row = splat.b * y as f32 + splat.u0;
        let Some((first, last)) = columns_touched(&splat, row, v) else {
            continue;
        };
        for x in first..=last {
            blend_pixel::<TRACK_OBJECTS>(tile, work, slot, &splat, (x, y));
        }
    }
}

/// Blends a splat into the pixel in column `x`, row `y` of the tile; false if that changes nothing.
#[inline(always)]
pub fn blend_pixel<const TRACK_OBJECTS: bool>(
    tile: &mut Tile,
    work: &TileWork,
    slot: u32,
    splat: &TileSplat,
    (x, y): (usize, usize),
) -> bool {
    let u = splat.a * x as f32 + (splat.b * y as f32 + splat.u0);
    let v = splat.c * y as f32 + splat.v0;
    let power = splat.power - u * u - v * v;
    let (block, lane) = Tile::place(x, y);
    let pixel = &mut tile.blocks[block];
    let transmittance = pixel.transmittance[lane];
    if power <= -STEP_DOUBT || transmittance < TRANSMITTANCE_STOP {
        return false;
    }
    if power < STEP_DOUBT && !work.is_drawn(slot, x, y) {
        return false;
    }
    let alpha = alpha_of(power).min(ALPHA_MAX);
    let weight = alpha * transmittance;
    pixel.transmittance[lane] = transmittance - weight;
    for (sum, colour) in pixel.colour.iter_mut().zip(splat.colour) {
        sum[lane] += weight * colour;
    }
    pixel.depth[lane] += weight * splat.depth;
    if TRACK_OBJECTS && weight > pixel.weight[lane] {
        pixel.weight[lane] = weight;
        pixel.object[lane] = splat.object;
    }
    true
}

/// First and last column of a row of pixels inside the alpha = 1/255 ellipse, a hair generously.
#[inline(always)]
pub(crate) fn columns_touched(splat: &TileSplat, row: f32, v: f32) -> Option<(usize, usize)> {
    const SLACK_PX: f32 = 0.01;
    let left_over = splat.power - v * v;
    if left_over < -1e-3 {
        return None;
    }
    let half = left_over.max(0.0).sqrt() * splat.inverse_a + SLACK_PX;
    let centre = -row * splat.inverse_a;
    let first = (centre - half).ceil().max(0.0);
    let last = (centre + half).floor().min(TILE as f32 - 1.0);
    (first <= last).then_some((first as usize, last as usize))
}

/// 2^power / 255 for -118 < power < 127; relative error 2e-7.
#[inline(always)]
pub(crate) fn alpha_of(power: f32) -> f32 {
    let whole = power.round_ties_even();
    let part = power - whole;
    let mut sum = ALPHA_OF[5];
    for k in (0..5).rev() {
        sum = sum * part + ALPHA_OF[k];
    }
    f32::from_bits(sum.to_bits().wrapping_add_signed((whole as i32) << 23))
}

/// Coefficients of 2^f / 255 on -½..½, constant term first (own minimax fit of 2^f).
pub const ALPHA_OF: [f32; 6] = [
    (1.000_000_072_0_f64 / 255.0) as f32,
    (0.693_146_967_1 / 255.0) as f32,
    (0.240_221_197_2 / 255.0) as f32,
    (0.055_507_132_74 / 255.0) as f32,
    (0.009_675_541_334 / 255.0) as f32,
    (0.001_327_647_198 / 255.0) as f32,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_is_close() {
        for i in -100..=800 {
            let power = i as f32 * 0.01;
            let wanted = f64::from(power).exp2() / 255.0;
            let error = f64::from(alpha_of(power)) / wanted - 1.0;
            assert!(error.abs() < 3e-7, "{power}: {error}");
        }
    }

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
