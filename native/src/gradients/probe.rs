//! The stages of one picture, each as often as asked, and what its blend goes through; for benchmarks.
//!
//! Nothing here reads a clock: the caller does, around the calls.

use std::hint::black_box;

use crate::blend::dispatch::{self, blend_tile, lanes};
use crate::blend::portable::blend_pixel;
use crate::camera::lens::Lens;
use crate::gradients::tape::{PictureGradients, Tape};
use crate::lanes::patch::Lanes;
use crate::lanes::portable::Portable;
use crate::machine::simd::Simd;
use crate::order::bin::TileRow;
use crate::project::judge::{ExactJudge, Judge};
use crate::project::posed::PosedCloud;
use crate::project::record::Record;
use crate::project::tile_box::TILE;
use crate::render::engine::blend_all;
use crate::render::job::{Job, Picture};
use crate::render::scratch::{bin_into_rows, project_all, sort_by_depth};
use crate::render::tile::ClosedPixels;
use crate::tile::batch::{corner, PatchList, BATCH, RUN};
use crate::tile::pixels::{Tile, BLOCK_WIDTH};
use crate::tile::splat::{TileSplat, TileWork};

/// What a picture is of.
pub struct Sight<'a, L> {
    pub objects: &'a [PosedCloud<'a>],
    pub lens: &'a L,
    pub job: &'a Job<'a>,
}

/// Buffers of one picture's stages; each stage needs those before it to have run.
#[derive(Default)]
pub struct Probe {
    tape: Tape,
    rows: Vec<TileRow>,
    colours_and_depths: Vec<f32>,
    ids: Vec<i32>,
}

/// Samples that a blend goes through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LaneCount {
    /// Those that change their pixel.
    pub useful: u64,
    /// All lanes of the patches that a kernel visits.
    pub processed: u64,
}

impl Probe {
    /// Culls and projects.
    pub fn project<L: Lens>(&mut self, sight: &Sight<L>) {
        let scratch = &mut self.tape.scratch;
        sight
            .job
            .pool
            .install(|| project_all(sight.objects, sight.lens, sight.job, scratch));
    }

    /// Sorts what `project` found; once, since it is sorted after that.
    pub fn sort(&mut self, job: &Job) {
        let scratch = &mut self.tape.scratch;
        job.pool.install(|| sort_by_depth(job, scratch));
    }

    /// Lists the splats of every tile.
    pub fn bin(&mut self, job: &Job) {
        job.pool.install(|| {
            bin_into_rows(job, &mut self.tape.scratch);
            let count = job.view.height.div_ceil(TILE);
            self.rows.resize_with(count, TileRow::default);
            for (row, lists) in self.rows.iter_mut().enumerate() {
                self.tape.scratch.fill_row(row, job, lists);
            }
        });
    }

    /// Blends every tile with `simd` and forgets it.
    pub fn blend<L: Lens>(&self, sight: &Sight<L>, simd: Simd) {
        self.for_each_tile(sight, |mut tile, work| {
            blend_tile::<false>(simd, &mut tile, work);
            black_box(&tile);
        });
    }

    /// What the kernel of `simd` goes through in `blend`; the portable one is counted as if it took
    /// eight pixels at a time.
    pub fn count_lanes<L: Lens>(&self, sight: &Sight<L>, simd: Simd) -> LaneCount {
        let mut total = LaneCount::default();
        self.for_each_tile(sight, |tile, work| {
            let count = match lanes(simd) {
                16 => count_tile::<16>(tile, work),
                _ => count_tile::<8>(tile, work),
            };
            total.useful += count.useful;
            total.processed += count.processed;
        });
        total
    }

    /// Draws the whole picture from the lists, into memory kept for it.
    pub fn draw<L: Lens>(&mut self, sight: &Sight<L>) {
        let pixels = sight.job.view.width * sight.job.view.height;
        self.colours_and_depths.resize(5 * pixels, 0.0);
        self.ids.resize(pixels, 0);
        let (rgb, rest) = self.colours_and_depths.split_at_mut(3 * pixels);
        let (alpha, depth) = rest.split_at_mut(pixels);
        let ids = &mut self.ids;
        let mut picture = Picture {
            rgb,
            alpha,
            depth,
            ids,
        };
        let (objects, scratch) = (sight.objects, &self.tape.scratch);
        sight.job.pool.install(|| {
            if objects.len() > 1 {
                blend_all::<L, true>(objects, sight.lens, sight.job, scratch, &mut picture);
            } else {
                blend_all::<L, false>(objects, sight.lens, sight.job, scratch, &mut picture);
            }
        });
    }

