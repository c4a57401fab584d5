//! The pixels of a patch and how they change with the pose: one splat blended into them.
//!
//! While a pixel is blended its transmittance T and grey G carry their derivatives along:
//! with dw = alpha · dT + w · d ln(alpha), T' = T - w and dT' = dT - dw, dG += dw · grey + w · dgrey.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use crate::lanes::patch::Patch;
use crate::pose::motion::{Motion, CONSTANT, GREY, GREY_SLOPE};
use crate::tile::pixels::TRANSMITTANCE_STOP;

/// What the pixels of a patch have gathered, and how it changes.
#[derive(Clone, Copy)]
pub struct State<V, const D: usize> {
    /// 1 where the patch may be drawn, 0 outside the lens circle.
    pub open: V,
    pub transmittance: V,
    pub grey: V,
    pub d_transmittance: [V; D],
    pub d_grey: [V; D],
}

/// One splat at the pixels of a patch, as far as it does not depend on the splats before.
#[derive(Clone, Copy)]
pub(crate) struct Sample<V> {
    pub(crate) alpha: V,
    /// Alpha where it follows the splat: at its limit it does not.
    pub(crate) free: V,
    pub(crate) u: V,
    pub(crate) v: V,
}

impl<V: Patch, const D: usize> State<V, D> {
    #[inline(always)]
    pub(crate) fn blend<const ANTIALIAS: bool>(&mut self, sample: &Sample<V>, motion: &Motion<D>) {
        let takes_light = self.transmittance.at_least(V::all(TRANSMITTANCE_STOP));
        let light = self.transmittance.and(takes_light);
        let alpha = sample.alpha.and(takes_light);
        let weight = sample.alpha.mul(light);
        let free = sample.free.mul(light);
        let (by_u, by_v) = (free.mul(sample.u), free.mul(sample.v));
        let terms = [
            by_u,
            by_v,
            by_u.mul(sample.u),
            by_u.mul(sample.v),
            by_v.mul(sample.v),
        ];
        // Term by term, since the sums of one term do not wait for each other.
        let mut d_weight = [by_u; D];
        for k in 0..D {
            d_weight[k] = terms[0].mul(V::all(motion.0[k][0]));
        }
        for term in 1..5 {
            for k in 0..D {
                let coefficient = V::all(motion.0[k][term]);
                d_weight[k] = terms[term].mul_add(coefficient, d_weight[k]);
            }
        }
        if ANTIALIAS {
            for k in 0..D {
                d_weight[k] = free.mul_add(V::all(motion.0[k][CONSTANT]), d_weight[k]);
            }
        }
        let value = V::all(motion.0[0][GREY]);
        for k in 0..D {
            d_weight[k] = alpha.mul_add(self.d_transmittance[k], d_weight[k]);
            self.d_grey[k] = weight.mul_add(V::all(motion.0[k][GREY_SLOPE]), self.d_grey[k]);
        }
        for k in 0..D {
            self.d_transmittance[k] = self.d_transmittance[k].sub(d_weight[k]);
            self.d_grey[k] = d_weight[k].mul_add(value, self.d_grey[k]);
        }
        self.grey = weight.mul_add(value, self.grey);
        self.transmittance = self.transmittance.sub(weight);
    }
}
