//! A splat in the coordinates of one tile.

use crate::machine::simd::prefetch;
use crate::project::judge::Judge;
use crate::project::record::{power_of, Needle, Record};
use crate::project::tile_box::TILE;

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
