//! How a camera's Jacobian changes from place to place.

use crate::camera::{Fisheye, Lens, Pinhole};

/// Second derivatives of a projection.
#[derive(Clone, Copy, Debug)]
pub struct Bend {
    /// d (u, v) / d p; a pinhole's frozen Jacobian is not that.
    pub centre: [[f64; 3]; 2],
    /// `jacobian[row][column][axis]` = d J[row][column] / d p[axis], px per m².
    pub jacobian: [[[f64; 3]; 3]; 2],
    /// d depth / d p.
    pub depth: [f64; 3],
}

/// A lens that can be differentiated twice; free of branches like `Lens::project`.
pub trait Curved: Lens {
    fn bend(&self, p: [f64; 3]) -> Bend;
}

impl Curved for Pinhole {
    #[inline(always)]
    fn bend(&self, p: [f64; 3]) -> Bend {
        let z = if p[2] > 1e-9 { p[2] } else { 1.0 };
        let inverse = 1.0 / z;
        let mut jacobian = [[[0.0; 3]; 3]; 2];
        let mut centre = [[0.0; 3]; 2];
        for axis in 0..2 {
            let gain = self.focal[axis] * inverse * inverse;
            let tangent = p[axis] * inverse;
            let (low, high) = self.tangent_limits(axis);
            let frozen = tangent.max(low).min(high);
            let is_free = if frozen == tangent { 1.0 } else { 0.0 };
            centre[axis][axis] = self.focal[axis] * inverse;
            centre[axis][2] = -centre[axis][axis] * tangent;
            jacobian[axis][axis][2] = -gain;
            jacobian[axis][2][axis] = -gain * is_free;
            jacobian[axis][2][2] = gain * (frozen + is_free * tangent);
        }
        Bend {
            centre,
            jacobian,
            depth: [0.0, 0.0, 1.0],
        }
    }
}

impl Curved for Fisheye {
    /// With s = |(x, y)|, u = f·g(s, z)·x where g = θ / s; h = g_s / s and k = h_s / s.
    #[inline(always)]
    fn bend(&self, p: [f64; 3]) -> Bend {
        let [x, y, z] = p;
        let square = x * x + y * y;
        let range_square = square + z * z;
        let range_square = if range_square > 0.0 {
            range_square
        } else {
            1.0
        };
        let first = self.project(p).jacobian;
        // Near the axis the closed forms cancel; the series of atan(s/z)/s does not.
        let is_near_axis = z > 0.0 && square < 1e-6 * z * z;
        let safe = if is_near_axis { 1.0 } else { square };
        let safe = if safe > 0.0 { safe } else { 1.0 };
        let inverse_z = 1.0 / if is_near_axis { z } else { 1.0 };
        let ratio = square * inverse_z * inverse_z;
        let cube = inverse_z * inverse_z * inverse_z;
        // J00 + J11 = f (2g + s²h) and s²h = z/ρ² - g, so g follows from the first derivatives.
        let g = (first[0][0] + first[1][1]) / self.focal - z / range_square;
        let quartic = 1.0 / (range_square * range_square);
        let far_h = (z / range_square - g) / safe;
        let far_k = (-2.0 * z * quartic - 3.0 * far_h) / safe;
        let near_h = cube * (-2.0 / 3.0 + ratio * (4.0 / 5.0 - ratio * (6.0 / 7.0)));
        let near_k = cube * inverse_z * inverse_z * (8.0 / 5.0 - ratio * (24.0 / 7.0));
        let h = if is_near_axis { near_h } else { far_h };
        let k = if is_near_axis { near_k } else { far_k };
        let h_z = 2.0 * quartic;
        let f = self.focal;
        let xxx = f * x * (3.0 * h + x * x * k);
        let xxy = f * y * (h + x * x * k);
        let xyy = f * x * (h + y * y * k);
        let yyy = f * y * (3.0 * h + y * y * k);
        let xxz = f * (x * x * h_z - 1.0 / range_square);
        let xyz = f * x * y * h_z;
        let yyz = f * (y * y * h_z - 1.0 / range_square);
        let xzz = f * x * z * h_z;
        let yzz = f * y * z * h_z;
        let inverse_range = 1.0 / range_square.sqrt();
        Bend {
            centre: first,
            jacobian: [
                [[xxx, xxy, xxz], [xxy, xyy, xyz], [xxz, xyz, xzz]],
                [[xxy, xyy, xyz], [xyy, yyy, yyz], [xyz, yyz, yzz]],
            ],
            depth: p.map(|v| v * inverse_range),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    const FISHEYE: Fisheye = Fisheye {
        focal: 206.0,
        centre: [360.0, 355.0],
        max_angle: 1.75,
    };
    const PINHOLE: Pinhole = Pinhole {
        width: 640.0,
        height: 480.0,
        focal: [500.0, 510.0],
        centre: [310.0, 245.0],
    };

    pub(crate) fn check(lens: &impl Curved, p: [f64; 3]) {
        let step = 1e-5;
        let analytic = lens.bend(p);
        for axis in 0..3 {
            let (mut before, mut after) = (p, p);
            before[axis] -= step;
            after[axis] += step;
            let (a, b) = (lens.project(before), lens.project(after));
            let slopes = [(b.u - a.u) / (2.0 * step), (b.v - a.v) / (2.0 * step)];
            for (row, slope) in slopes.into_iter().enumerate() {
                assert!((slope - analytic.centre[row][axis]).abs() < 1e-4);
                for column in 0..3 {
                    let slope = (b.jacobian[row][column] - a.jacobian[row][column]) / (2.0 * step);
                    let error = (slope - analytic.jacobian[row][column][axis]).abs();
                    assert!(error < 2e-4, "{p:?} {row} {column} {axis}: {error}");
                }
            }
            let slope = (b.depth - a.depth) / (2.0 * step);
            assert!((slope - analytic.depth[axis]).abs() < 1e-8);
        }
    }

    #[test]
    fn bends_agree_with_differences() {
        for p in [[0.2, -0.3, 1.0], [0.01, 0.35, 0.7], [-0.1, 0.1, 3.0]] {
            check(&PINHOLE, p);
            check(&FISHEYE, p);
        }
        check(&PINHOLE, [3.0, -4.0, 1.5]);
        for p in [[1.0, 0.5, -0.2], [0.0, 1.0, 0.0], [1.2e-3, 0.0, 1.0]] {
            check(&FISHEYE, p);
        }
    }

    #[test]
    fn the_axis_is_not_special() {
        for s in [0.0, 1e-9, 1e-4, 0.9e-3, 1.1e-3, 1e-2] {
            let bend = FISHEYE.bend([s, 0.0, 2.0]);
            let xxx = bend.jacobian[0][0][0] / FISHEYE.focal;
            let wanted = -2.0 * s / 8.0;
            assert!(
                (xxx - wanted).abs() <= 1e-3 * wanted.abs() + 1e-12,
                "{s}: {xxx}"
            );
            assert!((bend.jacobian[0][0][2] / FISHEYE.focal + 0.25).abs() < 1e-4);
        }
    }
}
