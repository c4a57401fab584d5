//! From the logarithm of an opacity to the opacity.

/// 2^power / 255 for -118 < power < 127; relative error 2e-7.
#[inline(always)]
pub(crate) fn alpha_of(power: f32) -> f32 {
    let whole = power.round_ties_even();
    let part = power - whole;
    let mut sum = ALPHA_OF[5];
    for k in (0..5).rev() {
        sum = sum * part + ALPHA_OF[k];
    }
    f32::from_bits(sum.to_bits().wrapping_add_signed((whole as i32) << 23))
}

/// Coefficients of 2^f / 255 on -½..½, constant term first (own minimax fit of 2^f).
pub const ALPHA_OF: [f32; 6] = [
    (1.000_000_072_0_f64 / 255.0) as f32,
    (0.693_146_967_1 / 255.0) as f32,
    (0.240_221_197_2 / 255.0) as f32,
    (0.055_507_132_74 / 255.0) as f32,
    (0.009_675_541_334 / 255.0) as f32,
    (0.001_327_647_198 / 255.0) as f32,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_is_close() {
        for i in -100..=800 {
            let power = i as f32 * 0.01;
            let wanted = f64::from(power).exp2() / 255.0;
            let error = f64::from(alpha_of(power)) / wanted - 1.0;
            assert!(error.abs() < 3e-7, "{power}: {error}");
        }
    }
}
