//! The pipeline before the blend: cull chunks, project, sort by depth, bin into tiles.

use rayon::prelude::*;

use crate::camera::lens::{Group, Lens};
use crate::order::bin::TileRow;
use crate::order::slab::{self, Slab};
use crate::project::chunk::{project_chunk, Slots};
use crate::project::posed::PosedCloud;
use crate::project::record::{Needle, Record};
use crate::project::tile_box::{TileBox, TILE};
use crate::project::wide;
use crate::render::job::Job;
use crate::scene::cloud::CHUNK;

/// Log2 of an opacity that shows in no pixel.
const INVISIBLE: f32 = -1e3;

/// Buffers kept between pictures; their contents mean nothing.
#[derive(Default)]
pub(crate) struct Scratch {
    pub(crate) records: Vec<Record>,
    keys: Vec<u32>,
    pub(crate) boxes: Vec<TileBox>,
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
    pub(crate) fn slots(&self) -> impl Iterator<Item = usize> + '_ {
        let groups = self.groups.iter().enumerate();
        groups.flat_map(|(place, group)| place * CHUNK..place * CHUNK + group.count)
    }

    /// Colours an object's splats (1, depth, 0) and the others (0, 0, depth): blended, they give the
    /// object's share of each pixel, and its summed depth beside that of the rest.
    pub(crate) fn mark(&mut self, object: u32) {
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

    /// Gives splats the colours that they have by their index in their cloud; those without one are
    /// drawn no more.
    pub(crate) fn recolour(&mut self, colours: &[Option<[f32; 3]>]) {
        for (place, group) in self.groups.iter().enumerate() {
            for record in &mut self.records[place * CHUNK..place * CHUNK + group.count] {
                match colours[record.index as usize] {
                    Some(colour) => record.colour = colour,
                    None => record.log2_opacity = INVISIBLE,
                }
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
    pub(crate) fn splats_of_row(&self, row: usize) -> usize {
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
