//! Splats seen so wide that a flat ellipse does not do: their alpha is that of the 3D Gaussian's
//! peak along each pixel's ray (the response of 3DGUT, Wu et al. 2024).
//!
//! With A the whitening (A Σ Aᵀ = 1), m = A·mean and w = A·ray, the squared distance between the
//! ray and the mean is |m|² sin²(m, w) where the ray comes nearer to the mean, else |m|². The scales
//! are blurred by the low pass of 0.3 px² as seen at the splat's range.

// The loops count: iterators over lanes are closures, which are compiled without vectors.
#![allow(clippy::needless_range_loop)]

use rayon::prelude::*;

use crate::camera::lens::{Lens, LOW_PASS, VISIBLE_SIGMAS};
use crate::camera::window::{Window, EVERYWHERE};
use crate::project::posed::PosedCloud;
use crate::project::record::{Record, HALF_LOG2_E};
use crate::project::scope::{tiles_within, Scope};
use crate::project::tile_box::{TileBox, TILE};
use crate::scene::cloud::Original;

pub(crate) type Vector = [f64; 3];
type Matrix = [[f64; 3]; 3];

/// The rays that see a splat: steep · |(x1, x2)| - reach · x0 <= 0, x as in `WideSplat::rows`.
#[derive(Clone, Copy)]
pub(crate) struct Cone {
    pub(crate) reach: f32,
    pub(crate) steep: f32,
    /// Whether the eye is in the midst of what can be seen, or nearly: then all rays see it.
    pub(crate) is_around: bool,
}

/// A wide splat before one camera.
pub struct WideSplat {
    /// With x = `rows` · ray: squared distance = (x1² + x2²) / (x0² + (x1² + x2²) / `square`).
    pub(crate) rows: Matrix,
    /// |m|²
    pub(crate) square: f64,
    /// log2(255 · opacity)
    pub(crate) power: f64,
    /// `rows` in single precision.
    pub(crate) short_rows: [[f32; 3]; 3],
    pub(crate) cone: Cone,
    mean: Vector,
    /// Blurred covariance in camera axes.
    covariance: Matrix,
}

impl WideSplat {
    pub fn new<L: Lens>(posed: &PosedCloud, lens: &L, original: &Original) -> WideSplat {
        let mean = posed.to_camera(original.mean.map(f64::from));
        let blur = LOW_PASS * dot(&mean, &mean) / lens.focal().powi(2);
        let scales = original
            .scale
            .map(|scale| (f64::from(scale).powi(2) + blur).sqrt());
        let axes = axes_in_camera(posed, original);
        // Row k of the whitening is axis k over its scale.
        let whitening: Matrix =
            std::array::from_fn(|k| std::array::from_fn(|r| axes[r][k] / scales[k]));
        let m = whitening.map(|row| dot(&row, &mean));
        let length = dot(&m, &m).sqrt().max(1e-9);
        let ahead = m.map(|v| v / length);
        let [side, up] = perpendicular(&ahead);
        let pulled = |v: &Vector, gain: f64| -> Vector {
            std::array::from_fn(|r| gain * (0..3).map(|k| whitening[k][r] * v[k]).sum::<f64>())
        };
        let rows = [
            pulled(&ahead, 1.0),
            pulled(&side, length),
            pulled(&up, length),
        ];
        let power = (255.0 * f64::from(original.opacity.min(1.0))).log2();
        let (square, reach_square) = (length * length, power.max(0.0) / HALF_LOG2_E);
        WideSplat {
            rows,
            square,
            power,
            short_rows: rows.map(|row| row.map(|v| v as f32)),
            cone: Cone {
                reach: reach_square.sqrt() as f32,
                steep: (1.0 - reach_square / square).max(0.0).sqrt() as f32,
                is_around: square <= reach_square * 1.001,
            },
            mean,
            covariance: std::array::from_fn(|r| {
                std::array::from_fn(|c| {
                    (0..3)
                        .map(|k| axes[r][k] * axes[c][k] * scales[k] * scales[k])
                        .sum()
                })
            }),
        }
    }

