//! The fisheye with coefficients: r = f·d(θ), d = θ + k1·θ³ + k2·θ⁵ + k3·θ⁷ + k4·θ⁹ (Kannala and
//! Brandt 2006), beyond the largest angle along its tangent.

use crate::camera::angles::{angle_from, sine_and_cosine};
use crate::camera::cone;
use crate::camera::curvature::{Bend, Curved};
use crate::camera::lens::{Group, Lens, Projected};
use crate::camera::round::{can_see_round, project_round, sees_ball_round, RoundBend, RoundLens};
use crate::camera::window::{PixelBox, Window};

/// Intervals of the table that the inverse of d starts from.
const INTERVALS: usize = 256;
/// Most steps of Newton's method for an angle of the table: three from one interval away, more where
/// d hardly grows.
const STEPS: usize = 20;
/// Step, radians, from which an angle of the table is exact: a hundredth of what single precision
/// resolves of its pixel.
const EXACT: f64 = 1e-12;

#[derive(Clone, Debug)]
pub struct KannalaBrandt {
    pub focal: f64,
    pub centre: [f64; 2],
    max_angle: f64,
    /// 1, k1, k2, k3, k4.
    coefficients: [f64; 5],
    /// d and d' at the largest angle.
    edge: f64,
    edge_slope: f64,
    /// Bounds of d', a hair generously.
    slopes: [f64; 2],
    /// Angles at equal steps of d from 0 to `edge`.
    angles: Vec<f64>,
}

/// d, d' and d'' / θ at an angle.
struct Growth {
    value: f64,
    slope: f64,
    bend: f64,
}

impl KannalaBrandt {
    /// d must grow up to `max_angle`; `scenes.cameras` has checked that it does.
    pub fn new(focal: f64, centre: [f64; 2], max_angle: f64, [a, b, c, d]: [f64; 4]) -> Self {
        let mut lens = KannalaBrandt {
            focal,
            centre,
            max_angle,
            coefficients: [1.0, a, b, c, d],
            edge: 0.0,
            edge_slope: 0.0,
            slopes: [1.0; 2],
            angles: Vec::new(),
        };
        let edge = lens.growth_inside(max_angle);
        (lens.edge, lens.edge_slope) = (edge.value, edge.slope);
        let (mut angle, mut slope) = (0.0, 1.0);
        for k in 0..=INTERVALS {
            let step = if k > 0 {
                lens.edge / INTERVALS as f64
            } else {
                0.0
            };
            let value = lens.edge * k as f64 / INTERVALS as f64;
            (angle, slope) = lens.solved(value, angle + step / slope);
            lens.slopes = [lens.slopes[0].min(slope), lens.slopes[1].max(slope)];
            lens.angles.push(angle);
        }
        lens.slopes = [0.99 * lens.slopes[0], 1.01 * lens.slopes[1]];
        lens
    }

    #[inline(always)]
    fn growth_inside(&self, angle: f64) -> Growth {
        let square = angle * angle;
        let (mut value, mut slope, mut bend) = (0.0, 0.0, 0.0);
        for (n, &k) in self.coefficients.iter().enumerate().rev() {
            let power = (2 * n + 1) as f64;
            value = value * square + k;
            slope = slope * square + power * k;
            if n > 0 {
                bend = bend * square + power * (power - 1.0) * k;
            }
        }
        Growth {
            value: value * angle,
            slope,
            bend,
        }
    }

    #[inline(always)]
    fn growth(&self, angle: f64) -> Growth {
        let inside = self.growth_inside(angle.min(self.max_angle));
        let beyond = (angle - self.max_angle).max(0.0);
        Growth {
            value: inside.value + beyond * inside.slope,
            slope: inside.slope,
            bend: if beyond > 0.0 { 0.0 } else { inside.bend },
        }
    }

