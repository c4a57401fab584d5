//! Runs a tile's backward pass with the instructions this machine has.

use crate::gradients::backward::BackwardTile;
#[cfg(target_arch = "x86_64")]
use crate::gradients::backward_avx512;
use crate::lanes::dispatch::run_lanes;
#[cfg(target_arch = "x86_64")]
use crate::machine::simd::Level;
use crate::machine::simd::Simd;

/// One tile's backward pass with these instructions.
pub fn run_backward(simd: Simd, tile: BackwardTile) {
    match simd.level() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `available` found these sets before it made this value.
        Level::Avx512 => unsafe { backward_avx512::run(tile) },
        _ => run_lanes(simd, tile),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradients::backward::{PixelGradients, Samples, Sums, SUMS};
    use crate::machine::noise::Noise;
    use crate::tile::checks::for_every_work;
    use crate::tile::pixels::{BLOCKS, BLOCK_PIXELS};
    use crate::tile::splat::TileWork;

    fn noisy_gradients(has_depth: bool) -> PixelGradients {
        let mut noise = Noise::new(11);
        let mut gradients = PixelGradients::ZERO;
        for block in 0..BLOCKS {
            for lane in 0..BLOCK_PIXELS {
                for channel in 0..3 {
                    gradients.colour[block][channel][lane] = noise.next() - 0.5;
                }
                gradients.constant[block][lane] = noise.next() - 0.5;
                if has_depth {
                    gradients.depth[block][lane] = noise.next() - 0.5;
                }
            }
        }
        gradients.has_depth = has_depth;
        gradients
    }

    fn sums_of(simd: Simd, work: &TileWork, has_depth: bool) -> Vec<Sums> {
        let mut sums = vec![[0.0; SUMS]; work.slots.len()];
        let mut transmittance = [[1.0; BLOCK_PIXELS]; BLOCKS];
        transmittance[3] = [0.0; BLOCK_PIXELS];
        run_backward(
            simd,
            BackwardTile {
                work: *work,
                transmittance,
                gradients: &mut noisy_gradients(has_depth),
                samples: &mut Samples::default(),
                sums: &mut sums,
            },
        );
        sums
    }

    #[test]
    fn every_set_agrees_with_the_portable_kernel() {
        for_every_work(|work| {
            for has_depth in [false, true] {
                let plain = sums_of(Simd::SCALAR, work, has_depth);
                let largest = plain
                    .as_flattened()
                    .iter()
                    .fold(0.0f32, |m, v| m.max(v.abs()));
                for simd in Simd::available() {
                    let sums = sums_of(simd, work, has_depth);
                    for (a, b) in plain.as_flattened().iter().zip(sums.as_flattened()) {
                        let error = (a - b).abs();
                        // Written so that a NaN fails.
                        assert!(error <= 2e-5 * largest, "{}: {a} and {b}", simd.name());
                    }
                }
            }
        });
    }
}
