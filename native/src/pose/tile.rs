//! A row of tiles blended with derivatives carried along: what the pose engine does to a picture.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use crate::lanes::patch::{Patch, PatchWork};
use crate::lanes::vector::{alpha_of, mask_of, of_lanes, power_at, whitened};
use crate::order::bin::TileRow;
use crate::pose::frame::{corner, Frame};
use crate::pose::motion::Motion;
use crate::pose::state::{Sample, State};
use crate::pose::sums::{NormalSums, PatchSums, Target, TargetPatch};
use crate::project::judge::Judge;
use crate::project::record::{Needle, Record, STEP_DOUBT};
use crate::project::tile_box::TILE;
use crate::render::tile::ClosedPixels;
use crate::tile::batch::settle;
use crate::tile::pixels::{ALPHA_MAX, BLOCKS, BLOCK_PIXELS, BLOCK_WIDTH, TRANSMITTANCE_STOP};
use crate::tile::splat::{TileSplat, TileWork};

/// Splats listed at a time: one bit each.
const BATCH: usize = 64;
/// Splats whose records, and motions, are asked for before they are needed.
const AHEAD: usize = 12;
/// Splats whose alphas are computed together, and blended into a patch between two looks at whether
/// it still takes light.
const RUN: usize = 8;

/// Drawn grey (over black) and alpha, row-major.
pub struct Drawn<'a> {
    pub grey: &'a mut [f32],
    pub alpha: &'a mut [f32],
}

/// One row of tiles and what it takes to draw it.
pub struct RowWork<'a, const D: usize> {
    pub records: &'a [Record],
    pub needles: &'a [Needle],
    pub motions: &'a [Motion<D>],
    pub judge: &'a dyn Judge,
    /// The splats of each tile.
    pub lists: &'a TileRow,
    /// What each tile shows of the lens circle.
    pub(crate) circles: &'a [ClosedPixels],
    pub target: Target<'a>,
    pub width: usize,
    /// First row of pixels.
    pub top: usize,
    /// The row's strip of the pictures.
    pub drawn: Drawn<'a>,
}

/// `ANTIALIAS`: opacities change with the pose too.
pub struct PoseRow<'a, const D: usize, const ANTIALIAS: bool>(pub RowWork<'a, D>);

impl<const D: usize, const ANTIALIAS: bool> PatchWork for PoseRow<'_, D, ANTIALIAS> {
    type Output = NormalSums;

    #[inline(always)]
    fn run<V: Patch>(self) -> NormalSums {
        let mut row = self.0;
        let mut sums = NormalSums::ZERO;
        let mut tile = TileState::<V, D>::new();
        for column in 0..row.circles.len() {
            let left = column * TILE;
            let work = TileWork {
                records: row.records,
                needles: row.needles,
                slots: row.lists.tile(column),
                left: left as i32,
                top: row.top as i32,
                judge: row.judge,
            };
            let frame = Frame {
                width: row.width,
                left,
                columns: TILE.min(row.width - left),
                rows: row.drawn.grey.len() / row.width,
            };
            tile.open(&row.circles[column]);
            tile.blend::<ANTIALIAS>(&work, row.motions, row.target.occluder, &frame);
            sums.add(&tile.sum(&row.target, &frame));
            tile.write(&frame, &mut row.drawn);
        }
        sums
    }
}

/// Working memory of one tile.
struct TileState<V, const D: usize> {
    states: [State<V, D>; BLOCKS],
    /// One bit per patch that a splat may have touched.
    touched: u32,
    /// One bit per patch that still takes light.
    live: u32,
    splats: [TileSplat; BATCH],
    samples: [Sample<V>; RUN],
}

impl<V: Patch, const D: usize> TileState<V, D> {
    const PATCHES: usize = TILE * TILE / V::LANES;

    fn new() -> Box<Self> {
        let zero = V::all(0.0);
        Box::new(TileState {
            states: [State {
                open: zero,
                transmittance: zero,
                grey: zero,
                d_transmittance: [zero; D],
                d_grey: [zero; D],
            }; BLOCKS],
            touched: 0,
            live: 0,
            splats: [TileSplat::default(); BATCH],
            samples: [Sample {
                alpha: zero,
                free: zero,
                u: zero,
                v: zero,
            }; RUN],
        })
    }

    /// Empties the tile.
    #[inline(always)]
    fn open(&mut self, circle: &ClosedPixels) {
        let zero = V::all(0.0);
        self.touched = 0;
        self.live = 0;
        for patch in 0..Self::PATCHES {
            let mut open = V::all(1.0);
            if let Some(outside) = &circle.outside {
                let [x, y] = corner::<V>(patch);
                open = of_lanes(|lane| {
                    let (x, y) = (x + lane % BLOCK_WIDTH, y + lane / BLOCK_WIDTH);
                    f32::from(u8::from(!outside[y * TILE + x]))
                });
            }
            self.states[patch] = State {
                open,
                transmittance: open,
                grey: zero,
                d_transmittance: [zero; D],
                d_grey: [zero; D],
            };
            let takes_light = open.at_least(V::all(TRANSMITTANCE_STOP)).bits() != 0;
            self.live |= u32::from(takes_light) << patch;
        }
    }

    #[inline(always)]
    fn blend<const ANTIALIAS: bool>(
        &mut self,
        work: &TileWork,
        motions: &[Motion<D>],
        occluder: &[f32],
        frame: &Frame,
    ) {
        for slots in work.slots.chunks(BATCH) {
            if self.live == 0 {
                return;
            }
            let members = self.list(work, slots, motions);
            for patch in 0..Self::PATCHES {
                if members[patch] != 0 {
                    let batch = Batch {
                        motions,
                        slots,
                        work,
                        patch,
                        members: members[patch],
                        occluder: frame.patch_of(occluder, patch),
                    };
                    self.blend_patch::<ANTIALIAS>(batch);
                }
            }
        }
    }