    /// log2(255 · alpha) along a ray.
    pub(crate) fn power_along(&self, ray: &Vector) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k| dot(&self.rows[k], ray));
        let across = y * y + z * z;
        let square = if x > 0.0 {
            across / (x * x + across / self.square)
        } else {
            self.square
        };
        self.power - HALF_LOG2_E * square
    }

    /// Tiles that the splat may touch; None if there are none.
    pub fn tiles<L: Lens>(&self, lens: &L, scope: &Scope) -> Option<TileBox> {
        if self.power.is_nan() || self.power < 0.0 {
            return None;
        }
        let reach = self.power / HALF_LOG2_E;
        // Tangent planes l of the visible ellipsoid through the eye: lᵀ planes l = 0.
        let planes: Matrix = std::array::from_fn(|r| {
            std::array::from_fn(|c| self.mean[r] * self.mean[c] - reach * self.covariance[r][c])
        });
        let is_inside = self.square <= reach * (1.0 + 1e-9);
        let [x, y] = if is_inside {
            EVERYWHERE
        } else {
            lens.box_of_cone(&planes, &self.mean)
        };
        const SLACK_PX: f64 = 0.01;
        let widened = |[low, high]: [f64; 2]| [low - SLACK_PX, high + SLACK_PX];
        tiles_within(widened(x), widened(y), scope)
    }

    /// A record whose ellipse is degenerate: its tiles are those of `tiles`.
    pub fn record(&self, tiles: &TileBox) -> Record {
        let left = i32::from(tiles.columns[0]) * TILE as i32;
        let right = (i32::from(tiles.columns[1]) + 1) * TILE as i32;
        let half = 0.5 * (right - left) as f32;
        let reach = (self.power.max(0.0) as f32).sqrt().max(1e-3);
        Record {
            base: [(left + right) / 2, 0],
            // One pixel less on each side, so that rounding reaches into no other tile.
            inverse_a: (half - 1.0) / reach,
            log2_opacity: (self.power - f64::from(crate::scene::cloud::LOG2_255)) as f32,
            ..Record::default()
        }
    }
}

/// False only if no wide splat of a group can touch the window.
pub fn can_see_wide<L: Lens>(
    lens: &L,
    group: &crate::camera::lens::Group,
    exact_above: f64,
    window: &Window,
) -> bool {
    let distance = dot(&group.centre, &group.centre).sqrt();
    let nearest = (distance - group.radius).max(0.0);
    if group.max_scale <= exact_above * nearest {
        return false;
    }
    let farthest = distance + group.radius;
    let blurred = group
        .max_scale
        .hypot(LOW_PASS.sqrt() * farthest / lens.focal());
    lens.sees_ball(
        &group.centre,
        group.radius + VISIBLE_SIGMAS * blurred,
        window,
    )
}

/// The wide splats of one picture, ready for its tiles.
#[derive(Default)]
pub struct WideSplats {
    splats: Vec<WideSplat>,
    /// Which of them each record is; means nothing for those that are not wide.
    places: Vec<u32>,
}

impl WideSplats {
    /// `slots` are those of `records` that hold splats of `objects`.
    pub fn new<L: Lens>(
        objects: &[PosedCloud],
        lens: &L,
        records: &[Record],
        slots: impl Iterator<Item = usize>,
    ) -> WideSplats {
        let wide: Vec<usize> = slots.filter(|&slot| records[slot].is_wide()).collect();
        let mut places = vec![0; records.len()];
        for (place, &slot) in wide.iter().enumerate() {
            places[slot] = place as u32;
        }
        let prepared = |&slot: &usize| {
            let record = &records[slot];
            let posed = &objects[record.object as usize];
            WideSplat::new(posed, lens, &posed.cloud.originals[record.index as usize])
        };
        WideSplats {
            splats: wide.par_iter().map(prepared).collect(),
            places,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.splats.is_empty()
    }

    #[inline(always)]
    pub fn at(&self, slot: u32) -> &WideSplat {
        &self.splats[self.places[slot as usize] as usize]
    }
}

/// Columns are the ellipsoid's axes, in camera axes.
fn axes_in_camera(posed: &PosedCloud, original: &Original) -> Matrix {
    let axes = original.axes();
    std::array::from_fn(|r| {
        std::array::from_fn(|k| (0..3).map(|j| posed.rotation[r][j] * axes[3 * j + k]).sum())
    })
}

/// Two unit vectors at right angles to a unit vector and to each other (Duff et al. 2017).
fn perpendicular(n: &Vector) -> [Vector; 2] {
    let sign = 1f64.copysign(n[2]);
    let a = -1.0 / (sign + n[2]);
    let b = n[0] * n[1] * a;
    [
        [1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]],
        [b, sign + n[1] * n[1] * a, -n[1]],
    ]
}

pub(crate) fn dot(p: &Vector, q: &Vector) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}
