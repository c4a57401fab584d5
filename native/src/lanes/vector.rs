//! A register as one value, and the arithmetic that all kernels share.

use crate::tile::alpha::ALPHA_OF;
use crate::tile::splat::TileSplat;

/// Arithmetic on the lanes of a register. Masks have all bits of a lane set or none.
pub trait Vector: Copy {
    /// The lanes in memory.
    type Array: Copy + Default + AsRef<[f32]> + AsMut<[f32]>;
    const LANES: usize;
    fn all(value: f32) -> Self;
    fn load(from: &Self::Array) -> Self;
    fn store(self, to: &mut Self::Array);
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    /// 1 / self, to about the last digit.
    fn reciprocal(self) -> Self;
    /// self · factor + term, rounded once where the machine can.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// term - self · factor, rounded once where the machine can.
    fn mul_sub_from(self, factor: Self, term: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// Mask of self >= other.
    fn at_least(self, other: Self) -> Self;
    fn and(self, mask: Self) -> Self;
    /// One bit per lane of a mask.
    fn bits(self) -> u32;
    /// Adds the low bits of `shifted` to the exponent.
    fn scale_by(self, shifted: Self) -> Self;
    /// Sums over the lanes of four values.
    fn sums(values: [Self; 4]) -> [f32; 4];
    /// Asks for memory that will be read soon.
    fn prefetch<T>(place: &T);
}

/// 2^power / 255 for -118 < power < 127; anything else gives bits that the caller masks.
#[inline(always)]
pub fn alpha_of<V: Vector>(power: V) -> V {
    // Adding 1.5·2²³ rounds to a whole number and leaves it in the low bits.
    let magic = V::all(12_582_912.0);
    let shifted = power.add(magic);
    let part = power.sub(shifted.sub(magic));
    let mut sum = V::all(ALPHA_OF[5]);
    for k in (0..5).rev() {
        sum = sum.mul_add(part, V::all(ALPHA_OF[k]));
    }
    sum.scale_by(shifted)
}

/// Three values everywhere.
#[inline(always)]
pub fn all3<V: Vector>(values: &[f32; 3]) -> [V; 3] {
    [V::all(values[0]), V::all(values[1]), V::all(values[2])]
}

/// The scalar product.
#[inline(always)]
pub fn dot<V: Vector>(p: &[V; 3], q: &[V; 3]) -> V {
    p[0].mul_add(q[0], p[1].mul_add(q[1], p[2].mul(q[2])))
}

/// Whitened offsets (u, v) of a block's pixels from a splat's centre.
#[inline(always)]
pub fn whitened<V: Vector>(splat: &TileSplat, x: V, y: V) -> (V, V) {
    let row = V::all(splat.b).mul_add(y, V::all(splat.u0));
    let u = V::all(splat.a).mul_add(x, row);
    let v = V::all(splat.c).mul_add(y, V::all(splat.v0));
    (u, v)
}

/// log2(255 · alpha), in the order of operations of the forward kernel.
#[inline(always)]
pub fn power_at<V: Vector>(splat: &TileSplat, u: V, v: V) -> V {
    u.mul_sub_from(u, v.mul_sub_from(v, V::all(splat.power)))
}

/// The lanes of `bits` as a mask.
#[inline(always)]
pub fn mask_of<V: Vector>(bits: u32) -> V {
    of_lanes(|lane| f32::from_bits(0u32.wrapping_sub(bits >> lane & 1)))
}

/// A value from what each lane holds.
#[inline(always)]
pub fn of_lanes<V: Vector>(value: impl Fn(usize) -> f32) -> V {
    let mut lanes = V::Array::default();
    for (lane, to) in lanes.as_mut().iter_mut().enumerate() {
        *to = value(lane);
    }
    V::load(&lanes)
}
