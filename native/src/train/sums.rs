//! Sums per splat over a picture, for training: tiles are swept by `backward` in rows, on all
//! threads, and their sums per splat are added up in the same order for any number of them.

use rayon::prelude::*;

use crate::camera::lens::Lens;
use crate::gradients::row_sums::{add_rows, RowSums};
use crate::lanes::dispatch::run_patches;
use crate::order::bin::TileRow;
use crate::project::judge::Judge;
use crate::project::record::Record;
use crate::project::tile_box::TILE;
use crate::render::job::Job;
use crate::render::scratch::Scratch;
use crate::tile::splat::TileWork;
use crate::train::backward::{Sums, TrainingTile, SUMS};
use crate::train::depth_bounds::DepthBounds;
use crate::train::loss::Loss;
use crate::train::tile_pixels::TilePixels;

/// Sums per splat; buffers kept between pictures.
#[derive(Default)]
pub(crate) struct TrainingSums {
    rows: Vec<RowSums<SUMS>>,
    /// By record.
    pub(crate) totals: Vec<Sums>,
}

/// What a thread keeps from row to row.
#[derive(Default)]
struct Gathered {
    lists: TileRow,
    pixels: TilePixels,
}

/// Decides nothing: this pass asks no judge.
struct Nobody;

impl Judge for Nobody {
    fn is_drawn(&self, _: &Record, _: i32, _: i32) -> bool {
        false
    }
}

impl TrainingSums {
    /// Sums over the picture that `scratch` drew, given its loss; the same to the bit for any number
    /// of threads. `records` is the number of records that hold splats or gaps between them.
    pub(crate) fn fill<L: Lens>(
        &mut self,
        lens: &L,
        job: &Job,
        scratch: &Scratch,
        records: usize,
        loss: &Loss,
        priced: Option<(&DepthBounds, f32)>,
    ) {
        let rows_of_tiles = job.view.height.div_ceil(TILE);
        let columns = job.view.width.div_ceil(TILE);
        let size = [job.view.width, job.view.height];
        let rate = |price: f32| price / (size[0] * size[1]) as f32;
        self.rows.resize_with(rows_of_tiles, RowSums::default);
        self.rows
            .par_iter_mut()
            .with_max_len(1)
            .enumerate()
            .for_each_init(Gathered::default, |gathered, (row, out)| {
                let Gathered { lists, pixels } = gathered;
                scratch.fill_row(row, job, lists);
                out.slots.clear();
                out.sums.clear();
                for column in 0..columns {
                    let slots = lists.tile(column);
                    let first = out.slots.len();
                    out.slots.extend_from_slice(slots);
                    out.sums.resize(first + slots.len(), [0.0; SUMS]);
                    let (left, top) = (column * TILE, row * TILE);
                    pixels.gather(lens, job, loss, left, top);
                    if let Some((bounds, price)) = priced {
                        pixels.gather_bounds(bounds, rate(price), size, [left, top]);
                    }
                    run_patches(
                        job.simd,
                        TrainingTile {
                            work: TileWork {
                                records: &scratch.records,
                                needles: &scratch.needles,
                                slots,
                                left: left as i32,
                                top: top as i32,
                                judge: &Nobody,
                            },
                            pixels,
                            sums: &mut out.sums[first..],
                        },
                    );
                }
            });
        self.totals.clear();
        self.totals.resize(records, [0.0; SUMS]);
        add_rows(&self.rows, &mut self.totals);
    }
}
