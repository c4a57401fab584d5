//! Front-to-back blending of one tile: the portable kernel.

use crate::project::record::STEP_DOUBT;
use crate::project::tile_box::TILE;
use crate::tile::alpha::alpha_of;
use crate::tile::pixels::{Tile, ALPHA_MAX, TRANSMITTANCE_STOP};
use crate::tile::splat::{columns_touched, TileSplat, TileWork};

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
