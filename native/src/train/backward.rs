//! From the gradients of pixels to sums per splat for training: one sweep over a tile, front to back.
//!
//! `backward` is exact to the last digits and takes two sweeps. Here the forward pass has left, per
//! pixel, the contribution R to the loss of all that it shows (colour · gradient); each splat takes
//! its share off R, and what remains is that of what lies behind it: with weight w, contribution s
//! per unit of weight and transmittance T' behind the splat, d loss / d ln(alpha) = w · s - R' · w
//! / T'. Samples within `STEP_DOUBT` of the 1/255 step are decided in single precision. Each splat
//! also gets the error of the pixels that it shows, by its weight in them.
//!
//! Where the photo's depth is known (`depth_bounds`), weight off the surface has a price. It is part
//! of R; a sweep ahead adds up what the forward pass did not.

use crate::gradients::backward::add_moments;
use crate::lanes::patch::{Patch, PatchWork};
use crate::lanes::vector::{all3, alpha_of, of_lanes, power_at, whitened};
use crate::project::tile_box::TILE;
use crate::tile::pixels::{ALPHA_MAX, BLOCK_WIDTH, TRANSMITTANCE_STOP};
use crate::tile::splat::{TileSplat, TileWork};
use crate::train::depth_bounds::price;
use crate::train::tile_pixels::{PatchPixels, TilePixels, MAX_PATCHES, PIXELS};

/// Splats between two looks at which patches still take light.
const SPLATS_PER_CHECK: usize = 32;
/// Splats whose records are asked for ahead of time.
const FETCH_AHEAD: usize = 4;
/// As `backward::SUMS`, then Σ weight · error.
pub const SUMS: usize = crate::gradients::backward::SUMS + 1;
pub type Sums = [f32; SUMS];
/// Place of Σ weight · error in a splat's sums.
pub const ERROR: usize = SUMS - 1;

/// One tile's sweep.
pub(crate) struct TrainingTile<'a> {
    pub(crate) work: TileWork<'a>,
    pub(crate) pixels: &'a TilePixels,
    /// One for each of the tile's splats; all zero on entry.
    pub(crate) sums: &'a mut [Sums],
}

impl PatchWork for TrainingTile<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Patch>(mut self) {
        let mut patches = self.pixels.patches::<V>();
        if self.pixels.depth_rate > 0.0 {
            self.add_prices(&mut patches);
            self.sweep::<V, true>(&mut patches);
        } else {
            self.sweep::<V, false>(&mut patches);
        }
    }
}

impl TrainingTile<'_> {
    #[inline(always)]
    fn sweep<V: Patch, const PRICED: bool>(&mut self, patches: &mut [PatchPixels<V>; MAX_PATCHES]) {
        let rate = V::all(self.pixels.depth_rate);
        let mut live = 0;
        for (place, &slot) in self.work.slots.iter().enumerate() {
            if place % SPLATS_PER_CHECK == 0 {
                live = live_patches(patches);
                if live == 0 {
                    return;
                }
            }
            if let Some(&soon) = self.work.slots.get(place + FETCH_AHEAD) {
                V::prefetch(&self.work.records[soon as usize]);
            }
            let splat = TileSplat::new(&self.work, slot);
            let touched = V::patch_mask(&splat) & live;
            if touched != 0 {
                self.sums[place] = take_share::<V, PRICED>(&splat, touched, patches, rate);
            }
        }
    }

    /// Adds what weight off the surface costs to the contribution of what is shown.
    #[inline(always)]
    fn add_prices<V: Patch>(&self, patches: &mut [PatchPixels<V>; MAX_PATCHES]) {
        let rate = V::all(self.pixels.depth_rate);
        let mut ahead = *patches;
        let mut live = 0;
        for (place, &slot) in self.work.slots.iter().enumerate() {
            if place % SPLATS_PER_CHECK == 0 {
                live = live_patches(&ahead);
                if live == 0 {
                    break;
                }
            }
            if let Some(&soon) = self.work.slots.get(place + FETCH_AHEAD) {
                V::prefetch(&self.work.records[soon as usize]);
            }
            let splat = TileSplat::new(&self.work, slot);
            let mut touched = V::patch_mask(&splat) & live;
            let nearness = V::all(splat.depth.recip());
            let grid = Grid::<V>::new();
            while touched != 0 {
                let patch = touched.trailing_zeros() as usize % MAX_PATCHES;
                touched &= touched - 1;
                let (x, y) = grid.pixels_of(patch);
                let pixels = &mut ahead[patch];
                let (u, v) = whitened(&splat, x, y);
                let (_, weight) = pixels.take(power_at(&splat, u, v));
                let [near, far] = [V::load(&pixels.bounds[0]), V::load(&pixels.bounds[1])];
                let (price, _) = price(near, far, nearness);
                let contribution = V::load(&pixels.contribution);
                weight
                    .mul(rate)
                    .mul_add(price, contribution)
                    .store(&mut pixels.contribution);
            }
        }
        for (to, from) in patches.iter_mut().zip(&ahead) {
            to.contribution = from.contribution;
        }
    }
}

