//! Gauss-Newton normal equations of one object's pose, by exact derivatives in forward mode.
//!
//! While a pixel is blended its transmittance T and grey G carry their derivatives along:
//! with dw = alpha · dT + w · d ln(alpha), T' = T - w and dT' = dT - dw, dG += dw · grey + w · dgrey.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use crate::backward::settle;
use crate::bin::{TileRow, TILE};
use crate::blend::{
    Tile, TileSplat, TileWork, ALPHA_MAX, BLOCKS, BLOCK_PIXELS, BLOCK_WIDTH, TRANSMITTANCE_STOP,
};
use crate::curvature::Curved;
use crate::ewa::ExactJudge;
use crate::lanes::{alpha_of, mask_of, pixels_of, power_at, whitened, Block, LaneWork, Lanes};
use crate::pose_motion::{fill_chunk, Change, Directions, Motion};
use crate::project::{PosedCloud, STEP_DOUBT};
use crate::render::{self, Job, Scratch};
use crate::scene::CHUNK;
use crate::tape::open_pixels;

/// Unknowns at most: six of the pose, gain and bias.
pub const MAX_UNKNOWNS: usize = 8;
/// Entries of the upper triangle of the normal matrix.
pub const MAX_PAIRS: usize = MAX_UNKNOWNS * (MAX_UNKNOWNS + 1) / 2;
/// Splats listed at a time.
const BATCH: usize = 64;
/// Splats whose motions are asked for before they are needed.
const AHEAD: usize = 6;
/// Splats blended into a block between two looks at whether it still takes light.
const RUN: usize = 8;

/// What the drawn object is compared with; row-major pictures of one size.
pub struct Target<'a> {
    pub grey: &'a [f32],
    pub grey_weight: &'a [f32],
    /// Grey seen where the object lets light through.
    pub background: &'a [f32],
    pub silhouette: &'a [f32],
    pub silhouette_weight: &'a [f32],
    /// Splats further than this are hidden.
    pub occluder: &'a [f32],
    /// Object's grey in the picture = gain · drawn grey + bias · alpha.
    pub gain: f32,
    pub bias: f32,
}

/// Sums over the picture. Unknowns: the degrees of freedom in order, then gain and bias.
#[derive(Clone, Debug)]
pub struct NormalSums {
    /// JᵀJ, upper triangle row by row.
    pub pairs: [f64; MAX_PAIRS],
    pub gradient: [f64; MAX_UNKNOWNS],
    /// Weighted squares of the grey and of the silhouette residuals.
    pub squares: [f64; 2],
}

impl NormalSums {
    const ZERO: NormalSums = NormalSums {
        pairs: [0.0; MAX_PAIRS],
        gradient: [0.0; MAX_UNKNOWNS],
        squares: [0.0; 2],
    };

    fn add(&mut self, other: &NormalSums) {
        let to = self.pairs.iter_mut().chain(&mut self.gradient);
        let to = to.chain(&mut self.squares);
        let from = other.pairs.iter().chain(&other.gradient);
        for (to, from) in to.zip(from.chain(&other.squares)) {
            *to += from;
        }
    }
}

/// Drawn grey (over black) and alpha, row-major.
pub struct Drawn<'a> {
    pub grey: &'a mut [f32],
    pub alpha: &'a mut [f32],
}

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
            render::project_all(objects, lens, job, &mut buffers.scratch);
            fill_motions(object, lens, job, directions, &mut buffers);
            render::sort_by_depth(&mut buffers.scratch);
            render::bin_into_rows(job, &mut buffers.scratch);
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
    let size = scratch.counts.len() * CHUNK;
    if motions.len() < size {
        motions.resize(size, Motion::default());
    }
    (
        motions[..size].par_chunks_mut(CHUNK),
        scratch.records[..size].par_chunks(CHUNK),
        &scratch.counts,
        &scratch.chunks,
    )
        .into_par_iter()
        .for_each(|(motions, records, &count, &chunk)| {
            job.simd.run_lanes(FillChunk {
                object,
                lens,
                job,
                directions,
                chunk,
                records: &records[..count],
                motions,
            });
        });
}

