//! Camera models: where a point falls, how the picture moves with it, and which chunks can be seen.

use crate::angles::{angle_from, sine_and_cosine};
use crate::cone::{self, PixelBox};
use crate::round_lens::{can_see_round, sees_ball_round, RoundLens};
use crate::scope::Window;

/// Share of the picture's width (height) beyond its border at which the pinhole Jacobian is frozen.
const JACOBIAN_MARGIN: f64 = 0.15;
/// sqrt(2 ln 255): standard deviations at which a splat of opacity 1 fades below 1/255.
pub(crate) const VISIBLE_SIGMAS: f64 = 3.33;
/// Added to the diagonal of every projected covariance, px².
pub const LOW_PASS: f64 = 0.3;

/// Focal lengths outside this, px, are refused before they come here: single precision holds neither
/// the squares of such a picture's slopes nor, beyond the largest, single pixels.
pub const FOCAL_PX: [f64; 2] = [1e-3, 1e7];
/// Principal points further than this, px, from the picture's corner are refused too: within this,
/// single precision tells pixels apart.
pub const MAX_CENTRE_PX: f64 = 1e7;

/// A point seen by a camera.
#[derive(Clone, Copy)]
pub struct Projected {
    /// Pixels; the first pixel's centre is (0.5, 0.5).
    pub u: f64,
    pub v: f64,
    /// z for a pinhole, distance for a fisheye; what the near limit and the sort use.
    pub depth: f64,
    /// d(u, v) / d(x, y, z), px per metre.
    pub jacobian: [[f64; 3]; 2],
    pub drawable: bool,
}

/// Splats whose means lie in a sphere, in camera axes; metres.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    pub centre: [f64; 3],
    pub radius: f64,
    /// Largest standard deviation of any.
    pub max_scale: f64,
    /// Means nearer than this are not drawn.
    pub near: f64,
}

/// A lens: all kinds share the pipeline, which is compiled once for each.
pub trait Lens: Sync {
    /// Projects a point in camera axes (x right, y down, z forward). Free of branches, so that the
    /// compiler can do several points at once.
    fn project(&self, p: [f64; 3]) -> Projected;

    /// The direction seen at a point of the picture; of any length.
    fn ray(&self, u: f64, v: f64) -> [f64; 3];

    /// Pixels per radian on the axis.
    fn focal(&self) -> f64;

    /// A box of the picture that holds the silhouette of an ellipsoid about `mean`; see `cone`.
    fn box_of_cone(&self, planes: &[[f64; 3]; 3], mean: &[f64; 3]) -> PixelBox;

    /// False only if no ray through the window meets the ball.
    fn sees_ball(&self, centre: &[f64; 3], radius: f64, window: &Window) -> bool;

    /// False only if no splat of the group can touch the window.
    fn can_see(&self, group: &Group, window: &Window) -> bool;

    /// Radius of the lens circle in pixels and its centre, or None if the picture is filled.
    fn circle(&self) -> Option<(f64, [f64; 2])>;
}

/// u = fx·x/z + cx.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    pub width: f64,
    pub height: f64,
    pub focal: [f64; 2],
    pub centre: [f64; 2],
}

impl Pinhole {
    /// Range of x/z (y/z) outside which the Jacobian is frozen.
    #[inline(always)]
    pub(crate) fn tangent_limits(&self, axis: usize) -> (f64, f64) {
        let size = if axis == 0 { self.width } else { self.height };
        let margin = JACOBIAN_MARGIN * size;
        (
            (-margin - self.centre[axis]) / self.focal[axis],
            (size + margin - self.centre[axis]) / self.focal[axis],
        )
    }
}

impl Lens for Pinhole {
    #[inline(always)]
    fn project(&self, p: [f64; 3]) -> Projected {
        let in_front = p[2] > 1e-9;
        let z = if in_front { p[2] } else { 1.0 };
        let (tx, ty) = (p[0] / z, p[1] / z);
        let (x_low, x_high) = self.tangent_limits(0);
        let (y_low, y_high) = self.tangent_limits(1);
        let (jx, jy) = (self.focal[0] / z, self.focal[1] / z);
        Projected {
            u: self.focal[0] * tx + self.centre[0],
            v: self.focal[1] * ty + self.centre[1],
            depth: p[2],
            jacobian: [
                [jx, 0.0, -jx * tx.max(x_low).min(x_high)],
                [0.0, jy, -jy * ty.max(y_low).min(y_high)],
            ],
            drawable: in_front,
        }
    }