    /// The blend backwards: gradients of a loss, summed per splat over its tiles.
    pub fn blend_back<L: Lens>(&self, sight: &Sight<L>, d_picture: &PictureGradients) {
        sight.job.pool.install(|| {
            black_box(
                self.tape
                    .sum_tiles(sight.objects, sight.lens, sight.job, d_picture),
            );
        });
    }

    fn for_each_tile<L: Lens>(&self, sight: &Sight<L>, mut visit: impl FnMut(Tile, &TileWork)) {
        let judge = ExactJudge {
            objects: sight.objects,
            lens: sight.lens,
            antialias: sight.job.view.antialias,
        };
        for (row, lists) in self.rows.iter().enumerate() {
            for column in 0..sight.job.view.width.div_ceil(TILE) {
                let (left, top) = (column * TILE, row * TILE);
                let work = TileWork {
                    records: &self.tape.scratch.records,
                    needles: &self.tape.scratch.needles,
                    slots: lists.tile(column),
                    left: left as i32,
                    top: top as i32,
                    judge: &judge,
                };
                let mut tile = Tile::EMPTY;
                ClosedPixels::new(sight.lens, &sight.job.scope.window, left, top)
                    .close_outside(&mut tile);
                visit(tile, &work);
            }
        }
    }
}

/// Follows the order in which kernels with patches of `LANES` pixels take batches, patches and runs.
fn count_tile<const LANES: usize>(mut tile: Tile, work: &TileWork) -> LaneCount {
    let mut count = LaneCount::default();
    for slots in work.slots.chunks(BATCH) {
        let splats: Vec<(u32, TileSplat)> = slots
            .iter()
            .map(|&slot| (slot, TileSplat::new(work, slot)))
            .collect();
        let masks: Vec<u32> = splats
            .iter()
            .map(|(_, splat)| Portable::block_mask(splat))
            .collect();
        for patch in 0..TILE * TILE / LANES {
            let blocks = blocks_of::<LANES>(patch);
            let list: Vec<_> = splats
                .iter()
                .zip(&masks)
                .filter(|(_, &mask)| mask & blocks != 0)
                .collect();
            for run in list.chunks(RUN) {
                if !pixels_of::<LANES>(patch).any(|(x, y)| tile.is_live(x, y)) {
                    break;
                }
                for (&(slot, splat), _) in run {
                    count.processed += LANES as u64;
                    for pixel in pixels_of::<LANES>(patch) {
                        count.useful +=
                            u64::from(blend_pixel::<false>(&mut tile, work, slot, &splat, pixel));
                    }
                }
            }
        }
    }
    count
}

/// One bit per block of a patch.
fn blocks_of<const LANES: usize>(patch: usize) -> u32 {
    pixels_of::<LANES>(patch).fold(0, |bits, (x, y)| bits | 1 << Tile::place(x, y).0)
}

/// Columns and rows of a patch's pixels in the tile.
fn pixels_of<const LANES: usize>(patch: usize) -> impl Iterator<Item = (usize, usize)> {
    let (left, top) = corner::<LANES>(patch);
    (0..LANES).map(move |lane| (left + lane % BLOCK_WIDTH, top + lane / BLOCK_WIDTH))
}

/// The pace that the inner loop of `simd` allows: `BATCH` splats over a whole tile that stays in the
/// first-level cache, `times` over, all lanes in use. Returns the lanes it went through; none for the
/// portable kernel, which has no lists.
pub fn blend_everywhere(simd: Simd, times: usize) -> u64 {
    // So flat that it reaches everywhere, so faint that no pixel closes.
    let splat = TileSplat {
        a: 1e-3,
        c: 1e-3,
        power: 1.0,
        colour: [0.2, 0.5, 0.7],
        depth: 2.0,
        ..TileSplat::default()
    };
    let everything = PatchList {
        patch: 0,
        list: &std::array::from_fn::<u8, BATCH, _>(|place| place as u8),
        splats: &[splat; BATCH],
        slots: &[0; BATCH],
        work: &TileWork {
            records: &[],
            needles: &[],
            slots: &[],
            left: 0,
            top: 0,
            judge: &Everywhere,
        },
    };
    let mut lanes = 0;
    for _ in 0..times {
        let mut tile = Tile::EMPTY;
        if dispatch::blend_everywhere(simd, &mut tile, black_box(&everything)) {
            lanes += (TILE * TILE * BATCH) as u64;
        }
        black_box(&tile);
    }
    lanes
}

/// Never asked: no sample of `blend_everywhere` is near the step.
struct Everywhere;

impl Judge for Everywhere {
    fn is_drawn(&self, _: &Record, _: i32, _: i32) -> bool {
        true
    }
}