struct FillChunk<'a, L, const D: usize> {
    object: &'a PosedCloud<'a>,
    lens: &'a L,
    job: &'a Job<'a>,
    directions: &'a Directions<D>,
    chunk: usize,
    records: &'a [crate::project::Record],
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
    let (width, height) = (job.view.width, job.view.height);
    let scratch = &buffers.scratch;
    let rows_per_band = height.div_ceil(TILE).div_ceil(scratch.bands.len());
    let columns = width.div_ceil(TILE);
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
        .map_init(
            || (TileRow::default(), Workspace::new()),
            |(lists, workspace), (row, (grey, alpha))| {
                let entries = scratch.bands[row / rows_per_band].row(row);
                job.simd.run(
                    #[inline(always)]
                    || lists.fill(row, columns, entries, &scratch.records),
                );
                let mut sums = NormalSums::ZERO;
                for column in 0..columns {
                    let (left, top) = (column * TILE, row * TILE);
                    workspace.open(lens, target, job, left, top);
                    let tile = PoseTile {
                        work: TileWork {
                            records: &scratch.records,
                            needles: &scratch.needles,
                            slots: lists.tile(column),
                            left: left as i32,
                            top: top as i32,
                            judge: &judge,
                        },
                        motions: &buffers.motions,
                        workspace,
                        target,
                    };
                    sums.add(&if job.view.antialias {
                        job.simd.run_lanes(PoseKernel::<D, true>(tile))
                    } else {
                        job.simd.run_lanes(PoseKernel::<D, false>(tile))
                    });
                    write_tile(workspace, left, width, grey, alpha);
                }
                sums
            },
        )
        .collect();
    let mut total = NormalSums::ZERO;
    for row in &rows {
        total.add(row);
    }
    total
}

fn write_tile<const D: usize>(
    workspace: &Workspace<D>,
    left: usize,
    width: usize,
    grey: &mut [f32],
    alpha: &mut [f32],
) {
    for y in 0..grey.len() / width {
        for x in 0..TILE.min(width - left) {
            let (block, lane) = Tile::place(x, y);
            if workspace.touched >> block & 1 == 1 {
                let state = &workspace.states[block];
                grey[y * width + left + x] = state.grey[lane];
                alpha[y * width + left + x] =
                    workspace.open[block][lane] - state.transmittance[lane];
            }
        }
    }
}

/// What the eight pixels of a block have gathered, and how it changes.
#[derive(Clone, Copy)]
struct State<const D: usize> {
    transmittance: Block,
    grey: Block,
    d_transmittance: [Block; D],
    d_grey: [Block; D],
}

/// The target's pixels of one block; weights are 0 outside the picture and the lens.
#[derive(Clone, Copy)]
struct TargetBlock {
    grey: Block,
    grey_weight: Block,
    background: Block,
    silhouette: Block,
    silhouette_weight: Block,
    occluder: Block,
}

/// Working memory of one tile.
struct Workspace<const D: usize> {
    states: [State<D>; BLOCKS],
    /// One bit per block that a splat may have touched: the others' states mean nothing.
    touched: u32,
    open: [Block; BLOCKS],
    target: [TargetBlock; BLOCKS],
    splats: [TileSplat; BATCH],
    lists: [[u8; BATCH]; BLOCKS],
    lengths: [usize; BLOCKS],
}

impl<const D: usize> Workspace<D> {
    const EMPTY: State<D> = State {
        transmittance: [1.0; BLOCK_PIXELS],
        grey: [0.0; BLOCK_PIXELS],
        d_transmittance: [[0.0; BLOCK_PIXELS]; D],
        d_grey: [[0.0; BLOCK_PIXELS]; D],
    };
    const BLANK: TargetBlock = TargetBlock {
        grey: [0.0; BLOCK_PIXELS],
        grey_weight: [0.0; BLOCK_PIXELS],
        background: [0.0; BLOCK_PIXELS],
        silhouette: [0.0; BLOCK_PIXELS],
        silhouette_weight: [0.0; BLOCK_PIXELS],
        occluder: [0.0; BLOCK_PIXELS],
    };

    fn new() -> Box<Workspace<D>> {
        Box::new(Workspace {
            states: [Self::EMPTY; BLOCKS],
            touched: 0,
            open: [[1.0; BLOCK_PIXELS]; BLOCKS],
            target: [Self::BLANK; BLOCKS],
            splats: [TileSplat::default(); BATCH],
            lists: [[0; BATCH]; BLOCKS],
            lengths: [0; BLOCKS],
        })
    }

