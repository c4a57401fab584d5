//! Splats in training: rows of raw numbers with their moments, and the cloud that is drawn of them.
//!
//! A row is mean (3), ln scale (3), quaternion (4), logit of opacity (1), coefficients (3K). The
//! cloud keeps the rows' own order, whatever it is; a sorted one is drawn faster.

use rayon::prelude::*;

use crate::scene::cloud::{Block, Chunk, Cloud, Original, BLOCKS_PER_CHUNK, CHUNK, LANES};
use crate::train::adam;
use crate::train::adam::Correction;

/// Where a splat's row holds what: mean (m), ln of scales (m), quaternion, logit of opacity, harmonics.
pub const MEAN: usize = 0;
pub const LOG_SCALE: usize = 3;
pub const ROTATION: usize = 6;
pub const LOGIT: usize = 10;
pub const SH: usize = 11;

/// Largest ln of a scale (metres): inside what a scene takes.
const MAX_LOG_SCALE: f32 = 8.0;
const MIN_LOG_SCALE: f32 = -14.0;
/// Further out a splat has run away; it stays where it is.
const MAX_MEAN: f32 = 1e5;

/// Everything that training keeps of each splat, by row.
#[derive(Clone, Default)]
pub struct Rows {
    pub sh_count: usize,
    /// `count * width` each.
    pub values: Vec<f32>,
    pub first: Vec<f32>,
    pub second: Vec<f32>,
    /// Steps taken by each splat.
    pub steps: Vec<u32>,
    /// Σ over pictures of Σ over pixels of weight · error.
    pub error: Vec<f32>,
}

impl Rows {
    pub fn width(&self) -> usize {
        width_of(self.sh_count)
    }

    pub fn count(&self) -> usize {
        self.steps.len()
    }
}

pub fn width_of(sh_count: usize) -> usize {
    SH + 3 * sh_count
}

/// One chunk's share of the rows and of the cloud.
struct Share<'a> {
    values: &'a mut [f32],
    first: &'a mut [f32],
    second: &'a mut [f32],
    steps: &'a mut [u32],
    error: &'a mut [f32],
    blocks: &'a mut [Block],
    sh: &'a mut [[f32; LANES]],
    originals: &'a mut [Original],
    chunk: &'a mut Chunk,
}

/// Gradients of one group of splats: rows, each of a splat named by its place in the chunk.
#[derive(Default)]
pub struct GroupGradients {
    pub chunk: usize,
    pub places: Vec<u32>,
    /// As wide as the rows.
    pub rows: Vec<f32>,
    pub errors: Vec<f32>,
}

pub struct TrainSplats {
    pub rows: Rows,
    pub cloud: Cloud,
}

impl TrainSplats {
    pub fn new(rows: Rows) -> TrainSplats {
        let count = rows.count();
        let blocks: Vec<Block> = (0..count.div_ceil(LANES))
            .map(|block| Block {
                mean: [[0.0; LANES]; 3],
                factor: [[0.0; LANES]; 9],
                log2_opacity: [f32::NEG_INFINITY; LANES],
                max_scale: [0.0; LANES],
                index: std::array::from_fn(|lane| match block * LANES + lane {
                    place if place < count => place as u32,
                    _ => u32::MAX,
                }),
            })
            .collect();
        let nowhere = Chunk {
            centre: [0.0; 3],
            radius: 0.0,
            max_scale: 0.0,
        };
        let nothing = Original {
            mean: [0.0; 3],
            scale: [1.0; 3],
            rotation: [1.0, 0.0, 0.0, 0.0],
            opacity: 0.0,
        };
        let cloud = Cloud {
            sh: vec![[0.0; LANES]; blocks.len() * 3 * rows.sh_count],
            blocks,
            sh_count: rows.sh_count,
            chunks: vec![nowhere; count.div_ceil(CHUNK)],
            originals: vec![nothing; count],
            places: (0..count as u32).collect(),
            count,
            dropped: 0,
        };
        let mut splats = TrainSplats { rows, cloud };
        splats.for_every_chunk(|_, share| {
            for place in 0..share.steps.len() {
                share.show(place);
            }
            share.bound();
        });
        splats
    }

    /// Moves the splats of `groups`, each in a chunk of its own, by one step of Adam.
    pub fn step(&mut self, groups: &[GroupGradients], rates: &[f32]) {
        let mut group_of: Vec<Option<&GroupGradients>> = vec![None; self.cloud.chunks.len()];
        for group in groups {
            group_of[group.chunk] = Some(group);
        }
        let width = self.rows.width();
        self.for_every_chunk(|chunk, share| {
            let Some(group) = group_of[chunk] else {
                return;
            };
            let gradients = group.rows.chunks_exact(width);
            for ((&place, gradient), &error) in
                group.places.iter().zip(gradients).zip(&group.errors)
            {
                share.step(place as usize, gradient, rates, error);
            }
            share.bound();
        });
    }