    #[inline(always)]
    fn ray(&self, u: f64, v: f64) -> [f64; 3] {
        [
            (u - self.centre[0]) / self.focal[0],
            (v - self.centre[1]) / self.focal[1],
            1.0,
        ]
    }

    fn focal(&self) -> f64 {
        (self.focal[0] * self.focal[1]).sqrt()
    }

    fn box_of_cone(&self, planes: &[[f64; 3]; 3], mean: &[f64; 3]) -> PixelBox {
        cone::box_on_pinhole(self, planes, mean)
    }

    fn sees_ball(&self, centre: &[f64; 3], radius: f64, window: &Window) -> bool {
        // Distance from the planes through the eye and the window's sides, inside counted positive.
        (0..2).all(|axis| {
            let (start, end) = match axis {
                0 => (window.left, window.right),
                _ => (window.top, window.bottom),
            };
            let tangent = |pixel: usize| (pixel as f64 - self.centre[axis]) / self.focal[axis];
            let (low, high) = (tangent(start), tangent(end));
            centre[axis] - low * centre[2] >= -radius * low.hypot(1.0)
                && high * centre[2] - centre[axis] >= -radius * high.hypot(1.0)
        })
    }

    fn can_see(&self, group: &Group, window: &Window) -> bool {
        let Group { centre, radius, .. } = *group;
        let z_high = centre[2] + radius;
        if z_high < group.near {
            return false;
        }
        let z_low = (centre[2] - radius).max(group.near);
        (0..2).all(|axis| {
            let (low, high) = self.tangent_limits(axis);
            let slope = low.abs().max(high.abs());
            let gain = self.focal[axis] * group.max_scale / z_low;
            let deviation = (gain * gain * (1.0 + slope * slope) + LOW_PASS).sqrt();
            let reach = VISIBLE_SIGMAS * deviation;
            let (start, end) = match axis {
                0 => (window.left, window.right),
                _ => (window.top, window.bottom),
            };
            let at = |offset: f64, z: f64| self.focal[axis] * offset / z + self.centre[axis];
            let (first, last) = (centre[axis] - radius, centre[axis] + radius);
            at(last, z_low).max(at(last, z_high)) + reach >= start as f64
                && at(first, z_low).min(at(first, z_high)) - reach <= end as f64
        })
    }

