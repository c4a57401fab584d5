//! One step of training: draw, compare with the photo, go back, move the splats.

use std::time::Instant;

use rayon::prelude::*;

use crate::camera::curvature::Curved;
use crate::gradients::backward::SUMS;
use crate::gradients::projection::gradients_of_splat;
use crate::project::posed::PosedCloud;
use crate::render::engine::blend_all;
use crate::render::job::{Job, Picture};
use crate::render::scratch::Scratch;
use crate::scene::cloud::CHUNK;
use crate::train::backward::ERROR;
use crate::train::exposure::Exposure;
use crate::train::loss::{Distance, Loss};
use crate::train::splats::{GroupGradients, Rows, TrainSplats, LOGIT, LOG_SCALE, ROTATION, SH};
use crate::train::sums::TrainingSums;
use crate::train::target::Target;

/// Where the camera stands: camera from world.
#[derive(Clone, Copy)]
pub struct CameraPose {
    pub rotation: [[f64; 3]; 3],
    pub translation: [f64; 3],
}

/// How to compare.
#[derive(Clone, Copy)]
pub struct Comparison {
    pub exposure: Exposure,
    pub ssim_share: f32,
    /// Of weight off the target's depth bounds, mean over the pixels.
    pub depth_price: f32,
}

/// Splats in training and the buffers of a step.
pub struct Trainee {
    pub splats: TrainSplats,
    /// Nanoseconds spent drawing, comparing, going back through the tiles, and the rest.
    pub spent_ns: [u64; 4],
    scratch: Scratch,
    loss: Loss,
    sums: TrainingSums,
    rgb: Vec<f32>,
    plane: Vec<f32>,
    ids: Vec<i32>,
}

impl Trainee {
    pub fn new(rows: Rows) -> Trainee {
        Trainee {
            splats: TrainSplats::new(rows),
            spent_ns: [0; 4],
            scratch: Scratch::default(),
            loss: Loss::default(),
            sums: TrainingSums::default(),
            rgb: Vec::new(),
            plane: Vec::new(),
            ids: Vec::new(),
        }
    }

    /// Distance from `target`, and gradients of all splats seen; the same to the bit for any number of
    /// threads.
    pub fn gradients<L: Curved>(
        &mut self,
        pose: &CameraPose,
        lens: &L,
        job: &Job,
        target: &Target,
        comparison: &Comparison,
    ) -> (Distance, Vec<GroupGradients>) {
        let start = Instant::now();
        let objects = [PosedCloud {
            cloud: &self.splats.cloud,
            rotation: pose.rotation,
            translation: pose.translation,
            object: 0,
        }];
        let pixels = job.view.width * job.view.height;
        self.rgb.resize(3 * pixels, 0.0);
        self.plane.resize(2 * pixels, 0.0);
        self.ids.resize(pixels, 0);
        let (alpha, depth) = self.plane.split_at_mut(pixels);
        let mut picture = Picture {
            rgb: &mut self.rgb,
            alpha,
            depth,
            ids: &mut self.ids,
        };
        self.scratch.list_splats(&objects, lens, job);
        blend_all::<L, false>(&objects, lens, job, &self.scratch, &mut picture);
        let drawn = Instant::now();
        let distance = self.loss.evaluate(
            &self.rgb,
            target,
            &comparison.exposure,
            comparison.ssim_share,
            job.simd,
        );
        let compared = Instant::now();
        let records = self.scratch.groups.len() * CHUNK;
        let bounds = target.bounds.as_ref();
        let depth = bounds
            .map(|bounds| (bounds, comparison.depth_price))
            .filter(|&(_, price)| price > 0.0);
        self.sums
            .fill(lens, job, &self.scratch, records, &self.loss, depth);
        let summed = Instant::now();
        let groups = project_back(&objects[0], lens, job, &self.scratch, &self.sums);
        let done = Instant::now();
        let parts = [
            drawn - start,
            compared - drawn,
            summed - compared,
            done - summed,
        ];
        for (total, part) in self.spent_ns.iter_mut().zip(parts) {
            *total += part.as_nanos() as u64;
        }
        (distance, groups)
    }

    /// One step of Adam towards `target`, each number of a row at its own rate.
    pub fn step<L: Curved>(
        &mut self,
        pose: &CameraPose,
        lens: &L,
        job: &Job,
        target: &Target,
        comparison: &Comparison,
        rates: &[f32],
    ) -> Distance {
        let (distance, groups) = self.gradients(pose, lens, job, target, comparison);
        let start = Instant::now();
        self.splats.step(&groups, rates);
        self.spent_ns[3] += start.elapsed().as_nanos() as u64;
        distance
    }
}

/// From sums of records to gradients of rows, one group for each chunk seen.
fn project_back<L: Curved>(
    posed: &PosedCloud,
    lens: &L,
    job: &Job,
    scratch: &Scratch,
    sums: &TrainingSums,
) -> Vec<GroupGradients> {
    let sh_count = posed.cloud.sh_count;
    scratch
        .groups
        .par_iter()
        .zip(&scratch.chunks)
        .enumerate()
        .map(|(place, (group, &chunk))| {
            let mut out = GroupGradients {
                chunk,
                ..GroupGradients::default()
            };
            let slots = place * CHUNK..place * CHUNK + group.count;
            for (record, sums) in scratch.records[slots.clone()]
                .iter()
                .zip(&sums.totals[slots])
            {
                // What shows nothing (of weight, error and gradient) stays as it is.
                if sums.iter().all(|&v| v == 0.0) {
                    continue;
                }
                out.errors.push(sums[ERROR]);
                let of_picture: [f64; SUMS] = std::array::from_fn(|k| f64::from(sums[k]));
                let splat = gradients_of_splat(posed, lens, &job.view, record, &of_picture);
                let original = &posed.cloud.originals[record.index as usize];
                out.places.push(record.index - (chunk * CHUNK) as u32);
                out.rows.extend(splat.mean.map(|v| v as f32));
                out.rows.extend(
                    (0..ROTATION - LOG_SCALE).map(|k| splat.scale[k] as f32 * original.scale[k]),
                );
                out.rows.extend(splat.rotation.map(|v| v as f32));
                debug_assert_eq!(out.rows.len() % (SH + 3 * sh_count), LOGIT);
                let opacity = f64::from(original.opacity);
                out.rows
                    .push((splat.opacity * opacity * (1.0 - opacity)) as f32);
                for k in 0..sh_count {
                    let basis = if k < splat.colour.count {
                        splat.colour.basis[k]
                    } else {
                        0.0
                    };
                    out.rows
                        .extend(splat.colour.colour.map(|v| (v * basis) as f32));
                }
            }
            out
        })
        .collect()
}