    /// Runs `work` on every chunk, on all threads.
    fn for_every_chunk(&mut self, work: impl Fn(usize, &mut Share) + Sync) {
        let (rows, cloud) = (&mut self.rows, &mut self.cloud);
        let width = width_of(rows.sh_count) * CHUNK;
        (
            rows.values.par_chunks_mut(width),
            rows.first.par_chunks_mut(width),
            rows.second.par_chunks_mut(width),
            rows.steps.par_chunks_mut(CHUNK),
            rows.error.par_chunks_mut(CHUNK),
            cloud.blocks.par_chunks_mut(BLOCKS_PER_CHUNK),
            cloud
                .sh
                .par_chunks_mut(3 * rows.sh_count * BLOCKS_PER_CHUNK),
            cloud.originals.par_chunks_mut(CHUNK),
            cloud.chunks.par_iter_mut(),
        )
            .into_par_iter()
            .enumerate()
            .for_each(
                |(index, (values, first, second, steps, error, blocks, sh, originals, chunk))| {
                    let mut share = Share {
                        values,
                        first,
                        second,
                        steps,
                        error,
                        blocks,
                        sh,
                        originals,
                        chunk,
                    };
                    work(index, &mut share);
                },
            );
    }
}

impl Share<'_> {
    fn step(&mut self, place: usize, gradient: &[f32], rates: &[f32], error: f32) {
        self.error[place] += error;
        if !gradient.iter().all(|v| v.is_finite()) {
            return;
        }
        self.steps[place] += 1;
        let width = gradient.len();
        let span = place * width..(place + 1) * width;
        let values = &mut self.values[span.clone()];
        let mean: [f32; 3] = std::array::from_fn(|axis| values[axis]);
        adam::step(
            values,
            &mut self.first[span.clone()],
            &mut self.second[span],
            gradient,
            rates,
            Correction::after(self.steps[place]),
        );
        if values[..3].iter().any(|v| v.abs() > MAX_MEAN) {
            values[..3].copy_from_slice(&mean);
        }
        for scale in &mut values[LOG_SCALE..ROTATION] {
            *scale = scale.clamp(MIN_LOG_SCALE, MAX_LOG_SCALE);
        }
        self.show(place);
    }

    /// Writes a row to the cloud.
    fn show(&mut self, place: usize) {
        let width = self.values.len() / self.steps.len();
        let row = &self.values[place * width..(place + 1) * width];
        let original = Original {
            mean: std::array::from_fn(|k| row[MEAN + k]),
            scale: std::array::from_fn(|k| row[LOG_SCALE + k].exp()),
            rotation: std::array::from_fn(|k| row[ROTATION + k]),
            opacity: opacity_of(row[LOGIT]),
        };
        self.originals[place] = original;
        let (block, lane) = (&mut self.blocks[place / LANES], place % LANES);
        for (to, value) in block.mean.iter_mut().zip(original.mean) {
            to[lane] = value;
        }
        for (to, value) in block.factor.iter_mut().zip(original.factor()) {
            to[lane] = value as f32;
        }
        block.log2_opacity[lane] = original.opacity.log2();
        block.max_scale[lane] = original.scale.into_iter().fold(0.0, f32::max);
        let coefficients = width - SH;
        let to = &mut self.sh[place / LANES * coefficients..][..coefficients];
        for (to, &value) in to.iter_mut().zip(&row[SH..]) {
            to[lane] = value;
        }
    }

    /// Finds the chunk's sphere anew.
    fn bound(&mut self) {
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        let mut max_scale = 0.0f32;
        for original in &*self.originals {
            for axis in 0..3 {
                low[axis] = low[axis].min(original.mean[axis]);
                high[axis] = high[axis].max(original.mean[axis]);
                max_scale = max_scale.max(original.scale[axis]);
            }
        }
        // The box's own sphere: a little larger than needed, and found in one pass.
        let centre: [f64; 3] =
            std::array::from_fn(|k| 0.5 * (f64::from(low[k]) + f64::from(high[k])));
        let square: f64 = (0..3)
            .map(|k| (f64::from(high[k]) - centre[k]).powi(2))
            .sum();
        *self.chunk = Chunk {
            centre,
            radius: square.sqrt() * (1.0 + 1e-9),
            max_scale: f64::from(max_scale),
        };
    }
}

pub fn opacity_of(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}
