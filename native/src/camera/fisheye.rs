//! The equidistant fisheye.

use crate::camera::angles::sine_and_cosine;
use crate::camera::cone;
use crate::camera::curvature::{Bend, Curved};
use crate::camera::lens::{Group, Lens, Projected};
use crate::camera::round::{can_see_round, project_round, sees_ball_round, RoundBend, RoundLens};
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

    #[inline(always)]
    fn centre(&self) -> [f64; 2] {
        self.centre
    }

    #[inline(always)]
    fn radius_and_slope(&self, angle: f64) -> [f64; 2] {
        [self.focal * angle, self.focal]
    }

    fn slopes(&self) -> [f64; 2] {
        [self.focal; 2]
    }
}

impl Lens for Fisheye {
    #[inline(always)]
    fn project(&self, p: [f64; 3]) -> Projected {
        project_round(self, p)
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
        cone::box_on_round(self, planes, mean)
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

    fn of_part(&self, corner: [f64; 2], _: [f64; 2], finer: f64) -> Self {
        Fisheye {
            focal: finer * self.focal,
            centre: std::array::from_fn(|axis| finer * (self.centre[axis] - corner[axis])),
            ..*self
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
        RoundBend {
            h,
            k,
            h_z,
            g_z: -1.0 / range_square,
            zz: [f * x * z * h_z, f * y * z * h_z],
            inverse_range: 1.0 / range_square.sqrt(),
        }
        .bend(f, p, first)
    }
}
