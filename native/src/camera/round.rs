//! Lenses whose picture depends on the angle off axis alone, and what such a lens can see.

use crate::camera::angles::angle_between;
use crate::camera::lens::{Group, Lens, LOW_PASS, VISIBLE_SIGMAS};
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

    /// Distance from the picture's centre, px.
    fn radius(&self, angle: f64) -> f64;

    /// Bounds of how the radius grows with the angle, px per radian.
    fn slopes(&self) -> [f64; 2];
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
