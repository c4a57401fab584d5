//! Angles, sines and cosines as lenses need them: without branches, several at once.

/// Angle between two vectors.
pub(crate) fn angle_between(p: [f64; 3], q: [f64; 3]) -> f64 {
    let cross = [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ];
    let length = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    length(cross).atan2(p[0] * q[0] + p[1] * q[1] + p[2] * q[2])
}

/// sin(angle) / angle and cos(angle) for 0 <= angle <= π to the last digits, without branches.
#[inline(always)]
pub(crate) fn sine_and_cosine(angle: f64) -> (f64, f64) {
    // Taylor series of the half angle, whose square is below 2.5: the next term is below 1e-16.
    const TERMS: usize = 11;
    /// 1 / (2k (2k + 1)) and 1 / (2k (2k - 1)): a division takes several times as long.
    const FACTORS: [[f64; 2]; TERMS] = {
        let mut factors = [[0.0; 2]; TERMS];
        let mut k = 1;
        while k < TERMS {
            let even = (2 * k) as f64;
            factors[k] = [1.0 / (even * (even + 1.0)), 1.0 / (even * (even - 1.0))];
            k += 1;
        }
        factors
    };
    let square = 0.25 * angle * angle;
    let (mut sine, mut cosine) = (1.0, 1.0);
    for k in (1..TERMS).rev() {
        sine = 1.0 - square * FACTORS[k][0] * sine;
        cosine = 1.0 - square * FACTORS[k][1] * cosine;
    }
    (sine * cosine, 1.0 - 2.0 * square * sine * sine)
}

/// atan2(y, x) for y >= 0, within 2 ulp, without branches.
#[inline(always)]
pub(crate) fn angle_from(y: f64, x: f64) -> f64 {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    const TAN_PI_8: f64 = 0.414_213_562_373_095_03;
    // Chebyshev fit of atan(t)/t in t² on 0..tan²(π/8), relative error 2e-15.
    const C: [f64; 10] = [
        1.000_000_000_000_000_2,
        -3.333_333_333_329_467e-1,
        1.999_999_998_647_968e-1,
        -1.428_571_301_865_044_5e-1,
        1.111_105_687_380_593_3e-1,
        -9.089_630_782_611_68e-2,
        7.674_261_106_926_13e-2,
        -6.508_854_136_539_335e-2,
        5.030_155_788_624_033e-2,
        -2.534_576_155_012_43e-2,
    ];
    let size = x.abs();
    let (low, high) = (y.min(size), y.max(size));
    let ratio = low / if high > 0.0 { high } else { 1.0 };
    let turned = ratio > TAN_PI_8;
    let t = if turned {
        (ratio - 1.0) / (ratio + 1.0)
    } else {
        ratio
    };
    let z = t * t;
    let mut sum = C[9];
    for k in (0..9).rev() {
        sum = sum * z + C[k];
    }
    let small = t * sum + if turned { FRAC_PI_4 } else { 0.0 };
    let first_quadrant = if y > size { FRAC_PI_2 - small } else { small };
    if x < 0.0 {
        PI - first_quadrant
    } else {
        first_quadrant
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angle_agrees_with_the_library() {
        for i in 0..=4000 {
            let angle = f64::from(i) / 4000.0 * std::f64::consts::PI;
            let (y, x) = angle.sin_cos();
            let (y, x) = (3.7 * y.max(0.0), 3.7 * x);
            assert!((angle_from(y, x) - y.atan2(x)).abs() < 2e-15, "{angle}");
        }
        assert_eq!(angle_from(0.0, 0.0), 0.0);
    }

    #[test]
    fn sines_agree_with_the_library() {
        for i in 1..=1000 {
            let angle = f64::from(i) / 1000.0 * std::f64::consts::PI;
            let (sine, cosine) = sine_and_cosine(angle);
            assert!((sine * angle - angle.sin()).abs() < 1e-14, "{angle}");
            assert!((cosine - angle.cos()).abs() < 1e-14, "{angle}");
        }
    }
}
