//! What one tile gives to the training's backward sweep: its pixels' gradients, errors and light,
//! row by row as the loss has them, and patch by patch as the kernels take them.

use crate::camera::lens::Lens;
use crate::gradients::tape::open_pixels;
use crate::lanes::patch::Patch;
use crate::lanes::vector::Vector;
use crate::project::tile_box::TILE;
use crate::render::job::Job;
use crate::tile::pixels::{Tile, BLOCKS, BLOCK_WIDTH};
use crate::train::depth_bounds::{DepthBounds, FARTHEST};
use crate::train::loss::Loss;

/// Gradients and errors of a tile's pixels, row by row.
#[derive(Clone)]
pub(crate) struct TilePixels {
    pub(super) d_colour: [[f32; PIXELS]; 3],
    pub(super) error: [f32; PIXELS],
    /// Contribution of all that is shown.
    pub(super) contribution: [f32; PIXELS],
    pub(super) transmittance: [f32; PIXELS],
    pub(super) bounds: [[f32; PIXELS]; 2],
    /// Loss per unit of weight and price; 0 where no bounds are known or asked for.
    pub(super) depth_rate: f32,
}

/// Pixels of a tile.
pub(super) const PIXELS: usize = TILE * TILE;
/// A tile has at most so many patches, in registers as narrow as a block.
pub(super) const MAX_PATCHES: usize = BLOCKS;

/// The same of a patch's pixels.
#[derive(Clone, Copy)]
pub(super) struct PatchPixels<V: Vector> {
    pub(super) d_colour: [V::Array; 3],
    pub(super) error: V::Array,
    /// Contribution of what is not yet accounted for.
    pub(super) contribution: V::Array,
    pub(super) transmittance: V::Array,
    pub(super) bounds: [V::Array; 2],
}

impl Default for TilePixels {
    fn default() -> TilePixels {
        TilePixels {
            d_colour: [[0.0; PIXELS]; 3],
            error: [0.0; PIXELS],
            contribution: [0.0; PIXELS],
            transmittance: [0.0; PIXELS],
            bounds: [[0.0; PIXELS]; 2],
            depth_rate: 0.0,
        }
    }
}

impl TilePixels {
    /// The same, one register at a time.
    #[inline(always)]
    pub(super) fn patches<V: Patch>(&self) -> [PatchPixels<V>; MAX_PATCHES] {
        let nothing = V::Array::default();
        let mut patches = [PatchPixels {
            d_colour: [nothing; 3],
            error: nothing,
            contribution: nothing,
            transmittance: nothing,
            bounds: [nothing; 2],
        }; MAX_PATCHES];
        let across = TILE / BLOCK_WIDTH;
        for (patch, pixels) in patches[..PIXELS / V::LANES].iter_mut().enumerate() {
            let top = patch / across * (V::LANES / BLOCK_WIDTH);
            let first = top * TILE + patch % across * BLOCK_WIDTH;
            for (to, from) in pixels.d_colour.iter_mut().zip(&self.d_colour) {
                V::of_picture(&from[first..], TILE).store(to);
            }
            V::of_picture(&self.error[first..], TILE).store(&mut pixels.error);
            V::of_picture(&self.contribution[first..], TILE).store(&mut pixels.contribution);
            V::of_picture(&self.transmittance[first..], TILE).store(&mut pixels.transmittance);
            if self.depth_rate > 0.0 {
                for (to, from) in pixels.bounds.iter_mut().zip(&self.bounds) {
                    V::of_picture(&from[first..], TILE).store(to);
                }
            }
        }
        patches
    }

    /// Gathers a tile from the planes of the loss; nothing is seen outside the picture.
    pub(crate) fn gather<L: Lens>(
        &mut self,
        lens: &L,
        job: &Job,
        loss: &Loss,
        left: usize,
        top: usize,
    ) {
        let (width, height) = (job.view.width, job.view.height);
        let plane = width * height;
        self.transmittance.fill(0.0);
        self.depth_rate = 0.0;
        let count = TILE.min(width - left);
        let open = lens
            .circle()
            .map(|_| open_pixels(lens, &job.scope.window, left, top));
        for y in 0..TILE.min(height - top) {
            let first = (top + y) * width + left;
            let row = y * TILE..y * TILE + count;
            for (channel, to) in self.d_colour.iter_mut().enumerate() {
                let first = channel * plane + first;
                to[row.clone()].copy_from_slice(&loss.d_colour[first..first + count]);
            }
            self.error[row.clone()].copy_from_slice(&loss.error[first..first + count]);
            self.contribution[row.clone()]
                .copy_from_slice(&loss.contribution[first..first + count]);
            for (x, to) in self.transmittance[row].iter_mut().enumerate() {
                *to = open.as_ref().map_or(1.0, |open| {
                    let (block, lane) = Tile::place(x, y);
                    open[block][lane]
                });
            }
        }
    }

    /// Gathers where weight has a price; `rate` is the loss per unit of weight and price.
    pub(crate) fn gather_bounds(
        &mut self,
        bounds: &DepthBounds,
        rate: f32,
        size: [usize; 2],
        corner: [usize; 2],
    ) {
        let ([width, height], [left, top]) = (size, corner);
        let count = TILE.min(width - left);
        for (to, default) in self.bounds.iter_mut().zip([0.0, FARTHEST]) {
            to.fill(default);
        }
        let mut says = false;
        for y in 0..TILE.min(height - top) {
            let first = (top + y) * width + left;
            let row = y * TILE..y * TILE + count;
            for (to, from) in self.bounds.iter_mut().zip([&bounds.near, &bounds.far]) {
                to[row.clone()].copy_from_slice(&from[first..first + count]);
            }
            says |= self.bounds[0][row.clone()].iter().any(|&v| v > 0.0)
                || self.bounds[1][row].iter().any(|&v| v < FARTHEST);
        }
        if says {
            self.depth_rate = rate;
        }
    }
}
