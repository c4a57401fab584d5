//! Gauss-Newton normal equations of one object's pose, by exact derivatives in forward mode.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::camera::curvature::Curved;
use crate::lanes::dispatch::{run_lanes, run_patches};
use crate::lanes::patch::{LaneWork, Lanes};
use crate::order::bin::TileRow;
use crate::pose::motion::{fill_chunk, Directions, Motion};
use crate::pose::sums::{NormalSums, Target};
use crate::pose::tile::{Drawn, PoseRow, RowWork};
use crate::project::judge::ExactJudge;
use crate::project::posed::PosedCloud;
use crate::project::tile_box::TILE;
use crate::render::job::Job;
use crate::render::scratch::{bin_into_rows, project_all, sort_by_depth, Scratch};
use crate::render::tile::ClosedPixels;
use crate::scene::cloud::CHUNK;

/// Buffers kept between calls; their contents mean nothing.
#[derive(Default)]
struct Buffers<const D: usize> {
    scratch: Scratch,
    motions: Vec<Motion<D>>,
}

/// Solves nothing itself: draws an object and returns what one Gauss-Newton step needs.
#[derive(Default)]
pub struct PoseEngine<const D: usize> {
    idle: Mutex<Vec<Buffers<D>>>,
}

impl<const D: usize> PoseEngine<D> {
    /// The same to the bit for any number of threads.
    pub fn normal_sums<L: Curved>(
        &self,
        object: &PosedCloud,
        lens: &L,
        job: &Job,
        directions: &Directions<D>,
        target: &Target,
        drawn: &mut Drawn,
    ) -> NormalSums {
        let mut buffers = {
            let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
            idle.pop().unwrap_or_default()
        };
        let sums = job.pool.install(|| {
            let objects = std::slice::from_ref(object);
            project_all(objects, lens, job, &mut buffers.scratch);
            fill_motions(object, lens, job, directions, &mut buffers);
            sort_by_depth(job, &mut buffers.scratch);
            bin_into_rows(job, &mut buffers.scratch);
            sum_tiles(objects, lens, job, &buffers, target, drawn)
        });
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.push(buffers);
        sums
    }
}

fn fill_motions<L: Curved, const D: usize>(
    object: &PosedCloud,
    lens: &L,
    job: &Job,
    directions: &Directions<D>,
    buffers: &mut Buffers<D>,
) {
    let Buffers { scratch, motions } = buffers;
    let size = scratch.groups.len() * CHUNK;
    if motions.len() < size {
        motions.resize(size, Motion::default());
    }
    (
        motions[..size].par_chunks_mut(CHUNK),
        scratch.records[..size].par_chunks(CHUNK),
        &scratch.groups,
        &scratch.chunks,
    )
        .into_par_iter()
        .for_each(|(motions, records, group, &chunk)| {
            run_lanes(
                job.simd,
                FillChunk {
                    object,
                    lens,
                    job,
                    directions,
                    chunk,
                    records: &records[..group.count],
                    motions,
                },
            );
        });
}

struct FillChunk<'a, L, const D: usize> {
    object: &'a PosedCloud<'a>,
    lens: &'a L,
    job: &'a Job<'a>,
    directions: &'a Directions<D>,
    chunk: usize,
    records: &'a [crate::project::record::Record],
    motions: &'a mut [Motion<D>],
}

impl<L: Curved, const D: usize> LaneWork for FillChunk<'_, L, D> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(self) {
        fill_chunk::<V, L, D>(
            self.object,
            self.lens,
            &self.job.view,
            self.directions,
            self.chunk,
            self.records,
            self.motions,
        );
    }
}

fn sum_tiles<L: Curved, const D: usize>(
    objects: &[PosedCloud],
    lens: &L,
    job: &Job,
    buffers: &Buffers<D>,
    target: &Target,
    drawn: &mut Drawn,
) -> NormalSums {
    let width = job.view.width;
    let judge = ExactJudge {
        objects,
        lens,
        antialias: job.view.antialias,
    };
    let rows: Vec<NormalSums> = (
        drawn.grey.par_chunks_mut(width * TILE),
        drawn.alpha.par_chunks_mut(width * TILE),
    )
        .into_par_iter()
        .with_max_len(1)
        .enumerate()
        .map_init(TileRow::default, |lists, (row, (grey, alpha))| {
            buffers.scratch.fill_row(row, job, lists);
            let top = row * TILE;
            let circles: Vec<ClosedPixels> = (0..width.div_ceil(TILE))
                .map(|column| ClosedPixels::new(lens, &job.scope.window, column * TILE, top))
                .collect();
            let work = RowWork {
                records: &buffers.scratch.records,
                needles: &buffers.scratch.needles,
                motions: &buffers.motions,
                judge: &judge,
                lists,
                circles: &circles,
                target: target.strip(width, top, grey.len() / width),
                width,
                top,
                drawn: Drawn { grey, alpha },
            };
            if job.view.antialias {
                run_patches(job.simd, PoseRow::<D, true>(work))
            } else {
                run_patches(job.simd, PoseRow::<D, false>(work))
            }
        })
        .collect();
    let mut total = NormalSums::ZERO;
    for row in &rows {
        total.add(row);
    }
    total
}
