//! The blend of a tile block by block: the part that is the same for AVX2 and NEON.

/// Defines `blend_tile` and `blend_everywhere` for the given instructions, from what the file that calls
/// it defines for them: `live_blocks`, `block_mask`, `list_by_block` and `blend_block`.
macro_rules! blend_by_blocks {
    ($instructions:literal) => {
        /// As `portable::blend_tile`.
        #[target_feature(enable = $instructions)]
        pub fn blend_tile<const TRACK_OBJECTS: bool>(tile: &mut Tile, work: &TileWork) {
            let mut batch = Batch::empty();
            for slots in work.slots.chunks(BATCH) {
                let live = live_blocks(tile);
                if live == 0 {
                    return;
                }
                batch.gather(work, slots);
                for place in 0..slots.len() {
                    batch.masks[place] = block_mask(&batch.splats[place]) & live;
                }
                list_by_block(&mut batch, slots.len());
                for (index, block) in tile.blocks.iter_mut().enumerate() {
                    blend_block::<TRACK_OBJECTS>(block, &batch.of_patch(index, slots, work));
                }
            }
        }

        /// Blends a batch that reaches everywhere into every block: nothing but the inner loop.
        #[target_feature(enable = $instructions)]
        pub fn blend_everywhere(tile: &mut Tile, everything: &PatchList) {
            for (index, block) in tile.blocks.iter_mut().enumerate() {
                blend_block::<false>(block, &everything.with_patch(index));
            }
        }
    };
}
pub(crate) use blend_by_blocks;
