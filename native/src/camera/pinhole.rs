//! The pinhole camera.

use crate::camera::cone;
use crate::camera::curvature::{Bend, Curved};
use crate::camera::lens::{Group, Lens, Projected, LOW_PASS, VISIBLE_SIGMAS};
use crate::camera::window::{PixelBox, Window};

/// Share of the picture's width (height) beyond its border at which the pinhole Jacobian is frozen.
const JACOBIAN_MARGIN: f64 = 0.15;

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
        cone::box_on_pinhole(&self.focal, &self.centre, planes, mean)
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

    fn of_part(&self, corner: [f64; 2], [width, height]: [f64; 2], finer: f64) -> Self {
        Pinhole {
            width: finer * width,
            height: finer * height,
            focal: self.focal.map(|focal| finer * focal),
            centre: std::array::from_fn(|axis| finer * (self.centre[axis] - corner[axis])),
        }
    }
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