    /// Takes in a batch of splats; one word per patch, one bit per splat that touches it.
    #[inline(always)]
    fn list(&mut self, work: &TileWork, slots: &[u32], motions: &[Motion<D>]) -> [u64; BLOCKS] {
        let mut masks = [[0u8; BATCH]; BLOCKS / 8];
        for (place, &slot) in slots.iter().enumerate() {
            if let Some(&soon) = slots.get(place + AHEAD) {
                V::prefetch(&work.records[soon as usize]);
            }
            let splat = TileSplat::new(work, slot);
            let mask = V::patch_mask(&splat) & self.live;
            if mask != 0 {
                V::prefetch(&motions[slot as usize]);
            }
            for byte in 0..Self::PATCHES / 8 {
                masks[byte][place] = (mask >> (8 * byte)) as u8;
            }
            self.splats[place] = splat;
            self.touched |= mask;
        }
        let mut members = [0; BLOCKS];
        for byte in 0..Self::PATCHES / 8 {
            members[8 * byte..8 * byte + 8].copy_from_slice(&V::transposed(&masks[byte]));
        }
        members
    }

    #[inline(always)]
    fn blend_patch<const ANTIALIAS: bool>(&mut self, mut batch: Batch<V, D>) {
        let [left, top] = corner::<V>(batch.patch);
        let x: V = of_lanes(|lane| (left + lane % BLOCK_WIDTH) as f32);
        let y: V = of_lanes(|lane| (top + lane / BLOCK_WIDTH) as f32);
        let stop = V::all(TRANSMITTANCE_STOP);
        let mut state = self.states[batch.patch];
        while batch.members != 0 {
            // Alphas do not wait for the splats before: the machine works on several at a time.
            let run = batch.members;
            let mut count = 0;
            while batch.members != 0 && count < RUN {
                let place = batch.members.trailing_zeros() as usize % BATCH;
                batch.members &= batch.members - 1;
                self.samples[count] = batch.sample(&self.splats[place], place, x, y);
                count += 1;
            }
            let mut left = run;
            for sample in &self.samples[..count] {
                let place = left.trailing_zeros() as usize % BATCH;
                left &= left - 1;
                let motion = &batch.motions[batch.slots[place] as usize];
                state.blend::<ANTIALIAS>(sample, motion);
            }
            if state.transmittance.at_least(stop).bits() == 0 {
                self.live &= !(1 << batch.patch);
                break;
            }
        }
        self.states[batch.patch] = state;
    }

    #[inline(always)]
    fn sum(&self, target: &Target, frame: &Frame) -> NormalSums {
        let mut sums = PatchSums::<V, D>::new(target.gain, target.bias);
        for patch in 0..Self::PATCHES {
            let pixels = TargetPatch {
                grey: frame.patch_of(target.grey, patch),
                grey_weight: frame.patch_of(target.grey_weight, patch),
                background: frame.patch_of(target.background, patch),
                silhouette: frame.patch_of(target.silhouette, patch),
                silhouette_weight: frame.patch_of(target.silhouette_weight, patch),
            };
            if self.touched >> patch & 1 == 1 {
                sums.add_drawn(&self.states[patch], &pixels);
            } else {
                sums.add_bare(self.states[patch].open, &pixels);
            }
        }
        sums.finish(self.touched != 0)
    }

    #[inline(always)]
    fn write(&self, frame: &Frame, drawn: &mut Drawn) {
        for patch in 0..Self::PATCHES {
            if self.touched >> patch & 1 == 1 {
                let state = &self.states[patch];
                frame.put(drawn.grey, patch, state.grey);
                frame.put(drawn.alpha, patch, state.open.sub(state.transmittance));
            }
        }
    }
}

/// The splats that touch a patch.
struct Batch<'a, V, const D: usize> {
    motions: &'a [Motion<D>],
    slots: &'a [u32],
    work: &'a TileWork<'a>,
    patch: usize,
    members: u64,
    occluder: V,
}

impl<V: Patch, const D: usize> Batch<'_, V, D> {
    #[inline(always)]
    fn sample(&self, splat: &TileSplat, place: usize, x: V, y: V) -> Sample<V> {
        let limit = V::all(ALPHA_MAX);
        let (u, v) = whitened(splat, x, y);
        let power = power_at(splat, u, v);
        let mut is_drawn = power.at_least(V::all(0.0));
        let is_sure = power.abs().at_least(V::all(STEP_DOUBT)).bits();
        let doubtful = !is_sure & ((1u64 << V::LANES) - 1) as u32;
        if doubtful != 0 {
            let verdict = self.settle(self.slots[place], is_drawn.bits(), doubtful);
            is_drawn = mask_of(verdict);
        }
        let is_drawn = is_drawn.and(self.occluder.at_least(V::all(splat.depth)));
        let alpha = alpha_of(power).min(limit).and(is_drawn);
        Sample {
            alpha,
            free: alpha.sub(alpha.and(alpha.at_least(limit))),
            u,
            v,
        }
    }

    /// Takes the lanes of `doubtful` (one bit each) to the judge; the others keep their verdict.
    #[cold]
    #[inline(never)]
    fn settle(&self, slot: u32, verdict: u32, doubtful: u32) -> u32 {
        match V::LANES {
            16 => settle::<16>(self.work, slot, self.patch, verdict, doubtful),
            _ => settle::<BLOCK_PIXELS>(self.work, slot, self.patch, verdict, doubtful),
        }
    }
}
