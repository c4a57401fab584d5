//! Real spherical harmonics to degree 3, in the order and with the signs of 3D Gaussian splatting.

use crate::scene::cloud::LANES;

/// Factors of the basis functions by degree, normalised over the sphere: C0 = 1 / (2 √π) and so on.
const C0: f32 = 0.282_094_8;
const C1: f32 = 0.488_602_5;
const C2: [f32; 5] = [
    1.092_548_5,
    -1.092_548_5,
    0.315_391_57,
    -1.092_548_5,
    0.546_274_24,
];
const C3: [f32; 7] = [
    -0.590_043_6,
    2.890_611_4,
    -0.457_045_8,
    0.373_176_34,
    -0.457_045_8,
    1.445_305_7,
    -0.590_043_6,
];

/// Colour of eight splats seen along unit directions, clamped below at 0.
///
/// `sh` holds three rows (red, green, blue) per coefficient; `count` of them (1, 4, 9 or 16) are
/// used. `direction` points from the camera to the splat, in the splats' own frame.
#[inline(always)]
pub fn colours(
    sh: &[[f32; LANES]],
    count: usize,
    direction: &[[f32; LANES]; 3],
) -> [[f32; LANES]; 3] {
    let mut basis = [[0.0f32; LANES]; 16];
    for lane in 0..LANES {
        let [x, y, z] = [direction[0][lane], direction[1][lane], direction[2][lane]];
        let (xx, yy, zz) = (x * x, y * y, z * z);
        basis[0][lane] = C0;
        basis[1][lane] = -C1 * y;
        basis[2][lane] = C1 * z;
        basis[3][lane] = -C1 * x;
        basis[4][lane] = C2[0] * x * y;
        basis[5][lane] = C2[1] * y * z;
        basis[6][lane] = C2[2] * (2.0 * zz - xx - yy);
        basis[7][lane] = C2[3] * x * z;
        basis[8][lane] = C2[4] * (xx - yy);
        basis[9][lane] = C3[0] * y * (3.0 * xx - yy);
        basis[10][lane] = C3[1] * x * y * z;
        basis[11][lane] = C3[2] * y * (4.0 * zz - xx - yy);
        basis[12][lane] = C3[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
        basis[13][lane] = C3[4] * x * (4.0 * zz - xx - yy);
        basis[14][lane] = C3[5] * z * (xx - yy);
        basis[15][lane] = C3[6] * x * (xx - 3.0 * yy);
    }
    let mut colour = [[0.5f32; LANES]; 3];
    for (rows, weight) in sh.chunks_exact(3).zip(&basis).take(count) {
        for channel in 0..3 {
            for lane in 0..LANES {
                colour[channel][lane] += weight[lane] * rows[channel][lane];
            }
        }
    }
    colour.map(|channel| channel.map(|v| v.max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn basis_is_orthonormal() {
        // Monte-Carlo-free check: integrate products over a fine latitude-longitude grid.
        let (rows, columns) = (120, 240);
        let mut gram = [[0.0f64; 16]; 16];
        for i in 0..rows {
            let theta = (i as f64 + 0.5) / rows as f64 * std::f64::consts::PI;
            for j in 0..columns {
                let phi = j as f64 / columns as f64 * 2.0 * std::f64::consts::PI;
                let area = theta.sin()
                    * (std::f64::consts::PI / rows as f64)
                    * (2.0 * std::f64::consts::PI / columns as f64);
                let d = [
                    theta.sin() * phi.cos(),
                    theta.sin() * phi.sin(),
                    theta.cos(),
                ];
                let values: [f64; 16] = std::array::from_fn(|k| {
                    let mut sh = [[0.0f32; LANES]; 48];
                    sh[3 * k] = [1.0; LANES];
                    let shifted = colours(&sh, 16, &d.map(|v| [v as f32; LANES]))[0][0];
                    sh[3 * k] = [-1.0; LANES];
                    let mirrored = colours(&sh, 16, &d.map(|v| [v as f32; LANES]))[0][0];
                    // One of the two is clamped at 0; the other is 0.5 + |basis| or both are exact.
                    if shifted >= mirrored {
                        f64::from(shifted) - 0.5
                    } else {
                        0.5 - f64::from(mirrored)
                    }
                });
                for a in 0..16 {
                    for b in 0..16 {
                        gram[a][b] += values[a] * values[b] * area;
                    }
                }
            }
        }
        for (a, row) in gram.iter().enumerate() {
            for (b, value) in row.iter().enumerate() {
                let wanted = f64::from(u8::from(a == b));
                assert!((value - wanted).abs() < 2e-3, "{a} {b}: {value}");
            }
        }
    }
}
