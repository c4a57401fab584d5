//! From gradients of pixels to sums per splat: one tile at a time, forwards then backwards.
//!
//! The first sweep blends as the forward pass does and notes every sample's alpha and weight; the
//! second takes the splats from the last to the first and carries, per pixel, the loss B per unit
//! of weight of what lies behind: with s the same of the splat itself, d loss / d ln(alpha) =
//! weight · (s - B). Nothing is divided and nothing cancels, which a front-to-back replay does
//! behind nearly opaque splats.

use crate::lanes::patch::{live_blocks, load3, pixels_of, Block, LaneWork, Lanes};
use crate::lanes::vector::{all3, alpha_of, mask_of, power_at, whitened, Vector};
use crate::project::record::STEP_DOUBT;
use crate::tile::batch::settle;
use crate::tile::pixels::{ALPHA_MAX, BLOCKS, BLOCK_PIXELS, TRANSMITTANCE_STOP};
use crate::tile::splat::{TileSplat, TileWork};

/// Splats between two looks at which blocks still take light.
pub const SPLATS_PER_CHECK: usize = 32;

/// Sums of one splat over the pixels of a tile, with G = d loss / d ln(alpha), weight w and whitened
/// offsets u, v: G, Gu, Gv, Guu, Guv, Gvv, w·d loss/d(red, green, blue), w·d loss/d(depth sum).
pub const SUMS: usize = 10;
pub type Sums = [f32; SUMS];

/// Gradients with respect to what a tile's pixels have gathered.
///
/// The loss is linear in the blend weights: a splat of colour c at depth d contributes
/// `c · colour + d · depth + constant` to it at a pixel, per unit of weight. On entry `depth` belongs to
/// the mean depth; see `finish_depth`.
pub struct PixelGradients {
    pub colour: [[Block; 3]; BLOCKS],
    pub depth: [Block; BLOCKS],
    pub constant: [Block; BLOCKS],
    pub has_depth: bool,
}

impl PixelGradients {
    pub const ZERO: PixelGradients = PixelGradients {
        colour: [[[0.0; BLOCK_PIXELS]; 3]; BLOCKS],
        depth: [[0.0; BLOCK_PIXELS]; BLOCKS],
        constant: [[0.0; BLOCK_PIXELS]; BLOCKS],
        has_depth: false,
    };
}

/// What the first sweep leaves for the second; kept between tiles for its memory.
#[derive(Default)]
pub struct Samples {
    /// Alpha and weight of every (splat, block), in order; kernels sixteen wide write a sample of
    /// alphas and one of weights for every (splat, square).
    pub values: Vec<Sample>,
    /// Splats that touched anything: their place in the tile's list and the patches they touched.
    pub splats: Vec<(u32, u32, TileSplat)>,
}

/// Two values for each pixel of a block, or one for each of a square.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Sample(pub [Block; 2]);

/// One tile's backward pass.
pub struct BackwardTile<'a> {
    pub work: TileWork<'a>,
    /// 1 where the tile may be drawn, 0 outside the lens circle.
    pub transmittance: [Block; BLOCKS],
    pub gradients: &'a mut PixelGradients,
    pub samples: &'a mut Samples,
    /// One for each of the tile's splats; all zero on entry.
    pub sums: &'a mut [Sums],
}

impl LaneWork for BackwardTile<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes>(mut self) {
        self.sweep_forwards::<V>();
        if self.gradients.has_depth {
            self.finish_depth::<V>();
        }
        self.sweep_backwards::<V>();
    }
}