    fn circle(&self) -> Option<(f64, [f64; 2])> {
        None
    }
}

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

    pub(crate) fn check_jacobian(lens: &impl Lens, p: [f64; 3]) {
        let step = 1e-6;
        let analytic = lens.project(p).jacobian;
        for axis in 0..3 {
            let (mut before, mut after) = (p, p);
            before[axis] -= step;
            after[axis] += step;
            let (a, b) = (lens.project(before), lens.project(after));
            let numeric = [(b.u - a.u) / (2.0 * step), (b.v - a.v) / (2.0 * step)];
            for row in 0..2 {
                let error = (numeric[row] - analytic[row][axis]).abs();
                assert!(error < 1e-4, "{p:?} {row} {axis}: {error}");
            }
        }
    }

    #[test]
    fn jacobians_agree_with_differences() {
        for p in [[0.2, -0.3, 1.0], [0.01, 0.35, 0.7], [-0.1, 0.1, 3.0]] {
            check_jacobian(&PINHOLE, p);
            check_jacobian(&FISHEYE, p);
        }
        for p in [[1.0, 0.5, -0.2], [0.0, 1.0, 0.0], [1e-5, 0.0, 1.0]] {
            check_jacobian(&FISHEYE, p);
        }
    }

    #[test]
    fn chunks_in_view_are_kept_and_chunks_behind_dropped() {
        let window = Window::whole(640, 480);
        let group = |centre, max_scale| Group {
            centre,
            radius: 0.1,
            max_scale,
            near: 0.05,
        };
        assert!(PINHOLE.can_see(&group([0.0, 0.0, 2.0], 0.01), &window));
        assert!(!PINHOLE.can_see(&group([0.0, 0.0, -2.0], 0.01), &window));
        assert!(!PINHOLE.can_see(&group([9.0, 0.0, 2.0], 0.01), &window));
        assert!(PINHOLE.can_see(&group([9.0, 0.0, 2.0], 3.0), &window));
        assert!(FISHEYE.can_see(&group([1.0, 0.0, -0.1], 0.01), &window));
        assert!(!FISHEYE.can_see(&group([0.3, 0.0, -2.0], 0.01), &window));
    }

    /// Whether the 1/255 ellipse of a round splat of opacity 1 may reach a pixel that is drawn: its
    /// box does, and the circle around it.
    fn touches(lens: &impl Lens, group: &Group, window: &Window) -> bool {
        let seen = lens.project(group.centre);
        let reach = seen.jacobian.map(|row| {
            let gain = row.iter().map(|v| v * v).sum::<f64>();
            let variance = gain * group.max_scale.powi(2) + LOW_PASS;
            (2.0 * 255f64.ln() * variance).sqrt()
        });
        let inside = |at: f64, reach: f64, start: usize, end: usize| {
            at + reach >= start as f64 + 0.5 && at - reach <= end as f64 - 0.5
        };
        let [first, second] = seen.jacobian;
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (xx, xy, yy) = (dot(first, first), dot(first, second), dot(second, second));
        let widest = 0.5 * (xx + yy) + (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
        let variance = widest * group.max_scale.powi(2) + LOW_PASS;
        let circle_px = (2.0 * 255f64.ln() * variance).sqrt();
        let gap = |at: f64, start: usize, end: usize| {
            (start as f64 + 0.5 - at)
                .max(at - end as f64 + 0.5)
                .max(0.0)
        };
        let off_window =
            gap(seen.u, window.left, window.right).hypot(gap(seen.v, window.top, window.bottom));
        let in_circle = lens.circle().is_none_or(|(radius, centre)| {
            // Measured against the box's nearest side only: a lower bound of the true distance.
            let off = ((seen.u - centre[0]).powi(2) + (seen.v - centre[1]).powi(2)).sqrt();
            off - reach[0].min(reach[1]) <= radius
        });
        seen.drawable
            && seen.depth >= group.near
            && inside(seen.u, reach[0], window.left, window.right)
            && inside(seen.v, reach[1], window.top, window.bottom)
            && off_window <= circle_px
            && in_circle
    }

    pub(crate) fn random() -> impl FnMut() -> f64 {
        let mut state = 3u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    pub(crate) fn check_culling(lens: &impl Lens, window: &Window) {
        let mut next = random();
        let mut culled = 0;
        for _ in 0..200_000 {
            let group = Group {
                centre: [8.0 * next() - 4.0, 8.0 * next() - 4.0, 6.0 * next() - 3.0],
                radius: 0.0,
                max_scale: 10f64.powf(3.0 * next() - 3.0),
                near: 0.05,
            };
            let is_kept = lens.can_see(&group, window);
            assert!(is_kept || !touches(lens, &group, window), "{group:?}");
            culled += usize::from(!is_kept);
        }
        assert!(culled > 20_000, "{culled}");
    }

    #[test]
    fn nothing_that_touches_the_picture_is_culled() {
        check_culling(&PINHOLE, &Window::whole(640, 480));
        check_culling(&FISHEYE, &Window::whole(720, 720));
        for (left, top) in [(0, 0), (300, 310), (600, 40)] {
            let window = Window {
                left,
                top,
                right: left + 40,
                bottom: top + 90,
                is_part: true,
            };
            check_culling(&PINHOLE, &window);
            check_culling(&FISHEYE, &window);
        }
    }

    pub(crate) fn check_rays(lens: &impl Lens) {
        let mut next = random();
        for _ in 0..1000 {
            let (u, v) = (700.0 * next(), 700.0 * next());
            let seen = lens.project(lens.ray(u, v));
            assert!((seen.u - u).abs() + (seen.v - v).abs() < 1e-9, "{u} {v}");
        }
    }

    #[test]
    fn rays_are_projected_where_they_came_from() {
        check_rays(&PINHOLE);
        check_rays(&FISHEYE);
    }
}
