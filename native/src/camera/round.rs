//! Lenses whose picture depends on the angle off axis alone, and what such a lens can see.

use crate::camera::angles::{angle_between, angle_from};
use crate::camera::curvature::Bend;
use crate::camera::lens::{Group, Lens, Projected, LOW_PASS, VISIBLE_SIGMAS};
use crate::camera::window::Window;

/// A fisheye draws splats whose centre lies up to this many lens radii off axis, ...
const ANGLE_MARGIN: f64 = 1.15;
/// ... but never nearer than this (radians) to straight behind, where the Jacobian has its pole.
const POLE_MARGIN: f64 = 0.05;

/// A lens whose picture depends on the angle off axis alone.
pub(crate) trait RoundLens: Lens {
    /// Half the field of view, radians.
    fn max_angle(&self) -> f64;

    /// Largest angle off axis of a splat's centre; splats beyond are not drawn.
    #[inline(always)]
    fn angle_limit(&self) -> f64 {
        (ANGLE_MARGIN * self.max_angle()).min(std::f64::consts::PI - POLE_MARGIN)
    }

    /// The picture's centre, px.
    fn centre(&self) -> [f64; 2];

    /// Distance from the picture's centre, px, and how it grows with the angle, px per radian.
    fn radius_and_slope(&self, angle: f64) -> [f64; 2];

    /// Distance from the picture's centre, px.
    #[inline(always)]
    fn radius(&self, angle: f64) -> f64 {
        self.radius_and_slope(angle)[0]
    }

    /// Bounds of how the radius grows with the angle, px per radian.
    fn slopes(&self) -> [f64; 2];
}

/// `Lens::project` of round lenses.
#[inline(always)]
pub(crate) fn project_round<L: RoundLens>(lens: &L, p: [f64; 3]) -> Projected {
    let [x, y, z] = p;
    let off_axis_squared = x * x + y * y;
    let off_axis = off_axis_squared.sqrt();
    let range_squared = off_axis_squared + z * z;
    let angle = angle_from(off_axis, z);
    let [radius, slope] = lens.radius_and_slope(angle);
    let on_axis = off_axis < 1e-12 * z;
    let safe = if on_axis { 1.0 } else { off_axis };
    let (ex, ey) = (
        if on_axis { 1.0 } else { x / safe },
        if on_axis { 0.0 } else { y / safe },
    );
    let radial = slope * z / range_squared;
    let tangential = if on_axis {
        lens.focal() / z
    } else {
        radius / safe
    };
    let axial = -slope * off_axis / range_squared;
    let mixed = ex * ey * (radial - tangential);
    let centre = lens.centre();
    Projected {
        u: radius * ex + centre[0],
        v: radius * ey + centre[1],
        depth: range_squared.sqrt(),
        jacobian: [
            [ex * ex * radial + ey * ey * tangential, mixed, axial * ex],
            [mixed, ey * ey * radial + ex * ex * tangential, axial * ey],
        ],
        drawable: angle <= lens.angle_limit(),
    }
}

/// Second derivatives of a round lens's picture u = f·g(s, z)·x, v = f·g(s, z)·y, s = |(x, y)|, by
/// those of g: h = g_s / s, k = h_s / s.
pub(crate) struct RoundBend {
    pub(crate) h: f64,
    pub(crate) k: f64,
    pub(crate) h_z: f64,
    pub(crate) g_z: f64,
    /// f·x·g_zz and f·y·g_zz, each as its lens multiplies them.
    pub(crate) zz: [f64; 2],
    /// 1 / |p|.
    pub(crate) inverse_range: f64,
}

impl RoundBend {
    /// At the point `p`, with focal length `f` and the first derivatives there.
    #[inline(always)]
    pub(crate) fn bend(&self, f: f64, p: [f64; 3], centre: [[f64; 3]; 2]) -> Bend {
        let [x, y, _] = p;
        let &RoundBend { h, k, h_z, g_z, .. } = self;
        let xxx = f * x * (3.0 * h + x * x * k);
        let xxy = f * y * (h + x * x * k);
        let xyy = f * x * (h + y * y * k);
        let yyy = f * y * (3.0 * h + y * y * k);
        let xxz = f * (x * x * h_z + g_z);
        let xyz = f * x * y * h_z;
        let yyz = f * (y * y * h_z + g_z);
        let [xzz, yzz] = self.zz;
        Bend {
            centre,
            jacobian: [
                [[xxx, xxy, xxz], [xxy, xyy, xyz], [xxz, xyz, xzz]],
                [[xxy, xyy, xyz], [xyy, yyy, yyz], [xyz, yyz, yzz]],
            ],
            depth: p.map(|v| v * self.inverse_range),
        }
    }
}

/// `Lens::sees_ball` of round lenses.
pub(crate) fn sees_ball_round<L: RoundLens>(
    lens: &L,
    centre: &[f64; 3],
    radius: f64,
    window: &Window,
) -> bool {
    let distance = centre.iter().map(|v| v * v).sum::<f64>().sqrt();
    if distance <= radius {
        return true;
    }
    let half_width = (radius / distance).asin();
    let is_near = |ray: [f64; 3], limit: f64| angle_between(*centre, ray) <= half_width + limit;
    let (middle, half_diagonal) = window.disc();
    is_near([0.0, 0.0, 1.0], lens.max_angle())
        && (!window.is_part
            || is_near(
                lens.ray(middle[0], middle[1]),
                half_diagonal / lens.slopes()[0],
            ))
}

/// `Lens::can_see` of round lenses.
pub(crate) fn can_see_round<L: RoundLens>(lens: &L, group: &Group, window: &Window) -> bool {
    let Group { centre, radius, .. } = *group;
    let [x, y, z] = centre;
    let distance = (x * x + y * y + z * z).sqrt();
    if distance + radius < group.near {
        return false;
    }
    if distance <= radius {
        return true;
    }
    let nearest = (distance - radius).max(group.near);
    let angle = (x * x + y * y).sqrt().atan2(z);
    let half_width = (radius / distance).asin();
    let limit = lens.angle_limit();
    let first = (angle - half_width).max(0.0);
    if first > limit {
        return false;
    }
    let [least, most] = lens.slopes();
    // Around the axis the picture stretches by angle / sin(angle), along it by one, both times
    // a slope.
    let last = (angle + half_width).min(limit);
    let stretch = (last / last.sin().max(1e-9)).max(1.0);
    let gain = most * stretch * group.max_scale / nearest;
    let reach = VISIBLE_SIGMAS * (gain * gain + LOW_PASS).sqrt();
    if lens.radius(first) - reach > lens.radius(lens.max_angle()) {
        return false;
    }
    if !window.is_part {
        return true;
    }
    // Nowhere is the picture of an angle smaller than the least slope makes it.
    let (middle, half_diagonal) = window.disc();
    let apart = angle_between(centre, lens.ray(middle[0], middle[1]));
    apart <= half_width + (half_diagonal + reach) / least
}