impl BackwardTile<'_> {
    #[inline(always)]
    fn sweep_forwards<V: Lanes>(&mut self) {
        let samples = &mut *self.samples;
        samples.values.clear();
        samples.splats.clear();
        let stop = V::all(TRANSMITTANCE_STOP);
        let mut live = 0;
        for (place, &slot) in self.work.slots.iter().enumerate() {
            if place % SPLATS_PER_CHECK == 0 {
                live = live_blocks(&self.transmittance, TRANSMITTANCE_STOP);
                if live == 0 {
                    break;
                }
            }
            let splat = TileSplat::new(&self.work, slot);
            let mask = V::block_mask(&splat) & live;
            if mask == 0 {
                continue;
            }
            samples.splats.push((place as u32, mask, splat));
            let mut left = mask;
            while left != 0 {
                let block = left.trailing_zeros() as usize % BLOCKS;
                left &= left - 1;
                let (x, y) = pixels_of::<V>(block);
                let (u, v) = whitened(&splat, x, y);
                let power = power_at(&splat, u, v);
                let mut is_drawn = power.at_least(V::all(0.0));
                let doubtful = !power.abs().at_least(V::all(STEP_DOUBT)).bits() & 0xff;
                if doubtful != 0 {
                    let verdict = is_drawn.bits();
                    is_drawn = mask_of(settle::<BLOCK_PIXELS>(
                        &self.work, slot, block, verdict, doubtful,
                    ));
                }
                let transmittance = V::load(&self.transmittance[block]);
                let is_drawn = is_drawn.and(transmittance.at_least(stop));
                let alpha = alpha_of(power).min(V::all(ALPHA_MAX)).and(is_drawn);
                let weight = alpha.mul(transmittance);
                transmittance
                    .sub(weight)
                    .store(&mut self.transmittance[block]);
                let mut sample = Sample([[0.0; BLOCK_PIXELS]; 2]);
                alpha.store(&mut sample.0[0]);
                weight.store(&mut sample.0[1]);
                samples.values.push(sample);
            }
        }
    }

    /// Mean depth = sum of (weight · depth) / sum of weights. Both are summed here anew: one minus the
    /// transmittance would lose a faint pixel's last digits.
    #[inline(always)]
    fn finish_depth<V: Lanes>(&mut self) {
        let mut weights = [[0.0f32; BLOCK_PIXELS]; BLOCKS];
        let mut depths = [[0.0f32; BLOCK_PIXELS]; BLOCKS];
        let mut values = self.samples.values.iter();
        for (_, mask, splat) in &self.samples.splats {
            let depth = V::all(splat.depth);
            let mut left = *mask;
            while left != 0 {
                let block = left.trailing_zeros() as usize % BLOCKS;
                left &= left - 1;
                let Some(sample) = values.next() else {
                    return;
                };
                let weight = V::load(&sample.0[1]);
                let (sum, mean) = (V::load(&weights[block]), V::load(&depths[block]));
                sum.add(weight).store(&mut weights[block]);
                weight.mul_add(depth, mean).store(&mut depths[block]);
            }
        }
        for block in 0..BLOCKS {
            for lane in 0..BLOCK_PIXELS {
                let weight = weights[block][lane];
                let d_depth = &mut self.gradients.depth[block][lane];
                if weight > 0.0 {
                    *d_depth /= weight;
                    self.gradients.constant[block][lane] -=
                        *d_depth * (depths[block][lane] / weight);
                } else {
                    *d_depth = 0.0;
                }
            }
        }
    }

    #[inline(always)]
    fn sweep_backwards<V: Lanes>(&mut self) {
        let mut behind = [[0.0f32; BLOCK_PIXELS]; BLOCKS];
        let zero = V::all(0.0);
        let mut values = self.samples.values.iter().rev();
        for (place, mask, splat) in self.samples.splats.iter().rev() {
            let colour = all3::<V>(&splat.colour);
            let depth = V::all(splat.depth);
            let mut sums = [zero; SUMS];
            let mut left = *mask;
            while left != 0 {
                let block = left.ilog2() as usize % BLOCKS;
                left &= !(1 << block);
                let Some(sample) = values.next() else {
                    return;
                };
                let (alpha, weight) = (V::load(&sample.0[0]), V::load(&sample.0[1]));
                let (x, y) = pixels_of::<V>(block);
                let (u, v) = whitened(splat, x, y);
                let d_colour = load3::<V>(&self.gradients.colour[block]);
                let d_depth = V::load(&self.gradients.depth[block]);
                let mut contribution = V::load(&self.gradients.constant[block]);
                for channel in 0..3 {
                    contribution = colour[channel].mul_add(d_colour[channel], contribution);
                }
                contribution = depth.mul_add(d_depth, contribution);
                let contribution_behind = V::load(&behind[block]);
                let gained = contribution.sub(contribution_behind);
                alpha
                    .mul_add(gained, contribution_behind)
                    .store(&mut behind[block]);
                // At its limit alpha does not follow the splat.
                let is_limited = alpha.at_least(V::all(ALPHA_MAX));
                let gain = weight.mul(gained);
                let gain = gain.sub(gain.and(is_limited));
                add_moments(&mut sums, gain, u, v);
                for channel in 0..3 {
                    sums[6 + channel] = weight.mul_add(d_colour[channel], sums[6 + channel]);
                }
                sums[9] = weight.mul_add(d_depth, sums[9]);
            }
            let first = V::sums([sums[0], sums[1], sums[2], sums[3]]);
            let second = V::sums([sums[4], sums[5], sums[6], sums[7]]);
            let third = V::sums([sums[8], sums[9], zero, zero]);
            let all = first.iter().chain(&second).chain(&third[..2]);
            let to = &mut self.sums[*place as usize];
            for (to, &value) in to.iter_mut().zip(all) {
                *to = value;
            }
        }
    }
}

/// Adds G, Gu, Gv, Guu, Guv, Gvv, the first six of a splat's sums (see `Sums`), with G = `gain`.
#[inline(always)]
pub(crate) fn add_moments<V: Vector, const N: usize>(sums: &mut [V; N], gain: V, u: V, v: V) {
    let (gain_u, gain_v) = (gain.mul(u), gain.mul(v));
    sums[0] = sums[0].add(gain);
    sums[1] = sums[1].add(gain_u);
    sums[2] = sums[2].add(gain_v);
    sums[3] = gain_u.mul_add(u, sums[3]);
    sums[4] = gain_u.mul_add(v, sums[4]);
    sums[5] = gain_v.mul_add(v, sums[5]);
}
