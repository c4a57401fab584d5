//! Blends a tile with the instructions this machine has.

#[cfg(target_arch = "aarch64")]
use crate::blend::neon;
use crate::blend::portable;
#[cfg(target_arch = "x86_64")]
use crate::blend::{avx2, avx512};
#[cfg(target_arch = "x86_64")]
use crate::lanes::square_avx512::SQUARE_PIXELS;
use crate::machine::simd::{Level, Simd};
use crate::tile::batch::PatchList;
use crate::tile::pixels::{Tile, BLOCK_PIXELS};
use crate::tile::splat::TileWork;

/// `portable::blend_tile` with these instructions.
pub fn blend_tile<const TRACK_OBJECTS: bool>(simd: Simd, tile: &mut Tile, work: &TileWork) {
    match simd.level() {
        Level::Scalar => {
            portable::blend_tile::<TRACK_OBJECTS>(tile, work);
        }
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` found AVX2 and FMA before it made this value.
        Level::Avx2 => unsafe {
            avx2::blend_tile::<TRACK_OBJECTS>(tile, work);
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` found these sets before it made this value.
        Level::Avx512 => unsafe {
            avx512::blend_tile::<TRACK_OBJECTS>(tile, work);
        },
        #[cfg(target_arch = "aarch64")]
        // SAFETY: `available` found NEON before it made this value.
        Level::Neon => unsafe {
            neon::blend_tile::<TRACK_OBJECTS>(tile, work);
        },
    }
}

/// Pixels of a patch: what the blend kernel has in a register; 1 for the portable kernel.
pub fn lanes(simd: Simd) -> usize {
    match simd.level() {
        Level::Scalar => 1,
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => BLOCK_PIXELS,
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => SQUARE_PIXELS,
        #[cfg(target_arch = "aarch64")]
        Level::Neon => BLOCK_PIXELS,
    }
}

/// The inner loop of `blend_tile` alone, with every lane in use: blends a list of splats that
/// reach everywhere into every patch of a tile. False for the portable kernel, which has no lists.
pub fn blend_everywhere(simd: Simd, tile: &mut Tile, everything: &PatchList) -> bool {
    match simd.level() {
        Level::Scalar => return false,
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` found AVX2 and FMA before it made this value.
        Level::Avx2 => unsafe { avx2::blend_everywhere(tile, everything) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` found these sets before it made this value.
        Level::Avx512 => unsafe { avx512::blend_everywhere(tile, everything) },
        #[cfg(target_arch = "aarch64")]
        // SAFETY: `available` found NEON before it made this value.
        Level::Neon => unsafe { neon::blend_everywhere(tile, everything) },
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tile::checks::for_every_work;

    fn blended(simd: Simd, work: &TileWork) -> Tile {
        let mut tile = Tile::EMPTY;
        blend_tile::<true>(simd, &mut tile, work);
        tile
    }

    fn largest_difference(a: &Tile, b: &Tile, relative_depth: f32) -> f32 {
        let pairs = a.blocks.iter().zip(&b.blocks).flat_map(|(a, b)| {
            (0..a.depth.len()).flat_map(move |lane| {
                [
                    a.transmittance[lane] - b.transmittance[lane],
                    a.colour[0][lane] - b.colour[0][lane],
                    a.colour[1][lane] - b.colour[1][lane],
                    a.colour[2][lane] - b.colour[2][lane],
                    (a.depth[lane] - b.depth[lane]) * relative_depth,
                    a.weight[lane] - b.weight[lane],
                ]
            })
        });
        pairs.fold(0.0, |worst, difference| match difference.is_nan() {
            true => f32::INFINITY,
            false => worst.max(difference.abs()),
        })
    }

    #[test]
    fn every_set_agrees_with_the_portable_kernel() {
        for_every_work(|work| {
            let plain = blended(Simd::SCALAR, work);
            for simd in Simd::available() {
                let difference = largest_difference(&plain, &blended(simd, work), 0.5);
                assert!(difference < 1e-5, "{}: {difference}", simd.name());
            }
        });
    }

    #[test]
    fn wider_vectors_change_no_bit() {
        let vectors: Vec<Simd> = Simd::available().into_iter().skip(1).collect();
        for_every_work(|work| {
            for pair in vectors.windows(2) {
                let (narrow, wide) = (blended(pair[0], work), blended(pair[1], work));
                assert_eq!(largest_difference(&narrow, &wide, 1.0), 0.0);
                for (a, b) in narrow.blocks.iter().zip(&wide.blocks) {
                    assert_eq!(a.object, b.object);
                }
            }
        });
    }
}
