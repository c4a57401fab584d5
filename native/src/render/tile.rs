//! From a tile to the picture: which of its pixels take no splats, what is written, what shows where
//! nothing is drawn.

use crate::camera::lens::Lens;
use crate::camera::window::Window;
use crate::project::tile_box::TILE;
use crate::render::job::{Background, Job, Picture};
use crate::tile::pixels::{Tile, BLOCK_WIDTH, TRANSMITTANCE_STOP};

/// Shows the background in a tile that is not drawn.
pub(crate) fn leave_tile(job: &Job, row: usize, column: usize, strip: &mut Picture) {
    let width = job.view.width;
    let (left, right) = (column * TILE, ((column + 1) * TILE).min(width));
    for y in 0..strip.ids.len() / width {
        let across = y * width + left..y * width + right;
        strip.ids[across.clone()].fill(-1);
        strip.alpha[across.clone()].fill(0.0);
        strip.depth[across].fill(0.0);
        let rgb = &mut strip.rgb[3 * (y * width + left)..3 * (y * width + right)];
        match job.background {
            Background::Plain([red, green, blue]) if red == green && green == blue => rgb.fill(red),
            Background::Plain(colour) => {
                for pixel in rgb.chunks_exact_mut(3) {
                    pixel.copy_from_slice(&colour);
                }
            }
            Background::Picture(values) => {
                let place = (row * TILE + y) * width;
                rgb.copy_from_slice(&values[3 * (place + left)..3 * (place + right)]);
            }
        }
    }
}

/// The pixels of a tile that lie outside the lens circle or the window; nothing is drawn there.
pub(crate) struct ClosedPixels {
    pub(crate) outside: Option<[bool; TILE * TILE]>,
}

impl ClosedPixels {
    pub(crate) fn new<L: Lens>(lens: &L, window: &Window, left: usize, top: usize) -> ClosedPixels {
        let circle = lens.circle().filter(|circle| cuts(*circle, left, top));
        let is_cut = window.is_part
            && (left < window.left
                || top < window.top
                || left + TILE > window.right
                || top + TILE > window.bottom);
        if circle.is_none() && !is_cut {
            return ClosedPixels { outside: None };
        }
        let mut outside = [false; TILE * TILE];
        if let Some((radius, centre)) = circle {
            for y in 0..TILE {
                for x in 0..TILE {
                    let dx = (left + x) as f64 + 0.5 - centre[0];
                    let dy = (top + y) as f64 + 0.5 - centre[1];
                    outside[y * TILE + x] = dx * dx + dy * dy > radius * radius;
                }
            }
        }
        if is_cut {
            for (pixel, is_out) in outside.iter_mut().enumerate() {
                let (x, y) = (left + pixel % TILE, top + pixel / TILE);
                *is_out |= !(window.left..window.right).contains(&x)
                    || !(window.top..window.bottom).contains(&y);
            }
        }
        ClosedPixels {
            outside: outside.contains(&true).then_some(outside),
        }
    }

    /// Makes the outside opaque, so that it takes no splats.
    pub(crate) fn close_outside(&self, tile: &mut Tile) {
        self.set_outside(tile, 0.0);
    }

    /// Makes the outside empty again.
    pub(crate) fn open_outside(&self, tile: &mut Tile) {
        self.set_outside(tile, 1.0);
    }

    fn set_outside(&self, tile: &mut Tile, transmittance: f32) {
        const { assert!(TRANSMITTANCE_STOP > 0.0) };
        let Some(outside) = &self.outside else {
            return;
        };
        for (pixel, _) in outside.iter().enumerate().filter(|(_, &is_out)| is_out) {
            let (block, lane) = Tile::place(pixel % TILE, pixel / TILE);
            tile.blocks[block].transmittance[lane] = transmittance;
        }
    }
}

/// Whether a lens circle, its radius and centre, leaves out pixels of a tile.
fn cuts((radius, centre): (f64, [f64; 2]), left: usize, top: usize) -> bool {
    let farthest = |first: usize, centre: f64| {
        let from_first = first as f64 + 0.5 - centre;
        from_first.abs().max((from_first + (TILE - 1) as f64).abs())
    };
    let [dx, dy] = [farthest(left, centre[0]), farthest(top, centre[1])];
    dx * dx + dy * dy > radius * radius
}

/// Copies a tile to a strip of the picture (16 rows of `width` pixels, fewer at the bottom).
///
/// `behind`: the background of four pixels, by the place of the first in the strip.
#[inline(always)]
pub(crate) fn write_tile<const TRACK_OBJECTS: bool>(
    tile: &Tile,
    left: usize,
    width: usize,
    behind: impl Fn(usize) -> [[f32; 3]; BLOCK_WIDTH],
    strip: &mut Picture,
) {
    const WIDTH: usize = BLOCK_WIDTH;
    let rows = strip.alpha.len() / width;
    for y in 0..rows {
        for x in (0..TILE.min(width - left)).step_by(WIDTH) {
            let (block, lane) = Tile::place(x, y);
            let pixels = &tile.blocks[block];
            let at = |k: usize| lane + k;
            let transmittance: [f32; WIDTH] = std::array::from_fn(|k| pixels.transmittance[at(k)]);
            let place = y * width + left + x;
            let background = behind(place);
            let rgb: [[f32; 3]; WIDTH] = std::array::from_fn(|k| {
                std::array::from_fn(|channel| {
                    pixels.colour[channel][at(k)] + transmittance[k] * background[k][channel]
                })
            });
            let alpha = transmittance.map(|t| 1.0 - t);
            let depth: [f32; WIDTH] = std::array::from_fn(|k| {
                let mean = pixels.depth[at(k)] / alpha[k];
                if alpha[k] > 0.0 {
                    mean
                } else {
                    0.0
                }
            });
            let ids: [i32; WIDTH] = std::array::from_fn(|k| match TRACK_OBJECTS {
                true => pixels.object[at(k)],
                false => i32::from(alpha[k] > 0.0) - 1,
            });
            let count = WIDTH.min(width - left - x);
            copy_some(&mut strip.rgb[3 * place..], rgb.as_flattened(), 3 * count);
            copy_some(&mut strip.alpha[place..], &alpha, count);
            copy_some(&mut strip.depth[place..], &depth, count);
            copy_some(&mut strip.ids[place..], &ids, count);
        }
    }
}

/// Copies the first `count` values; the usual case, all of them, has a length the compiler knows.
#[inline(always)]
fn copy_some<T: Copy>(target: &mut [T], source: &[T], count: usize) {
    if count == source.len() {
        target[..source.len()].copy_from_slice(source);
    } else {
        target[..count].copy_from_slice(&source[..count]);
    }
}