impl<V: Patch> PatchPixels<V> {
    /// A splat's alpha and weight here; its light is gone afterwards.
    #[inline(always)]
    fn take(&mut self, power: V) -> (V, V) {
        let before = V::load(&self.transmittance);
        let takes = power
            .at_least(V::all(0.0))
            .and(before.at_least(V::all(TRANSMITTANCE_STOP)));
        let alpha = alpha_of(power).min(V::all(ALPHA_MAX)).and(takes);
        let weight = alpha.mul(before);
        before.sub(weight).store(&mut self.transmittance);
        (alpha, weight)
    }
}

/// Where the pixels of a tile's patches are.
struct Grid<V: Patch> {
    columns: V,
    rows: V,
}

impl<V: Patch> Grid<V> {
    #[inline(always)]
    fn new() -> Grid<V> {
        Grid {
            columns: of_lanes(|lane| (lane % BLOCK_WIDTH) as f32),
            rows: of_lanes(|lane| (lane / BLOCK_WIDTH) as f32),
        }
    }

    #[inline(always)]
    fn pixels_of(&self, patch: usize) -> (V, V) {
        let across = TILE / BLOCK_WIDTH;
        let left = (patch % across * BLOCK_WIDTH) as f32;
        let top = (patch / across * (V::LANES / BLOCK_WIDTH)) as f32;
        (self.columns.add(V::all(left)), self.rows.add(V::all(top)))
    }
}

