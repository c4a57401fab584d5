//! Between which depths a photo's pixels show a surface, and what light from elsewhere costs.
//!
//! A unit of blend weight at depth z costs near / z - 1 in front of the bounds, 1 - far / z behind
//! them, nothing between them, and never more than `MAX_COST`: shares of the depth, so that far walls
//! may be seen less well than near ones.

use crate::lanes::vector::Vector;

/// What any unit of weight costs at most; beyond it the price does not pull, it only drains.
pub const MAX_COST: f32 = 0.04;
/// A far bound that bounds nothing.
pub const FARTHEST: f32 = 1e30;

/// Row by row, depths as the lens measures them; 0 and `FARTHEST` where nothing is known.
pub struct DepthBounds {
    pub near: Vec<f32>,
    pub far: Vec<f32>,
}

/// Price of a unit of weight at depth 1 / `nearness`, and its slope by the depth.
#[inline(always)]
pub fn price<V: Vector>(near: V, far: V, nearness: V) -> (V, V) {
    let (zero, one) = (V::all(0.0), V::all(1.0));
    let (near, far) = (near.mul(nearness), far.mul(nearness));
    let (before, behind) = (near.sub(one), one.sub(far));
    let (is_before, is_behind) = (before.at_least(zero), behind.at_least(zero));
    // Never both.
    let off = before.and(is_before).add(behind.and(is_behind));
    let most = V::all(MAX_COST);
    let slope = far.and(is_behind).sub(near.and(is_before)).mul(nearness);
    (off.min(most), slope.and(most.at_least(off)))
}