    /// One bit per block that still takes light.
    fn live(&self) -> u32 {
        let mut live = 0;
        for block in 0..BLOCKS {
            let transmittance = if self.touched >> block & 1 == 1 {
                &self.states[block].transmittance
            } else {
                &self.open[block]
            };
            let is_live = transmittance.iter().any(|&t| t >= TRANSMITTANCE_STOP);
            live |= u32::from(is_live) << block;
        }
        live
    }

    /// Empties those of the blocks that are touched for the first time.
    #[inline(always)]
    fn touch(&mut self, blocks: u32) {
        let mut fresh = blocks & !self.touched;
        self.touched |= blocks;
        while fresh != 0 {
            let block = fresh.trailing_zeros() as usize % BLOCKS;
            fresh &= fresh - 1;
            self.states[block] = Self::EMPTY;
            self.states[block].transmittance = self.open[block];
        }
    }

    /// Empties the tile and takes in its pixels of the target.
    fn open<L: Curved>(&mut self, lens: &L, target: &Target, job: &Job, left: usize, top: usize) {
        self.open = open_pixels(lens, left, top);
        self.touched = 0;
        let (width, height) = (job.view.width, job.view.height);
        let (columns, rows) = (TILE.min(width - left), TILE.min(height - top));
        if columns < TILE || rows < TILE {
            self.target = [Self::BLANK; BLOCKS];
        }
        for y in 0..rows {
            let first = (top + y) * width + left;
            let row = first..first + columns;
            let pixels = &mut self.target;
            spread(pixels, y, &target.grey[row.clone()], |block| {
                &mut block.grey
            });
            spread(pixels, y, &target.grey_weight[row.clone()], |block| {
                &mut block.grey_weight
            });
            spread(pixels, y, &target.background[row.clone()], |block| {
                &mut block.background
            });
            spread(pixels, y, &target.silhouette[row.clone()], |block| {
                &mut block.silhouette
            });
            spread(pixels, y, &target.silhouette_weight[row.clone()], |block| {
                &mut block.silhouette_weight
            });
            spread(pixels, y, &target.occluder[row], |block| {
                &mut block.occluder
            });
        }
    }
}

/// Copies a row of a picture's pixels into a tile's blocks.
#[inline(always)]
fn spread(
    blocks: &mut [TargetBlock; BLOCKS],
    y: usize,
    row: &[f32],
    field: impl Fn(&mut TargetBlock) -> &mut Block,
) {
    for (part, values) in row.chunks(BLOCK_WIDTH).enumerate() {
        let (block, lane) = Tile::place(part * BLOCK_WIDTH, y);
        let to = &mut field(&mut blocks[block])[lane..lane + values.len()];
        // Whole parts by a copy of known size, which is one instruction.
        match (
            <&mut [f32; BLOCK_WIDTH]>::try_from(&mut *to),
            values.try_into(),
        ) {
            (Ok(to), Ok(values)) => *to = values,
            _ => to.copy_from_slice(values),
        }
    }
}

/// One tile of the picture.
struct PoseTile<'a, const D: usize> {
    work: TileWork<'a>,
    motions: &'a [Motion<D>],
    workspace: &'a mut Workspace<D>,
    target: &'a Target<'a>,
}

/// `ANTIALIAS`: opacities change with the pose too.
struct PoseKernel<'a, const D: usize, const ANTIALIAS: bool>(PoseTile<'a, D>);

