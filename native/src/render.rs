//! The pipeline: cull chunks, project, sort by depth, bin into tiles, blend.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use rayon::ThreadPool;

use crate::bin::{TileRow, TILE};
use crate::blend::{Tile, TileWork, BLOCK_WIDTH};
use crate::camera::{Group, Lens};
use crate::ewa::ExactJudge;
use crate::project::{project_chunk, Needle, PosedCloud, Record, Slots, TileBox, View};
use crate::scene::CHUNK;
use crate::scope::Scope;
use crate::simd::Simd;
use crate::slab::{self, Slab};
use crate::tile_picture::{leave_tile, write_tile, ClosedPixels};
use crate::wide::{self, WideSplats};
use crate::wide_tile::{TileRays, TouchedBlocks, WideBlend, WideTile};

/// Largest width and height, set by the 16-bit rows and tile columns.
pub const MAX_SIDE: usize = 32_768;

/// Where the picture goes: row-major, `width * height` pixels each, all zero before the first use.
pub struct Picture<'a> {
    /// Three values a pixel.
    pub rgb: &'a mut [f32],
    pub alpha: &'a mut [f32],
    pub depth: &'a mut [f32],
    pub ids: &'a mut [i32],
}

/// What shows where no splat is.
#[derive(Clone, Copy)]
pub enum Background<'a> {
    Plain([f32; 3]),
    /// Row-major, three values a pixel.
    Picture(&'a [f32]),
}

impl Background<'_> {
    /// Colour at a place of the picture, counted in pixels row by row.
    #[inline(always)]
    pub fn at(&self, place: usize) -> [f32; 3] {
        match self {
            Background::Plain(colour) => *colour,
            Background::Picture(values) => {
                std::array::from_fn(|channel| values[3 * place + channel])
            }
        }
    }
}

/// How to draw.
pub struct Job<'a> {
    pub view: View,
    pub scope: &'a Scope,
    pub background: Background<'a>,
    pub simd: Simd,
    pub pool: &'a ThreadPool,
}

/// Buffers kept between pictures; their contents mean nothing.
#[derive(Default)]
pub(crate) struct Scratch {
    pub(crate) records: Vec<Record>,
    keys: Vec<u32>,
    boxes: Vec<TileBox>,
    pub(crate) needles: Vec<Needle>,
    /// What is in each `CHUNK` slots.
    pub(crate) groups: Vec<slab::Group>,
    /// Which chunk of its cloud each of those groups came from.
    pub(crate) chunks: Vec<usize>,
    slabs: Vec<Slab>,
}

impl Scratch {
    /// Projects `objects` and lists their splats for every row of tiles, in depth order.
    pub(crate) fn list_splats<L: Lens>(&mut self, objects: &[PosedCloud], lens: &L, job: &Job) {
        project_all(objects, lens, job, self);
        sort_by_depth(job, self);
        bin_into_rows(job, self);
    }

    /// Where records are, chunk by chunk.
    fn slots(&self) -> impl Iterator<Item = usize> + '_ {
        let groups = self.groups.iter().enumerate();
        groups.flat_map(|(place, group)| place * CHUNK..place * CHUNK + group.count)
    }

    /// Colours an object's splats (1, depth, 0) and the others (0, 0, depth): blended, they give the
    /// object's share of each pixel, and its summed depth beside that of the rest.
    fn mark(&mut self, object: u32) {
        for (place, group) in self.groups.iter().enumerate() {
            for record in &mut self.records[place * CHUNK..place * CHUNK + group.count] {
                record.colour = if record.object == object {
                    [1.0, record.depth, 0.0]
                } else {
                    [0.0, 0.0, record.depth]
                };
            }
        }
    }

    /// Fills the lists of one row of tiles.
    pub(crate) fn fill_row(&self, row: usize, job: &Job, lists: &mut TileRow) {
        let entries = self.slabs.iter().map(|slab| slab.row(row));
        job.simd.run(
            #[inline(always)]
            || lists.fill(row, job.view.width.div_ceil(TILE), entries, &self.records),
        );
    }

    /// How many splats touch a row of tiles.
    fn splats_of_row(&self, row: usize) -> usize {
        self.slabs.iter().map(|slab| slab.row(row).len()).sum()
    }

    /// The slabs, to be filled, and what they are filled from.
    fn slabs(&mut self) -> (&mut [Slab], slab::Projected<'_>) {
        let splats = slab::Projected {
            groups: &self.groups,
            records: &self.records,
            keys: &self.keys,
            boxes: &self.boxes,
        };
        (&mut self.slabs, splats)
    }
}

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

