//! `backward` for AVX-512: sixteen pixels (a square) at a time, else the same operations in the same
//! order per pixel.

use std::arch::x86_64::*;

use crate::gradients::backward::{
    BackwardTile, PixelGradients, Sample, Samples, Sums, SPLATS_PER_CHECK,
};
use crate::lanes::avx512::Avx512;
use crate::lanes::square_avx512::{
    blocks_of, load, pixels_of, square_masks, SQUARES, SQUARE_PIXELS,
};
use crate::lanes::vector::{alpha_of, power_at, whitened, Vector};
use crate::project::record::STEP_DOUBT;
use crate::tile::batch::settle;
use crate::tile::pixels::{ALPHA_MAX, BLOCKS, BLOCK_PIXELS, TRANSMITTANCE_STOP};
use crate::tile::splat::{TileSplat, TileWork};

/// One value per pixel of a tile.
type Plane = [__m512; SQUARES];

/// As `PixelGradients`, square by square.
struct Gradients {
    colour: [Plane; 3],
    depth: Plane,
    constant: Plane,
}

/// As `BackwardTile::run`.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
pub fn run(tile: BackwardTile) {
    let transmittance = plane_of(|block| &tile.transmittance[block]);
    let mut gradients = squares_of(tile.gradients);
    if tile.gradients.has_depth {
        let means = sweep_forwards::<true>(&tile.work, transmittance, tile.samples);
        finish_depth(&mut gradients, &means);
        sweep_backwards::<true>(&gradients, tile.samples, tile.sums);
    } else {
        sweep_forwards::<false>(&tile.work, transmittance, tile.samples);
        sweep_backwards::<false>(&gradients, tile.samples, tile.sums);
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn squares_of(gradients: &PixelGradients) -> Gradients {
    Gradients {
        colour: [
            plane_of(|block| &gradients.colour[block][0]),
            plane_of(|block| &gradients.colour[block][1]),
            plane_of(|block| &gradients.colour[block][2]),
        ],
        depth: plane_of(|block| &gradients.depth[block]),
        constant: plane_of(|block| &gradients.constant[block]),
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn plane_of<'a>(values: impl Fn(usize) -> &'a [f32; BLOCK_PIXELS]) -> Plane {
    const { assert!(2 * SQUARES == BLOCKS) };
    let mut plane = [_mm512_setzero_ps(); SQUARES];
    for (square, pixels) in plane.iter_mut().enumerate() {
        let [upper, lower] = blocks_of(square);
        *pixels = load(values(upper), values(lower));
    }
    plane
}

/// Sums of weights and of weight · depth, where the depth matters.
struct Means {
    weights: Plane,
    depths: Plane,
}

/// Blends as the forward pass does and notes alpha and weight of every (splat, square).
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn sweep_forwards<const HAS_DEPTH: bool>(
    work: &TileWork,
    mut transmittance: Plane,
    samples: &mut Samples,
) -> Means {
    samples.values.clear();
    samples.splats.clear();
    let mut means = Means {
        weights: [_mm512_setzero_ps(); SQUARES],
        depths: [_mm512_setzero_ps(); SQUARES],
    };
    for (index, slots) in work.slots.chunks(SPLATS_PER_CHECK).enumerate() {
        let live = live_squares(&transmittance);
        if live == 0 {
            break;
        }
        let mut splats = [TileSplat::default(); SPLATS_PER_CHECK];
        for (place, splat) in splats.iter_mut().zip(work.splats(slots)) {
            *place = splat;
        }
        let mut masks = [[0; 4]; SPLATS_PER_CHECK / 4];
        for (masks, splats) in masks.iter_mut().zip(splats.as_chunks().0) {
            *masks = square_masks(splats);
        }
        for (place, &slot) in slots.iter().enumerate() {
            let (splat, mask) = (splats[place], masks.as_flattened()[place] & live);
            if mask != 0 {
                let place = (index * SPLATS_PER_CHECK + place) as u32;
                samples.splats.push((place, mask.into(), splat));
                let values = &mut samples.values;
                let drawn = (work, slot, &splat, mask);
                blend_splat::<HAS_DEPTH>(drawn, &mut transmittance, &mut means, values);
            }
        }
    }
    means
}

/// Blends one splat into the squares of its mask and notes its samples.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn blend_splat<const HAS_DEPTH: bool>(
    (work, slot, splat, mut mask): (&TileWork, u32, &TileSplat, u16),
    transmittance: &mut Plane,
    means: &mut Means,
    samples: &mut Vec<Sample>,
) {
    let stop = _mm512_set1_ps(TRANSMITTANCE_STOP);
    let doubt = _mm512_set1_ps(STEP_DOUBT);
    while mask != 0 {
        let square = mask.trailing_zeros() as usize % SQUARES;
        mask &= mask - 1;
        let (x, y) = pixels_of(square);
        let (u, v) = whitened(splat, Avx512(x), Avx512(y));
        let power = power_at(splat, u, v).0;
        let mut is_drawn = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(power, _mm512_setzero_ps());
        let doubtful = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(_mm512_abs_ps(power), doubt);
        if doubtful != 0 {
            let (verdict, doubtful) = (is_drawn.into(), doubtful.into());
            is_drawn = settle::<SQUARE_PIXELS>(work, slot, square, verdict, doubtful) as u16;
        }
        let before = transmittance[square];
        let takes = _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(is_drawn, before, stop);
        let alpha = _mm512_min_ps(alpha_of(Avx512(power)).0, _mm512_set1_ps(ALPHA_MAX));
        let alpha = _mm512_maskz_mov_ps(takes, alpha);
        let weight = _mm512_mul_ps(alpha, before);
        transmittance[square] = _mm512_sub_ps(before, weight);
        samples.push(sample_of(alpha));
        samples.push(sample_of(weight));
        if HAS_DEPTH {
            let depth = _mm512_set1_ps(splat.depth);
            means.weights[square] = _mm512_add_ps(means.weights[square], weight);
            means.depths[square] = _mm512_fmadd_ps(weight, depth, means.depths[square]);
        }
    }
}

/// One bit per square that still takes light.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn live_squares(transmittance: &Plane) -> u16 {
    let stop = _mm512_set1_ps(TRANSMITTANCE_STOP);
    let mut live = 0;
    for (square, &pixels) in transmittance.iter().enumerate() {
        let takes_light = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(pixels, stop) != 0;
        live |= u16::from(takes_light) << square;
    }
    live
}

/// As `BackwardTile::finish_depth`.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn finish_depth(gradients: &mut Gradients, means: &Means) {
    for square in 0..SQUARES {
        let weight = means.weights[square];
        let is_seen = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(weight, _mm512_setzero_ps());
        let d_depth = _mm512_maskz_div_ps(is_seen, gradients.depth[square], weight);
        let mean = _mm512_maskz_div_ps(is_seen, means.depths[square], weight);
        let constant = &mut gradients.constant[square];
        *constant = _mm512_sub_ps(*constant, _mm512_mul_ps(d_depth, mean));
        gradients.depth[square] = d_depth;
    }
}