/// A splat's sums over the patches of `touched`, which lose its light and contribution.
#[inline(always)]
fn take_share<V: Patch, const PRICED: bool>(
    splat: &TileSplat,
    mut touched: u32,
    patches: &mut [PatchPixels<V>; MAX_PATCHES],
    rate: V,
) -> Sums {
    let (zero, one) = (V::all(0.0), V::all(1.0));
    let limit = V::all(ALPHA_MAX);
    let colour = all3::<V>(&splat.colour);
    let nearness = V::all(splat.depth.recip());
    let grid = Grid::<V>::new();
    let mut sums = [zero; SUMS];
    while touched != 0 {
        let patch = touched.trailing_zeros() as usize % MAX_PATCHES;
        touched &= touched - 1;
        let (x, y) = grid.pixels_of(patch);
        let pixels = &mut patches[patch];
        let (u, v) = whitened(splat, x, y);
        let (alpha, weight) = pixels.take(power_at(splat, u, v));
        let d_colour = [
            V::load(&pixels.d_colour[0]),
            V::load(&pixels.d_colour[1]),
            V::load(&pixels.d_colour[2]),
        ];
        let mut contribution = colour[0].mul(d_colour[0]);
        contribution = colour[1].mul_add(d_colour[1], contribution);
        contribution = colour[2].mul_add(d_colour[2], contribution);
        if PRICED {
            let [near, far] = [V::load(&pixels.bounds[0]), V::load(&pixels.bounds[1])];
            let (price, slope) = price(near, far, nearness);
            contribution = rate.mul_add(price, contribution);
            sums[9] = weight.mul(rate).mul_add(slope, sums[9]);
        }
        let shown = weight.mul(contribution);
        let remaining = V::load(&pixels.contribution).sub(shown);
        remaining.store(&mut pixels.contribution);
        // w / T' = α / (1 - α)
        let share = alpha.mul(one.sub(alpha).reciprocal());
        let gain = share.mul_sub_from(remaining, shown);
        // At its limit alpha does not follow the splat.
        let gain = gain.sub(gain.and(alpha.at_least(limit)));
        add_moments(&mut sums, gain, u, v);
        sums[6] = weight.mul_add(d_colour[0], sums[6]);
        sums[7] = weight.mul_add(d_colour[1], sums[7]);
        sums[8] = weight.mul_add(d_colour[2], sums[8]);
        sums[ERROR] = weight.mul_add(V::load(&pixels.error), sums[ERROR]);
    }
    let mut out = [0.0; SUMS];
    out[..4].copy_from_slice(&V::sums([sums[0], sums[1], sums[2], sums[3]]));
    out[4..8].copy_from_slice(&V::sums([sums[4], sums[5], sums[6], sums[7]]));
    out[8..].copy_from_slice(&V::sums([sums[8], sums[9], sums[ERROR], zero])[..3]);
    out
}

/// One bit per patch in which a pixel still takes light.
#[inline(always)]
fn live_patches<V: Patch>(patches: &[PatchPixels<V>; MAX_PATCHES]) -> u32 {
    let stop = V::all(TRANSMITTANCE_STOP);
    let mut live = 0;
    for (patch, pixels) in patches[..PIXELS / V::LANES].iter().enumerate() {
        let takes = V::load(&pixels.transmittance).at_least(stop);
        live |= u32::from(takes.bits() != 0) << patch;
    }
    live
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::dispatch::run_patches;
    use crate::machine::noise::Noise;
    use crate::machine::simd::Simd;
    use crate::tile::checks::for_every_work;

    fn noisy_pixels() -> TilePixels {
        let mut noise = Noise::new(5);
        let mut plane = || -> [f32; PIXELS] { std::array::from_fn(|_| noise.next() - 0.5) };
        let mut pixels = TilePixels {
            d_colour: [plane(), plane(), plane()],
            error: plane(),
            contribution: plane(),
            transmittance: [1.0; PIXELS],
            bounds: [[2.0; PIXELS], [3.0; PIXELS]],
            depth_rate: 0.5,
        };
        pixels.transmittance[3 * TILE..4 * TILE].fill(0.0);
        pixels
    }

    fn sums_of(simd: Simd, work: &TileWork) -> Vec<Sums> {
        let mut sums = vec![[0.0; SUMS]; work.slots.len()];
        run_patches(
            simd,
            TrainingTile {
                work: *work,
                pixels: &noisy_pixels(),
                sums: &mut sums,
            },
        );
        sums
    }

    #[test]
    fn every_set_agrees_with_the_portable_kernel() {
        for_every_work(|work| {
            let plain = sums_of(Simd::SCALAR, work);
            let plain = plain.as_flattened();
            let largest = plain.iter().fold(0.0f32, |m, v| m.max(v.abs()));
            for simd in Simd::available() {
                let sums = sums_of(simd, work);
                for (a, b) in plain.iter().zip(sums.as_flattened()) {
                    // Written so that a NaN fails; the step at 1/255 may go either way.
                    assert!((a - b).abs() <= 2e-3 * largest, "{}: {a} {b}", simd.name());
                }
            }
        });
    }
}