impl<const D: usize, const ANTIALIAS: bool> LaneWork for PoseKernel<'_, D, ANTIALIAS> {
    type Output = NormalSums;

    #[inline(always)]
    fn run<V: Lanes>(self) -> NormalSums {
        let tile = self.0;
        let workspace = tile.workspace;
        for slots in tile.work.slots.chunks(BATCH) {
            let live = workspace.live();
            if live == 0 {
                break;
            }
            workspace.lengths = [0; BLOCKS];
            for (place, &slot) in slots.iter().enumerate() {
                if let Some(&soon) = slots.get(place + AHEAD) {
                    V::prefetch(&tile.motions[soon as usize]);
                }
                let splat = TileSplat::new(&tile.work, slot);
                let mut left = V::block_mask(&splat) & live;
                if left == 0 {
                    continue;
                }
                workspace.splats[place] = splat;
                workspace.touch(left);
                while left != 0 {
                    let block = left.trailing_zeros() as usize % BLOCKS;
                    left &= left - 1;
                    let length = &mut workspace.lengths[block];
                    workspace.lists[block][*length % BATCH] = place as u8;
                    *length += 1;
                }
            }
            for block in 0..BLOCKS {
                let list = &workspace.lists[block][..workspace.lengths[block]];
                if list.is_empty() {
                    continue;
                }
                let batch = Batch {
                    splats: &workspace.splats,
                    motions: tile.motions,
                    slots,
                    work: &tile.work,
                };
                let occluder = V::load(&workspace.target[block].occluder);
                let state = &mut workspace.states[block];
                blend_block::<V, D, ANTIALIAS>(state, block, list, &batch, occluder);
            }
        }
        sum_pixels::<V, D>(workspace, tile.target)
    }
}

struct Batch<'a, const D: usize> {
    splats: &'a [TileSplat; BATCH],
    motions: &'a [Motion<D>],
    slots: &'a [u32],
    work: &'a TileWork<'a>,
}

#[inline(always)]
fn blend_block<V: Lanes, const D: usize, const ANTIALIAS: bool>(
    state: &mut State<D>,
    block: usize,
    list: &[u8],
    batch: &Batch<D>,
    occluder: V,
) {
    let (x, y) = pixels_of::<V>(block);
    let stop = V::all(TRANSMITTANCE_STOP);
    let limit = V::all(ALPHA_MAX);
    let mut transmittance = V::load(&state.transmittance);
    let mut grey = V::load(&state.grey);
    let mut d_transmittance = [grey; D];
    let mut d_grey = [grey; D];
    for k in 0..D {
        d_transmittance[k] = V::load(&state.d_transmittance[k]);
        d_grey[k] = V::load(&state.d_grey[k]);
    }
    for run in list.chunks(RUN) {
        for &place in run {
            let place = place as usize % BATCH;
            let splat = &batch.splats[place];
            let motion = &batch.motions[batch.slots[place] as usize];
            let (u, v) = whitened(splat, x, y);
            let power = power_at(splat, u, v);
            let mut is_drawn = power.at_least(V::all(0.0));
            let doubtful = !power.abs().at_least(V::all(STEP_DOUBT)).bits() & 0xff;
            if doubtful != 0 {
                let slot = batch.slots[place];
                is_drawn = mask_of(settle(batch.work, slot, block, is_drawn.bits(), doubtful));
            }
            let is_drawn = is_drawn.and(transmittance.at_least(stop));
            let is_drawn = is_drawn.and(occluder.at_least(V::all(splat.depth)));
            let alpha = alpha_of(power).min(limit).and(is_drawn);
            let weight = alpha.mul(transmittance);
            // At its limit alpha does not follow the splat.
            let free = weight.sub(weight.and(alpha.at_least(limit)));
            let (by_u, by_v) = (free.mul(u), free.mul(v));
            let terms = [by_u, by_v, by_u.mul(u), by_u.mul(v), by_v.mul(v)];
            let value = V::all(motion.grey);
            for k in 0..D {
                let Change {
                    quadratic,
                    constant,
                    grey: d_value,
                } = &motion.changes[k];
                // What depends on the splat before is added last: the next one waits for it.
                let mut d_weight = terms[0].mul(V::all(quadratic[0]));
                for term in 1..5 {
                    d_weight = terms[term].mul_add(V::all(quadratic[term]), d_weight);
                }
                if ANTIALIAS {
                    d_weight = free.mul_add(V::all(*constant), d_weight);
                }
                d_weight = alpha.mul_add(d_transmittance[k], d_weight);
                d_transmittance[k] = d_transmittance[k].sub(d_weight);
                d_grey[k] = d_weight.mul_add(value, d_grey[k]);
                d_grey[k] = weight.mul_add(V::all(*d_value), d_grey[k]);
            }
            grey = weight.mul_add(value, grey);
            transmittance = alpha.mul_sub_from(transmittance, transmittance);
        }
        if transmittance.at_least(stop).bits() == 0 {
            break;
        }
    }
    transmittance.store(&mut state.transmittance);
    grey.store(&mut state.grey);
    for k in 0..D {
        d_transmittance[k].store(&mut state.d_transmittance[k]);
        d_grey[k].store(&mut state.d_grey[k]);
    }
}

