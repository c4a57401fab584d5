//! The equidistant fisheye.

use crate::camera::angles::{angle_from, sine_and_cosine};
use crate::camera::cone;
use crate::camera::curvature::{Bend, Curved};
use crate::camera::lens::{Group, Lens, Projected};
use crate::camera::round::{can_see_round, sees_ball_round, RoundLens};
use crate::camera::window::{PixelBox, Window};

/// Equidistant fisheye: pixels off centre = focal · angle off axis, also beyond 90°.
#[derive(Clone, Copy, Debug)]
pub struct Fisheye {
    pub focal: f64,
    pub centre: [f64; 2],
    pub max_angle: f64,
}

impl RoundLens for Fisheye {
    #[inline(always)]
    fn max_angle(&self) -> f64 {
        self.max_angle
    }

    fn radius(&self, angle: f64) -> f64 {
        self.focal * angle
    }

    fn slopes(&self) -> [f64; 2] {
        [self.focal; 2]
    }
}

impl Lens for Fisheye {
    #[inline(always)]
    fn project(&self, p: [f64; 3]) -> Projected {
        let [x, y, z] = p;
        let off_axis_squared = x * x + y * y;
        let off_axis = off_axis_squared.sqrt();
        let range_squared = off_axis_squared + z * z;
        let angle = angle_from(off_axis, z);
        let on_axis = off_axis < 1e-12 * z;
        let safe = if on_axis { 1.0 } else { off_axis };
        let (ex, ey) = (
            if on_axis { 1.0 } else { x / safe },
            if on_axis { 0.0 } else { y / safe },
        );
        let radial = self.focal * z / range_squared;
        let tangential = if on_axis {
            self.focal / z
        } else {
            self.focal * angle / safe
        };
        let axial = -self.focal * off_axis / range_squared;
        let mixed = ex * ey * (radial - tangential);
        Projected {
            u: self.focal * angle * ex + self.centre[0],
            v: self.focal * angle * ey + self.centre[1],
            depth: range_squared.sqrt(),
            jacobian: [
                [ex * ex * radial + ey * ey * tangential, mixed, axial * ex],
                [mixed, ey * ey * radial + ex * ex * tangential, axial * ey],
            ],
            drawable: angle <= self.angle_limit(),
        }
    }

    #[inline(always)]
    fn ray(&self, u: f64, v: f64) -> [f64; 3] {
        let (x, y) = (
            (u - self.centre[0]) / self.focal,
            (v - self.centre[1]) / self.focal,
        );
        let (sine_per_angle, cosine) = sine_and_cosine((x * x + y * y).sqrt());
        [x * sine_per_angle, y * sine_per_angle, cosine]
    }

    fn focal(&self) -> f64 {
        self.focal
    }

    fn box_of_cone(&self, planes: &[[f64; 3]; 3], mean: &[f64; 3]) -> PixelBox {
        cone::box_on_round(self, self.centre, planes, mean)
    }

    fn sees_ball(&self, centre: &[f64; 3], radius: f64, window: &Window) -> bool {
        sees_ball_round(self, centre, radius, window)
    }

    fn can_see(&self, group: &Group, window: &Window) -> bool {
        can_see_round(self, group, window)
    }

    fn circle(&self) -> Option<(f64, [f64; 2])> {
        Some((self.focal * self.max_angle, self.centre))
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
