//! Powers of e and their logarithms to five digits, without a branch: several are done at once.

/// e^x for x <= 0 to 1e-5, without a branch, so that several are done at once.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let power = (x * std::f32::consts::LOG2_E).max(-126.0);
    let shifted = power + 12_582_912.0;
    let part = power - (shifted - 12_582_912.0);
    let series = 1.0
        + part
            * (std::f32::consts::LN_2
                + part
                    * (0.240_226_5
                        + part * (0.055_504_1 + part * (0.009_618_1 + part * 0.001_333_4))));
    f32::from_bits(series.to_bits().wrapping_add(shifted.to_bits() << 23))
}

/// The natural logarithm of a positive number to 1e-5, without a branch.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    let bits = x.to_bits();
    // The mantissa is taken between 1/√2 and √2, where the series is short.
    let exponent = (bits.wrapping_sub(0x3f35_04f3) as i32) >> 23;
    let mantissa = f32::from_bits(bits.wrapping_sub((exponent << 23) as u32));
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s2 = s * s;
    let series = 2.0 * s * (1.0 + s2 * (1.0 / 3.0 + s2 * (0.2 + s2 * (1.0 / 7.0))));
    exponent as f32 * std::f32::consts::LN_2 + series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_and_logarithms_are_right_to_five_digits() {
        for k in 0..4000 {
            let x = k as f32 * 0.01;
            assert!((exp(-x) - (-x).exp()).abs() < 1e-5, "exp(-{x})");
            let x = 0.02 + x;
            assert!((ln(x) - x.ln()).abs() < 2e-5, "ln({x})");
        }
    }
}