/// Takes the splats from the last to the first and sums each one's gradients over its pixels.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn sweep_backwards<const HAS_DEPTH: bool>(
    gradients: &Gradients,
    samples: &Samples,
    sums: &mut [Sums],
) {
    let zero = _mm512_setzero_ps();
    let limit = _mm512_set1_ps(ALPHA_MAX);
    let mut behind = [zero; SQUARES];
    let mut values = samples.values.rchunks_exact(2);
    for (place, mask, splat) in samples.splats.iter().rev() {
        let (mut gains, mut turns, mut colours) = ([zero; 3], [zero; 3], [zero; 3]);
        let mut depths = zero;
        let mut left = *mask;
        while left != 0 {
            let square = left.ilog2() as usize % SQUARES;
            left &= !(1 << square);
            let Some([alpha, weight]) = values.next() else {
                return;
            };
            let (alpha, weight) = (values_of(alpha), values_of(weight));
            let (x, y) = pixels_of(square);
            let (Avx512(u), Avx512(v)) = whitened(splat, Avx512(x), Avx512(y));
            let mut contribution = gradients.constant[square];
            for (plane, &colour) in gradients.colour.iter().zip(&splat.colour) {
                contribution = _mm512_fmadd_ps(_mm512_set1_ps(colour), plane[square], contribution);
            }
            if HAS_DEPTH {
                let depth = _mm512_set1_ps(splat.depth);
                contribution = _mm512_fmadd_ps(depth, gradients.depth[square], contribution);
                depths = _mm512_fmadd_ps(weight, gradients.depth[square], depths);
            }
            let gained = _mm512_sub_ps(contribution, behind[square]);
            behind[square] = _mm512_fmadd_ps(alpha, gained, behind[square]);
            // At its limit alpha does not follow the splat.
            let follows = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(alpha, limit);
            let gain = _mm512_maskz_mul_ps(follows, weight, gained);
            let (gain_u, gain_v) = (_mm512_mul_ps(gain, u), _mm512_mul_ps(gain, v));
            gains = [
                _mm512_add_ps(gains[0], gain),
                _mm512_add_ps(gains[1], gain_u),
                _mm512_add_ps(gains[2], gain_v),
            ];
            turns = [
                _mm512_fmadd_ps(gain_u, u, turns[0]),
                _mm512_fmadd_ps(gain_u, v, turns[1]),
                _mm512_fmadd_ps(gain_v, v, turns[2]),
            ];
            for (sum, plane) in colours.iter_mut().zip(&gradients.colour) {
                *sum = _mm512_fmadd_ps(weight, plane[square], *sum);
            }
        }
        let first = totals([gains[0], gains[1], gains[2], turns[0]]);
        let second = totals([turns[1], turns[2], colours[0], colours[1]]);
        let third = totals([colours[2], depths, zero, zero]);
        let to = &mut sums[*place as usize];
        to[..4].copy_from_slice(&first);
        to[4..8].copy_from_slice(&second);
        to[8..].copy_from_slice(&third[..2]);
    }
}

/// Sums over the lanes of four values.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn totals(values: [__m512; 4]) -> [f32; 4] {
    let [a, b, c, d] = values;
    Avx512::sums([Avx512(a), Avx512(b), Avx512(c), Avx512(d)])
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn sample_of(values: __m512) -> Sample {
    let mut sample = Sample([[0.0; BLOCK_PIXELS]; 2]);
    // SAFETY: a sample is 16 floats aligned as the register.
    unsafe { _mm512_store_ps(sample.0.as_mut_ptr().cast(), values) };
    sample
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
#[inline]
fn values_of(sample: &Sample) -> __m512 {
    // SAFETY: a sample is 16 floats aligned as the register.
    unsafe { _mm512_load_ps(sample.0.as_ptr().cast()) }
}