    /// The angle of a value of d within the lens, and d' there: by Newton's method from a near angle.
    fn solved(&self, value: f64, near: f64) -> (f64, f64) {
        let (mut angle, mut slope) = (near, 1.0);
        for _ in 0..STEPS {
            let growth = self.growth_inside(angle);
            let step = (growth.value - value) / growth.slope;
            (angle, slope) = ((angle - step).clamp(0.0, self.max_angle), growth.slope);
            if step.abs() < EXACT {
                break;
            }
        }
        (angle, slope)
    }

    /// The angle of any value of d: from the table, by Newton's method.
    fn angle_of(&self, value: f64) -> f64 {
        if value >= self.edge {
            return self.max_angle + (value - self.edge) / self.edge_slope;
        }
        let place = value / self.edge * INTERVALS as f64;
        let interval = (place as usize).min(INTERVALS - 1);
        let [low, high] = [self.angles[interval], self.angles[interval + 1]];
        let mut angle = low + (place - interval as f64) * (high - low);
        for _ in 0..4 {
            let growth = self.growth_inside(angle);
            angle = (angle - (growth.value - value) / growth.slope).clamp(low, high);
        }
        angle
    }
}

impl RoundLens for KannalaBrandt {
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
        let growth = self.growth(angle);
        [self.focal * growth.value, self.focal * growth.slope]
    }

    fn slopes(&self) -> [f64; 2] {
        self.slopes.map(|slope| self.focal * slope)
    }
}

impl Lens for KannalaBrandt {
    #[inline(always)]
    fn project(&self, p: [f64; 3]) -> Projected {
        project_round(self, p)
    }

    fn ray(&self, u: f64, v: f64) -> [f64; 3] {
        let (x, y) = (
            (u - self.centre[0]) / self.focal,
            (v - self.centre[1]) / self.focal,
        );
        let value = (x * x + y * y).sqrt();
        let angle = self.angle_of(value);
        let (sine_per_angle, cosine) = sine_and_cosine(angle);
        let per_value = sine_per_angle * if value > 0.0 { angle / value } else { 1.0 };
        [x * per_value, y * per_value, cosine]
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
        Some((self.focal * self.edge, self.centre))
    }

    /// Angles stay what they are, so the tables do.
    fn of_part(&self, corner: [f64; 2], _: [f64; 2], finer: f64) -> Self {
        KannalaBrandt {
            focal: finer * self.focal,
            centre: std::array::from_fn(|axis| finer * (self.centre[axis] - corner[axis])),
            ..self.clone()
        }
    }
}

impl Curved for KannalaBrandt {
    /// With s = |(x, y)| and ρ the range, u = f·g(s, z)·x where g = d / s; h = g_s / s, k = h_s / s.
    /// The equidistant lens is the special case d = θ.
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
        let quartic = 1.0 / (range_square * range_square);
        let off_axis = square.sqrt();
        let angle = angle_from(off_axis, z);
        let growth = self.growth(angle);
        let (slope, inverse_square) = (growth.slope, 1.0 / range_square);
        // Near the axis the closed forms cancel; the series in s/z does not.
        let is_near_axis = z > 0.0 && square < 1e-6 * z * z;
        let safe = if is_near_axis || square == 0.0 {
            1.0
        } else {
            square
        };
        let inverse_z = 1.0 / if is_near_axis { z } else { 1.0 };
        let angle_per_off_axis = if is_near_axis {
            inverse_z
        } else {
            angle / safe.sqrt()
        };
        // d'' / s.
        let bend = growth.bend * angle_per_off_axis;
        let far_g = growth.value / safe.sqrt();
        let far_h = (slope * z * inverse_square - far_g) / safe;
        let far_k = (bend * z * z * quartic - 2.0 * slope * z * quartic - 3.0 * far_h) / safe;
        let [_, k1, k2, k3, _] = self.coefficients;
        let c1 = k1 - 1.0 / 3.0;
        let c2 = 1.0 / 5.0 - k1 + k2;
        let c3 = -1.0 / 7.0 + 14.0 / 15.0 * k1 - 5.0 / 3.0 * k2 + k3;
        let ratio = square * inverse_z * inverse_z;
        let cube = inverse_z * inverse_z * inverse_z;
        let near_h = cube * (2.0 * c1 + ratio * (4.0 * c2 + ratio * 6.0 * c3));
        let near_k = cube * inverse_z * inverse_z * (8.0 * c2 + ratio * 24.0 * c3);
        let h = if is_near_axis { near_h } else { far_h };
        let k = if is_near_axis { near_k } else { far_k };
        let g_z = -slope * inverse_square;
        let g_zz = bend * square * quartic + 2.0 * slope * z * quartic;
        let h_z = 2.0 * slope * quartic - bend * z * quartic;
        let f = self.focal;
        RoundBend {
            h,
            k,
            h_z,
            g_z,
            zz: [f * x * g_zz, f * y * g_zz],
            inverse_range: inverse_square.sqrt(),
        }
        .bend(f, p, self.project(p).jacobian)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::checks::{check_bend, check_culling, check_jacobian, check_rays};
    use crate::camera::fisheye::Fisheye;

