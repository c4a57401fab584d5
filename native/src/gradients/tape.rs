//! A picture that remembers how it was drawn, and the gradients of a loss of it.

use rayon::prelude::*;

use crate::camera::curvature::Curved;
use crate::camera::lens::Lens;
use crate::camera::window::Window;
use crate::gradients::backward::{BackwardTile, PixelGradients, Samples, SUMS};
use crate::gradients::dispatch::run_backward;
use crate::gradients::projection::{
    gradients_of_splat, ObjectGradients, SplatGradient, TwistGradient,
};
use crate::gradients::row_sums::{add_rows, RowSums};
use crate::order::bin::TileRow;
use crate::project::judge::ExactJudge;
use crate::project::posed::PosedCloud;
use crate::project::tile_box::TILE;
use crate::render::engine::blend_all;
use crate::render::job::{Job, Picture};
use crate::render::scratch::{bin_into_rows, project_all, sort_by_depth, Scratch};
use crate::render::tile::ClosedPixels;
use crate::scene::cloud::CHUNK;
use crate::tile::pixels::{Tile, BLOCKS, BLOCK_PIXELS};
use crate::tile::splat::TileWork;

/// The order in which a picture was drawn.
#[derive(Default)]
pub struct Tape {
    pub(crate) scratch: Scratch,
}

/// Gradients of a loss with respect to a picture, laid out as the picture.
pub struct PictureGradients<'a> {
    pub rgb: &'a [f32],
    pub alpha: &'a [f32],
    pub depth: &'a [f32],
}

impl Tape {
    /// Draws `objects` as `render::Engine` does, and remembers.
    pub fn record<L: Lens>(
        objects: &[PosedCloud],
        lens: &L,
        job: &Job,
        picture: &mut Picture,
    ) -> Tape {
        let mut scratch = Scratch::default();
        job.pool.install(|| {
            project_all(objects, lens, job, &mut scratch);
            sort_by_depth(job, &mut scratch);
            bin_into_rows(job, &mut scratch);
            blend_all::<L, true>(objects, lens, job, &scratch, picture);
        });
        Tape { scratch }
    }

    /// Gradients of all splats and poses. `objects`, `lens` and `job` are those of the recording; the
    /// result is the same to the bit for any number of threads.
    pub fn gradients<L: Curved>(
        &self,
        objects: &[PosedCloud],
        lens: &L,
        job: &Job,
        d_picture: &PictureGradients,
    ) -> Vec<ObjectGradients> {
        job.pool.install(|| {
            let rows = self.sum_tiles(objects, lens, job, d_picture);
            let mut sums = vec![[0.0f64; SUMS]; self.scratch.groups.len() * CHUNK];
            add_rows(&rows, &mut sums);
            drop(rows);
            self.project_back(objects, lens, job, &sums)
        })
    }

    /// The blend's part alone.
    pub(crate) fn sum_tiles<L: Lens>(
        &self,
        objects: &[PosedCloud],
        lens: &L,
        job: &Job,
        d_picture: &PictureGradients,
    ) -> Vec<RowSums<SUMS>> {
        let (width, height) = (job.view.width, job.view.height);
        let rows_of_tiles = height.div_ceil(TILE);
        let columns = width.div_ceil(TILE);
        let judge = ExactJudge {
            objects,
            lens,
            antialias: job.view.antialias,
        };
        (0..rows_of_tiles)
            .into_par_iter()
            .with_max_len(1)
            .map_init(
                || (TileRow::default(), Samples::default()),
                |(lists, samples), row| {
                    self.scratch.fill_row(row, job, lists);
                    let mut out = RowSums::default();
                    for column in 0..columns {
                        let slots = lists.tile(column);
                        let first = out.slots.len();
                        out.slots.extend_from_slice(slots);
                        out.sums.resize(first + slots.len(), [0.0; SUMS]);
                        let (left, top) = (column * TILE, row * TILE);
                        if !job.scope.is_open(row, column) {
                            continue;
                        }
                        let Some(mut gradients) = pixel_gradients(job, d_picture, left, top) else {
                            continue;
                        };
                        run_backward(
                            job.simd,
                            BackwardTile {
                                work: TileWork {
                                    records: &self.scratch.records,
                                    needles: &self.scratch.needles,
                                    slots,
                                    left: left as i32,
                                    top: top as i32,
                                    judge: &judge,
                                },
                                transmittance: open_pixels(lens, &job.scope.window, left, top),
                                gradients: &mut gradients,
                                samples,
                                sums: &mut out.sums[first..],
                            },
                        );
                    }
                    out
                },
            )
            .collect()
    }

