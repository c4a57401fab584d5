//! What every camera model does: where a point falls, how the picture moves with it, and which chunks
//! can be seen.

use crate::camera::window::{PixelBox, Window};

/// sqrt(2 ln 255): standard deviations at which a splat of opacity 1 fades below 1/255.
pub(crate) const VISIBLE_SIGMAS: f64 = 3.33;
/// Added to the diagonal of every projected covariance, px².
pub const LOW_PASS: f64 = 0.3;

/// Focal lengths outside this, px, are refused before they come here: single precision holds neither
/// the squares of such a picture's slopes nor, beyond the largest, single pixels.
pub const FOCAL_PX: [f64; 2] = [1e-3, 1e7];
/// Principal points further than this, px, from the picture's corner are refused too: within this,
/// single precision resolves pixels.
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

    /// The lens of a part of its picture, `size` pixels from `corner` on, drawn with `finer` pixels
    /// each way per pixel.
    fn of_part(&self, corner: [f64; 2], size: [f64; 2], finer: f64) -> Self
    where
        Self: Sized;
}
