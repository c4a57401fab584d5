//! The pipeline: cull chunks, project, sort by depth, bin into tiles, blend.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::blend::dispatch::blend_tile;
use crate::blend::wide::{TileRays, TouchedBlocks, WideBlend, WideTile};
use crate::camera::lens::Lens;
use crate::lanes::dispatch::run_lanes;
use crate::order::bin::TileRow;
use crate::project::judge::ExactJudge;
use crate::project::posed::{PosedCloud, View};
use crate::project::tile_box::{TileBox, TILE};
use crate::project::wide::WideSplats;
use crate::render::job::{Background, Job, Picture};
use crate::render::scratch::{project_all, Scratch};
use crate::render::tile::{leave_tile, write_tile, ClosedPixels};
use crate::tile::pixels::{Tile, BLOCK_WIDTH};
use crate::tile::splat::TileWork;

/// Draws pictures, keeping buffers from one to the next.
#[derive(Default)]
pub struct Engine {
    idle: Mutex<Vec<Scratch>>,
}

impl Engine {
    /// Draws `objects` through `lens`; see `Scratch::mark` for `marked`. The picture is the same to
    /// the bit for any number of threads.
    pub fn render<L: Lens>(
        &self,
        objects: &[PosedCloud],
        lens: &L,
        job: &Job,
        marked: Option<u32>,
        picture: &mut Picture,
    ) {
        let mut scratch = self.borrow_scratch();
        job.pool.install(|| {
            scratch.list_splats(objects, lens, job);
            if let Some(object) = marked {
                scratch.mark(object);
            }
            if objects.len() > 1 {
                blend_all::<L, true>(objects, lens, job, &scratch, picture);
            } else {
                blend_all::<L, false>(objects, lens, job, &scratch, picture);
            }
        });
        self.give_back(scratch);
    }

    /// Draws an object without wide splats, and again in other colours, by a splat's index in its
    /// cloud: as the splats that have one would be drawn alone.
    pub fn render_twice<L: Lens>(
        &self,
        object: PosedCloud,
        colours: &[Option<[f32; 3]>],
        lens: &L,
        job: &Job,
        [first, second]: [&mut Picture; 2],
    ) {
        let mut scratch = self.borrow_scratch();
        let objects = [object];
        job.pool.install(|| {
            scratch.list_splats(&objects, lens, job);
            blend_all::<L, false>(&objects, lens, job, &scratch, first);
            scratch.recolour(colours);
            blend_all::<L, false>(&objects, lens, job, &scratch, second);
        });
        self.give_back(scratch);
    }

    /// Left, top, right and bottom of the tiles that any splat touches, in pixels; None if none does.
    pub fn reach<L: Lens>(
        &self,
        objects: &[PosedCloud],
        lens: &L,
        job: &Job,
    ) -> Option<[usize; 4]> {
        let mut scratch = self.borrow_scratch();
        job.pool
            .install(|| project_all(objects, lens, job, &mut scratch));
        let reached = scratch.slots().map(|slot| scratch.boxes[slot]);
        let reached = reached.reduce(|a, b| a.with(&b));
        self.give_back(scratch);
        let TileBox { columns, rows } = reached?;
        let [left, top] = [columns[0], rows[0]].map(|tile| usize::from(tile) * TILE);
        let [right, bottom] = [columns[1], rows[1]].map(|tile| (usize::from(tile) + 1) * TILE);
        let View { width, height, .. } = job.view;
        Some([left, top, right.min(width), bottom.min(height)])
    }

    fn borrow_scratch(&self) -> Scratch {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.pop().unwrap_or_default()
    }

    fn give_back(&self, scratch: Scratch) {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.push(scratch);
    }
}