/// Fills records, keys, boxes and needles, chunk by chunk in scene order.
pub(crate) fn project_all<L: Lens>(
    objects: &[PosedCloud],
    lens: &L,
    job: &Job,
    scratch: &mut Scratch,
) {
    let seen: Vec<(&PosedCloud, usize)> = objects
        .iter()
        .flat_map(|posed| {
            let chunks = posed.cloud.chunks.iter().enumerate();
            chunks.filter_map(move |(index, chunk)| {
                let centre = posed.to_camera(chunk.centre);
                let group = Group {
                    centre,
                    radius: chunk.radius,
                    max_scale: chunk.max_scale,
                    near: job.view.near,
                };
                let window = &job.scope.window;
                (lens.can_see(&group, window)
                    || wide::can_see_wide(lens, &group, job.view.exact_above, window))
                .then_some((posed, index))
            })
        })
        .collect();
    let size = seen.len() * CHUNK;
    if scratch.records.len() < size {
        scratch.records.resize(size, Record::default());
        scratch.keys.resize(size, 0);
        scratch.boxes.resize(size, TileBox::default());
        scratch.needles.resize(size, Needle::default());
    }
    scratch.chunks.clear();
    scratch.chunks.extend(seen.iter().map(|&(_, chunk)| chunk));
    scratch.groups.clear();
    scratch.groups.resize(seen.len(), slab::Group::default());
    (
        &mut scratch.groups,
        scratch.records[..size].par_chunks_mut(CHUNK),
        scratch.keys[..size].par_chunks_mut(CHUNK),
        scratch.boxes[..size].par_chunks_mut(CHUNK),
        scratch.needles[..size].par_chunks_mut(CHUNK),
        &seen,
    )
        .into_par_iter()
        .for_each(|(group, records, keys, boxes, needles, &(posed, chunk))| {
            let mut slots = Slots {
                records,
                keys,
                boxes,
                needles,
            };
            *group = job.simd.run(
                #[inline(always)]
                || {
                    let count = project_chunk(posed, lens, &job.view, job.scope, chunk, &mut slots);
                    slab::Group::new(&slots.keys[..count])
                },
            );
        });
}

/// Orders the visible splats by depth; ties by object, then by place in the cloud.
pub(crate) fn sort_by_depth(job: &Job, scratch: &mut Scratch) {
    let ranges = slab::cut(&scratch.groups, rayon::current_num_threads());
    scratch.slabs.resize_with(ranges.len(), Slab::default);
    let (slabs, splats) = scratch.slabs();
    (slabs, &ranges)
        .into_par_iter()
        .with_max_len(1)
        .for_each(|(slab, range)| {
            job.simd.run(
                #[inline(always)]
                || slab.sort(range, &splats),
            );
        });
}

/// Lists the splats of every row of tiles, in depth order.
pub(crate) fn bin_into_rows(job: &Job, scratch: &mut Scratch) {
    let rows_of_tiles = job.view.height.div_ceil(TILE);
    let (slabs, splats) = scratch.slabs();
    slabs.par_iter_mut().with_max_len(1).for_each(|slab| {
        job.simd.run(
            #[inline(always)]
            || slab.bin(rows_of_tiles, &splats),
        );
    });
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
        return job.simd.blend_tile::<TRACK_OBJECTS>(tile, work);
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
            true => job.simd.run_lanes(TouchedBlocks(&wide)),
            false => 0,
        };
        // What misses the tile does not part the others.
        if blocks == 0 {
            continue;
        }
        if !run.is_empty() {
            let slots = &run;
            job.simd
                .blend_tile::<TRACK_OBJECTS>(tile, &TileWork { slots, ..*work });
            run.clear();
            if tile.is_closed() {
                return;
            }
        }
        job.simd.run_lanes(WideBlend::<TRACK_OBJECTS> {
            tile,
            wide: &wide,
            record: &work.records[*slot as usize],
            blocks,
        });
    }
    let slots = &run;
    job.simd
        .blend_tile::<TRACK_OBJECTS>(tile, &TileWork { slots, ..*work });
}
