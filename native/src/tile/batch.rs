//! A tile's splats, a batch at a time, listed for each patch of its pixels.
//!
//! A patch is as many pixels as a kernel keeps in its registers: 4 wide, 2 or 4 high. Once every patch
//! has its list, the inner loop has no branches to guess and never puts a patch's pixels down.

use crate::tile::pixels::{BLOCKS_ACROSS, BLOCK_WIDTH};
use crate::tile::splat::{TileSplat, TileWork};

/// Splats listed at a time; their constants stay in the first-level cache.
pub const BATCH: usize = 256;
/// Splats blended into a patch between two looks at whether it still takes light.
pub const RUN: usize = 8;
/// Room behind a list for what an append writes beyond its end.
pub const SPARE: usize = 64;

/// A batch and its lists. `M` has one bit per patch.
pub struct Batch<M, const PATCHES: usize> {
    pub splats: [TileSplat; BATCH],
    /// Patches that each splat touches; none beyond the last splat.
    pub masks: [M; BATCH],
    /// Splats of each patch, in order.
    pub lists: [[u8; BATCH + SPARE]; PATCHES],
    pub lengths: [usize; PATCHES],
}

impl<M: Copy + Default, const PATCHES: usize> Batch<M, PATCHES> {
    #[inline(always)]
    pub fn empty() -> Self {
        Batch {
            splats: [TileSplat::default(); BATCH],
            masks: [M::default(); BATCH],
            lists: [[0; BATCH + SPARE]; PATCHES],
            lengths: [0; PATCHES],
        }
    }

    /// Takes in the splats of `slots`, at most a batch, and forgets all masks and lists.
    #[inline(always)]
    pub fn gather(&mut self, work: &TileWork, slots: &[u32]) {
        for (place, splat) in self.splats.iter_mut().zip(work.splats(slots)) {
            *place = splat;
        }
        self.masks.fill(M::default());
        self.lengths = [0; PATCHES];
    }

    /// What is to be blended into one patch.
    #[inline(always)]
    pub fn of_patch<'a>(
        &'a self,
        patch: usize,
        slots: &'a [u32],
        work: &'a TileWork,
    ) -> PatchList<'a> {
        PatchList {
            patch,
            list: &self.lists[patch][..self.lengths[patch]],
            splats: &self.splats,
            slots,
            work,
        }
    }
}

/// The part of a batch that touches one patch, as the inner loop sees it.
#[derive(Clone, Copy)]
pub struct PatchList<'a> {
    pub patch: usize,
    /// Places in the batch, in order.
    pub list: &'a [u8],
    pub splats: &'a [TileSplat; BATCH],
    /// Record of each splat of the batch.
    pub slots: &'a [u32],
    pub work: &'a TileWork<'a>,
}

impl PatchList<'_> {
    /// The same list for another patch.
    #[inline(always)]
    pub fn with_patch(self, patch: usize) -> Self {
        PatchList { patch, ..self }
    }

    /// Takes the lanes of `doubtful` (one bit each) to the judge; the others keep their verdict.
    #[cold]
    #[inline(never)]
    pub fn settle<const LANES: usize>(&self, place: usize, verdict: u32, doubtful: u32) -> u32 {
        settle::<LANES>(self.work, self.slots[place], self.patch, verdict, doubtful)
    }
}

/// Takes the lanes of `doubtful` (one bit each) to the judge; the others keep their verdict.
#[cold]
#[inline(never)]
pub fn settle<const LANES: usize>(
    work: &TileWork,
    slot: u32,
    patch: usize,
    mut verdict: u32,
    doubtful: u32,
) -> u32 {
    let (left, top) = corner::<LANES>(patch);
    for lane in (0..LANES).filter(|lane| doubtful >> lane & 1 == 1) {
        let is_drawn = work.is_drawn(slot, left + lane % BLOCK_WIDTH, top + lane / BLOCK_WIDTH);
        verdict = verdict & !(1 << lane) | u32::from(is_drawn) << lane;
    }
    verdict
}

/// Column and row, in the tile, of the first pixel of a patch of `LANES` pixels.
#[inline(always)]
pub fn corner<const LANES: usize>(patch: usize) -> (usize, usize) {
    let left = patch % BLOCKS_ACROSS * BLOCK_WIDTH;
    (left, patch / BLOCKS_ACROSS * (LANES / BLOCK_WIDTH))
}