/// Residuals of a finished tile and their normal equations.
#[inline(always)]
fn sum_pixels<V: Lanes, const D: usize>(workspace: &Workspace<D>, target: &Target) -> NormalSums {
    let zero = V::all(0.0);
    let mut pairs = [zero; MAX_PAIRS];
    let mut gradient = [zero; MAX_UNKNOWNS];
    let mut squares = [zero; 2];
    let (gain, bias) = (V::all(target.gain), V::all(target.bias));
    for block in 0..BLOCKS {
        let pixels = &workspace.target[block];
        let state = &workspace.states[block];
        let open = V::load(&workspace.open[block]);
        if workspace.touched >> block & 1 == 0 {
            // Nothing drawn: constant residuals.
            let bare = V::load(&pixels.background).sub(V::load(&pixels.grey));
            let weight = V::load(&pixels.grey_weight).mul(open);
            squares[0] = weight.mul(bare).mul_add(bare, squares[0]);
            let outline = V::load(&pixels.silhouette);
            let weight = V::load(&pixels.silhouette_weight).mul(open);
            squares[1] = weight.mul(outline).mul_add(outline, squares[1]);
            continue;
        }
        let alpha = open.sub(V::load(&state.transmittance));
        let grey = V::load(&state.grey);
        let background = V::load(&pixels.background);
        let weight = V::load(&pixels.grey_weight).mul(open);
        // gain · grey + bias · alpha + (1 - alpha) · background - target
        let lift = bias.sub(background);
        let over = background.sub(V::load(&pixels.grey));
        let residual = gain.mul_add(grey, lift.mul_add(alpha, over));
        let outline_weight = V::load(&pixels.silhouette_weight).mul(open);
        let outline = alpha.sub(V::load(&pixels.silhouette));

        let mut slopes = [zero; MAX_UNKNOWNS];
        let mut outline_slopes = [zero; D];
        for k in 0..D {
            let d_alpha = zero.sub(V::load(&state.d_transmittance[k]));
            slopes[k] = gain.mul_add(V::load(&state.d_grey[k]), lift.mul(d_alpha));
            outline_slopes[k] = d_alpha;
        }
        slopes[D] = grey;
        slopes[D + 1] = alpha;
        let mut weighted = slopes;
        let mut outline_weighted = outline_slopes;
        for k in 0..D + 2 {
            weighted[k] = slopes[k].mul(weight);
        }
        for k in 0..D {
            outline_weighted[k] = outline_slopes[k].mul(outline_weight);
        }
        let mut place = 0;
        for i in 0..D + 2 {
            for j in i..D + 2 {
                let mut sum = weighted[i].mul_add(slopes[j], pairs[place]);
                if j < D {
                    sum = outline_weighted[i].mul_add(outline_slopes[j], sum);
                }
                pairs[place] = sum;
                place += 1;
            }
            gradient[i] = weighted[i].mul_add(residual, gradient[i]);
            if i < D {
                gradient[i] = outline_weighted[i].mul_add(outline, gradient[i]);
            }
        }
        squares[0] = weight.mul(residual).mul_add(residual, squares[0]);
        squares[1] = outline_weight.mul(outline).mul_add(outline, squares[1]);
    }
    let mut sums = NormalSums::ZERO;
    for (sum, value) in sums.squares.iter_mut().zip(squares) {
        *sum = total(value);
    }
    if workspace.touched == 0 {
        return sums;
    }
    for (sum, pair) in sums.pairs.iter_mut().zip(pairs) {
        *sum = total(pair);
    }
    for (sum, value) in sums.gradient.iter_mut().zip(gradient) {
        *sum = total(value);
    }
    sums
}

/// Sum over the lanes.
#[inline(always)]
fn total<V: Lanes>(value: V) -> f64 {
    let mut lanes = [0.0; BLOCK_PIXELS];
    value.store(&mut lanes);
    lanes.iter().map(|&v| f64::from(v)).sum()
}