/// Blends every tile; a task is a row of tiles, whose pixels lie together in the picture.
pub(crate) fn blend_all<L: Lens, const TRACK_OBJECTS: bool>(
    objects: &[PosedCloud],
    lens: &L,
    job: &Job,
    scratch: &Scratch,
    picture: &mut Picture,
) {
    let width = job.view.width;
    let strip = width * TILE;
    let judge = ExactJudge {
        objects,
        lens,
        antialias: job.view.antialias,
    };
    let wides = match job.view.exact_above.is_finite() {
        true => WideSplats::new(objects, lens, &scratch.records, scratch.slots()),
        false => WideSplats::default(),
    };
    let mut rows: Vec<_> = picture
        .rgb
        .chunks_mut(3 * strip)
        .zip(picture.alpha.chunks_mut(strip))
        .zip(picture.depth.chunks_mut(strip))
        .zip(picture.ids.chunks_mut(strip))
        .enumerate()
        .collect();
    // Threads take rows as they go. With the fullest first, the last ones to end are short.
    rows.sort_by_cached_key(|(row, _)| std::cmp::Reverse(scratch.splats_of_row(*row)));
    rows.into_iter().par_bridge().for_each_init(
        TileRow::default,
        |lists, (row, (((rgb, alpha), depth), ids))| {
            if job.scope.row_is_open(row) {
                scratch.fill_row(row, job, lists);
            }
            let mut strip = Picture {
                rgb,
                alpha,
                depth,
                ids,
            };
            for column in 0..width.div_ceil(TILE) {
                let slots = match job.scope.is_open(row, column) {
                    true => lists.tile(column),
                    false => &[],
                };
                if slots.is_empty() {
                    leave_tile(job, row, column, &mut strip);
                    continue;
                }
                let work = TileWork {
                    records: &scratch.records,
                    needles: &scratch.needles,
                    slots,
                    left: (column * TILE) as i32,
                    top: (row * TILE) as i32,
                    judge: &judge,
                };
                draw_tile::<L, TRACK_OBJECTS>(&judge, &wides, job, &work, &mut strip);
            }
        },
    );
}

/// Blends one tile and writes it to its strip of the picture.
pub(crate) fn draw_tile<L: Lens, const TRACK_OBJECTS: bool>(
    judge: &ExactJudge<L>,
    wides: &WideSplats,
    job: &Job,
    work: &TileWork,
    strip: &mut Picture,
) {
    let (left, top) = (work.left as usize, work.top as usize);
    let mask = ClosedPixels::new(judge.lens, &job.scope.window, left, top);
    let mut tile = Tile::EMPTY;
    mask.close_outside(&mut tile);
    blend_runs::<L, TRACK_OBJECTS>(&mut tile, judge, wides, job, work);
    mask.open_outside(&mut tile);
    let width = job.view.width;
    match job.background {
        Background::Plain(colour) => job.simd.run(
            #[inline(always)]
            || write_tile::<TRACK_OBJECTS>(&tile, left, width, |_| [colour; BLOCK_WIDTH], strip),
        ),
        Background::Picture(_) => {
            let first = top * width;
            let behind = |place: usize| {
                // Beyond the last pixel nothing is copied.
                let last = width * job.view.height - 1;
                std::array::from_fn(|k| job.background.at((first + place + k).min(last)))
            };
            write_tile::<TRACK_OBJECTS>(&tile, left, width, behind, strip);
        }
    }
}

/// Blends a tile's splats, the ordinary ones between two wide ones together.
fn blend_runs<L: Lens, const TRACK_OBJECTS: bool>(
    tile: &mut Tile,
    judge: &ExactJudge<L>,
    wides: &WideSplats,
    job: &Job,
    work: &TileWork,
) {
    let is_wide = |&slot: &u32| work.records[slot as usize].is_wide();
    if wides.is_empty() || !work.slots.iter().any(is_wide) {
        return blend_tile::<TRACK_OBJECTS>(job.simd, tile, work);
    }
    let rays = job.simd.run(
        #[inline(always)]
        || TileRays::new(judge.lens, work.left as usize, work.top as usize),
    );
    let mut run = Vec::with_capacity(work.slots.len());
    for slot in work.slots {
        if !is_wide(slot) {
            run.push(*slot);
            continue;
        }
        let wide = WideTile::new(wides.at(*slot), &rays);
        let blocks = match wide.may_touch() {
            true => run_lanes(job.simd, TouchedBlocks(&wide)),
            false => 0,
        };
        // What misses the tile does not part the others.
        if blocks == 0 {
            continue;
        }
        if !run.is_empty() {
            let slots = &run;
            blend_tile::<TRACK_OBJECTS>(job.simd, tile, &TileWork { slots, ..*work });
            run.clear();
            if tile.is_closed() {
                return;
            }
        }
        run_lanes(
            job.simd,
            WideBlend::<TRACK_OBJECTS> {
                tile,
                wide: &wide,
                record: &work.records[*slot as usize],
                blocks,
            },
        );
    }
    let slots = &run;
    blend_tile::<TRACK_OBJECTS>(job.simd, tile, &TileWork { slots, ..*work });
}