    fn project_back<L: Curved>(
        &self,
        objects: &[PosedCloud],
        lens: &L,
        job: &Job,
        sums: &[[f64; SUMS]],
    ) -> Vec<ObjectGradients> {
        let groups: Vec<(Vec<SplatGradient>, TwistGradient)> = self
            .scratch
            .groups
            .par_iter()
            .enumerate()
            .map(|(place, group)| {
                let mut twist = TwistGradient::default();
                let splats = (place * CHUNK..place * CHUNK + group.count)
                    .filter(|&slot| sums[slot].iter().any(|&v| v != 0.0))
                    .map(|slot| {
                        let record = &self.scratch.records[slot];
                        let posed = &objects[record.object as usize];
                        let gradient =
                            gradients_of_splat(posed, lens, &job.view, record, &sums[slot]);
                        twist.add(&gradient.twist);
                        gradient
                    })
                    .collect();
                (splats, twist)
            })
            .collect();
        let mut out: Vec<ObjectGradients> = objects
            .iter()
            .map(|o| ObjectGradients::zero(o.cloud))
            .collect();
        for (splats, twist) in groups {
            for splat in &splats {
                out[splat.object as usize].put(splat);
            }
            if let Some(splat) = splats.first() {
                out[splat.object as usize].twist.add(&twist);
            }
        }
        out
    }
}

/// 1 for pixels that may be drawn, 0 for those outside the lens circle or the window.
pub fn open_pixels<L: Lens>(
    lens: &L,
    window: &Window,
    left: usize,
    top: usize,
) -> [[f32; BLOCK_PIXELS]; BLOCKS] {
    let mut transmittance = [[1.0; BLOCK_PIXELS]; BLOCKS];
    if let Some(outside) = &ClosedPixels::new(lens, window, left, top).outside {
        for (pixel, &is_out) in outside.iter().enumerate() {
            if is_out {
                let (block, lane) = Tile::place(pixel % TILE, pixel / TILE);
                transmittance[block][lane] = 0.0;
            }
        }
    }
    transmittance
}

/// None where no pixel of the tile matters.
fn pixel_gradients(
    job: &Job,
    d_picture: &PictureGradients,
    left: usize,
    top: usize,
) -> Option<PixelGradients> {
    let (width, height) = (job.view.width, job.view.height);
    let mut gradients = PixelGradients::ZERO;
    let mut matters = false;
    for y in 0..TILE.min(height - top) {
        for x in 0..TILE.min(width - left) {
            let place = (top + y) * width + left + x;
            let (block, lane) = Tile::place(x, y);
            let mut constant = d_picture.alpha[place];
            let background = job.background.at(place);
            for (channel, behind) in background.into_iter().enumerate() {
                let d_colour = d_picture.rgb[3 * place + channel];
                gradients.colour[block][channel][lane] = d_colour;
                // What passes through a splat shows the background.
                constant -= behind * d_colour;
                matters |= d_colour != 0.0;
            }
            let d_depth = d_picture.depth[place];
            gradients.depth[block][lane] = d_depth;
            gradients.has_depth |= d_depth != 0.0;
            gradients.constant[block][lane] = constant;
            matters |= constant != 0.0;
        }
    }
    (matters || gradients.has_depth).then_some(gradients)
}
