//! Residuals of the drawn object against the picture, and the normal equations they sum to.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use crate::lanes::patch::Patch;
use crate::pose::state::State;

/// Unknowns at most: six of the pose, gain and bias.
pub const MAX_UNKNOWNS: usize = 8;
/// Entries of the upper triangle of the normal matrix.
pub const MAX_PAIRS: usize = MAX_UNKNOWNS * (MAX_UNKNOWNS + 1) / 2;
/// What the drawn object is compared with; row-major pictures of one size.
#[derive(Clone, Copy)]
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

impl<'a> Target<'a> {
    /// The rows of pixels from `top` that lie in a row of tiles.
    pub fn strip(&self, width: usize, top: usize, rows: usize) -> Target<'a> {
        let pixels = top * width..(top + rows) * width;
        Target {
            grey: &self.grey[pixels.clone()],
            grey_weight: &self.grey_weight[pixels.clone()],
            background: &self.background[pixels.clone()],
            silhouette: &self.silhouette[pixels.clone()],
            silhouette_weight: &self.silhouette_weight[pixels.clone()],
            occluder: &self.occluder[pixels],
            ..*self
        }
    }
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
    pub const ZERO: NormalSums = NormalSums {
        pairs: [0.0; MAX_PAIRS],
        gradient: [0.0; MAX_UNKNOWNS],
        squares: [0.0; 2],
    };

    pub fn add(&mut self, other: &NormalSums) {
        let to = self.pairs.iter_mut().chain(&mut self.gradient);
        let to = to.chain(&mut self.squares);
        let from = other.pairs.iter().chain(&other.gradient);
        for (to, from) in to.zip(from.chain(&other.squares)) {
            *to += from;
        }
    }
}

/// The target's pixels of one patch; weights are 0 outside the picture.
pub struct TargetPatch<V> {
    pub grey: V,
    pub grey_weight: V,
    pub background: V,
    pub silhouette: V,
    pub silhouette_weight: V,
}

/// Sums over the patches of a tile, lane by lane.
pub struct PatchSums<V, const D: usize> {
    pairs: [V; MAX_PAIRS],
    gradient: [V; MAX_UNKNOWNS],
    squares: [V; 2],
    gain: V,
    bias: V,
}

impl<V: Patch, const D: usize> PatchSums<V, D> {
    #[inline(always)]
    pub fn new(gain: f32, bias: f32) -> Self {
        let zero = V::all(0.0);
        PatchSums {
            pairs: [zero; MAX_PAIRS],
            gradient: [zero; MAX_UNKNOWNS],
            squares: [zero; 2],
            gain: V::all(gain),
            bias: V::all(bias),
        }
    }

    /// A patch where nothing is drawn: constant residuals.
    #[inline(always)]
    pub fn add_bare(&mut self, open: V, pixels: &TargetPatch<V>) {
        let bare = pixels.background.sub(pixels.grey);
        let weight = pixels.grey_weight.mul(open);
        self.squares[0] = weight.mul(bare).mul_add(bare, self.squares[0]);
        let outline = pixels.silhouette;
        let weight = pixels.silhouette_weight.mul(open);
        self.squares[1] = weight.mul(outline).mul_add(outline, self.squares[1]);
    }

    /// A finished patch.
    #[inline(always)]
    pub fn add_drawn(&mut self, state: &State<V, D>, pixels: &TargetPatch<V>) {
        let zero = V::all(0.0);
        let alpha = state.open.sub(state.transmittance);
        let weight = pixels.grey_weight.mul(state.open);
        // gain · grey + bias · alpha + (1 - alpha) · background - target
        let lift = self.bias.sub(pixels.background);
        let over = pixels.background.sub(pixels.grey);
        let residual = self.gain.mul_add(state.grey, lift.mul_add(alpha, over));
        let outline_weight = pixels.silhouette_weight.mul(state.open);
        let outline = alpha.sub(pixels.silhouette);

        let mut slopes = [zero; MAX_UNKNOWNS];
        let mut outline_slopes = [zero; D];
        for k in 0..D {
            let d_alpha = zero.sub(state.d_transmittance[k]);
            slopes[k] = self.gain.mul_add(state.d_grey[k], lift.mul(d_alpha));
            outline_slopes[k] = d_alpha;
        }
        slopes[D] = state.grey;
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
                let mut sum = weighted[i].mul_add(slopes[j], self.pairs[place]);
                if j < D {
                    sum = outline_weighted[i].mul_add(outline_slopes[j], sum);
                }
                self.pairs[place] = sum;
                place += 1;
            }
            self.gradient[i] = weighted[i].mul_add(residual, self.gradient[i]);
            if i < D {
                self.gradient[i] = outline_weighted[i].mul_add(outline, self.gradient[i]);
            }
        }
        self.squares[0] = weight.mul(residual).mul_add(residual, self.squares[0]);
        self.squares[1] = outline_weight
            .mul(outline)
            .mul_add(outline, self.squares[1]);
    }

    /// The sums over the lanes; `is_drawn`: whether any patch was.
    #[inline(always)]
    pub fn finish(&self, is_drawn: bool) -> NormalSums {
        let mut sums = NormalSums::ZERO;
        for k in 0..2 {
            sums.squares[k] = total(self.squares[k]);
        }
        if is_drawn {
            for k in 0..MAX_PAIRS {
                sums.pairs[k] = total(self.pairs[k]);
            }
            for k in 0..MAX_UNKNOWNS {
                sums.gradient[k] = total(self.gradient[k]);
            }
        }
        sums
    }
}

/// Sum over the lanes.
#[inline(always)]
fn total<V: Patch>(value: V) -> f64 {
    let mut lanes = V::Array::default();
    value.store(&mut lanes);
    lanes.as_ref().iter().map(|&v| f64::from(v)).sum()
}
