//! Spherical harmonics to degree 3 and how they change with the direction.

/// Basis values in the order of `sh::colours`, and their derivatives as polynomials in (x, y, z).
#[inline(always)]
pub fn basis_and_slopes(d: [f64; 3]) -> ([f64; 16], [[f64; 3]; 16]) {
    const C0: f64 = 0.282_094_791_773_878_14;
    const C1: f64 = 0.488_602_511_902_919_9;
    const C2: [f64; 3] = [
        1.092_548_430_592_079_2,
        0.315_391_565_252_520_05,
        0.546_274_215_296_039_6,
    ];
    const C3: [f64; 5] = [
        0.590_043_589_926_643_5,
        2.890_611_442_640_554,
        0.457_045_799_464_465_8,
        0.373_176_332_590_115_4,
        1.445_305_721_320_277,
    ];
    let [x, y, z] = d;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let values = [
        C0,
        -C1 * y,
        C1 * z,
        -C1 * x,
        C2[0] * x * y,
        -C2[0] * y * z,
        C2[1] * (2.0 * zz - xx - yy),
        -C2[0] * x * z,
        C2[2] * (xx - yy),
        -C3[0] * y * (3.0 * xx - yy),
        C3[1] * x * y * z,
        -C3[2] * y * (4.0 * zz - xx - yy),
        C3[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -C3[2] * x * (4.0 * zz - xx - yy),
        C3[4] * z * (xx - yy),
        -C3[0] * x * (xx - 3.0 * yy),
    ];
    let scaled = |c: f64, slope: [f64; 3]| slope.map(|v| c * v);
    let slopes = [
        [0.0; 3],
        [0.0, -C1, 0.0],
        [0.0, 0.0, C1],
        [-C1, 0.0, 0.0],
        scaled(C2[0], [y, x, 0.0]),
        scaled(-C2[0], [0.0, z, y]),
        scaled(C2[1], [-2.0 * x, -2.0 * y, 4.0 * z]),
        scaled(-C2[0], [z, 0.0, x]),
        scaled(C2[2], [2.0 * x, -2.0 * y, 0.0]),
        scaled(-C3[0], [6.0 * x * y, 3.0 * (xx - yy), 0.0]),
        scaled(C3[1], [y * z, x * z, x * y]),
        scaled(
            -C3[2],
            [-2.0 * x * y, 4.0 * zz - xx - 3.0 * yy, 8.0 * y * z],
        ),
        scaled(
            C3[3],
            [-6.0 * x * z, -6.0 * y * z, 6.0 * zz - 3.0 * (xx + yy)],
        ),
        scaled(
            -C3[2],
            [4.0 * zz - 3.0 * xx - yy, -2.0 * x * y, 8.0 * x * z],
        ),
        scaled(C3[4], [2.0 * x * z, -2.0 * y * z, xx - yy]),
        scaled(-C3[0], [3.0 * (xx - yy), -6.0 * x * y, 0.0]),
    ];
    (values, slopes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::cloud::LANES;
    use crate::scene::sh;

    #[test]
    fn values_are_those_of_the_forward_pass_and_slopes_theirs() {
        let d = [0.48, -0.6, 0.64];
        let (values, slopes) = basis_and_slopes(d);
        for k in 0..16 {
            let mut rows = [[0.0f32; LANES]; 48];
            rows[3 * k] = [0.1; LANES];
            let colour = sh::colours(&rows, 16, &d.map(|v| [v as f32; LANES]))[0][0];
            assert!(
                (f64::from(colour) - 0.5 - 0.1 * values[k]).abs() < 1e-6,
                "{k}"
            );
            for axis in 0..3 {
                let step = 1e-6;
                let (mut before, mut after) = (d, d);
                before[axis] -= step;
                after[axis] += step;
                let numeric =
                    (basis_and_slopes(after).0[k] - basis_and_slopes(before).0[k]) / (2.0 * step);
                assert!((numeric - slopes[k][axis]).abs() < 1e-8, "{k} {axis}");
            }
        }
    }
}