    fn lens() -> KannalaBrandt {
        KannalaBrandt::new(206.0, [360.0, 355.0], 1.75, [-0.05, 0.01, -0.004, 0.0006])
    }

    #[test]
    fn derivatives_agree_with_differences() {
        for p in [
            [0.2, -0.3, 1.0],
            [0.01, 0.35, 0.7],
            [-0.1, 0.1, 3.0],
            [1.0, 0.5, -0.1],
            [0.0, 1.0, 0.0],
            [1.2e-3, 0.0, 1.0],
            [0.9e-3, 0.2e-3, 1.0],
            [0.0, 0.0, 2.0],
            [1.0, 0.5, -0.5],
        ] {
            check_jacobian(&lens(), p);
            check_bend(&lens(), p);
        }
    }

    #[test]
    fn rays_are_projected_where_they_came_from() {
        check_rays(&lens());
    }

    #[test]
    fn nothing_that_touches_the_picture_is_culled() {
        check_culling(&lens(), &Window::whole(720, 720));
        let window = Window {
            left: 500,
            top: 200,
            right: 560,
            bottom: 230,
            is_part: true,
        };
        check_culling(&lens(), &window);
    }

    #[test]
    fn the_table_has_the_angles_of_its_steps_however_little_d_grows() {
        for coefficients in [[0.02, -0.01, 0.001, 0.0], [-0.105, 0.0, 0.0, 0.0]] {
            let lens = KannalaBrandt::new(400.0, [0.0, 0.0], 1.75, coefficients);
            assert_eq!(lens.angles.len(), INTERVALS + 1);
            for (k, &angle) in lens.angles.iter().enumerate() {
                let value = lens.edge * k as f64 / INTERVALS as f64;
                assert!((lens.growth_inside(angle).value - value).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn without_coefficients_it_is_the_equidistant_lens() {
        let plain = Fisheye {
            focal: 206.0,
            centre: [360.0, 355.0],
            max_angle: 1.75,
        };
        let lens = KannalaBrandt::new(206.0, [360.0, 355.0], 1.75, [0.0; 4]);
        for p in [[0.2, -0.3, 1.0], [1.0, 0.5, -0.2], [1e-4, 0.0, 1.0]] {
            let (a, b) = (plain.bend(p), lens.bend(p));
            for row in 0..2 {
                for column in 0..3 {
                    for axis in 0..3 {
                        let (a, b) = (a.jacobian[row][column][axis], b.jacobian[row][column][axis]);
                        assert!((a - b).abs() <= 1e-7 * (1.0 + a.abs()), "{a} {b}");
                    }
                }
            }
            assert!((plain.project(p).u - lens.project(p).u).abs() < 1e-10);
        }
    }
}
