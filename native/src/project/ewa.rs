//! A splat on the picture plane: EWA projection in double precision.

use crate::camera::lens::{Lens, LOW_PASS};
use crate::project::posed::PosedCloud;

/// A projected splat: an ellipse about `centre`.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    pub centre: [f64; 2],
    /// Covariance in px², low pass included.
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
    /// Determinant of the covariance without and with the low pass.
    pub sharp: f64,
    pub soft: f64,
    pub depth: f64,
    /// Squared distance of the mean.
    pub range_squared: f64,
    pub drawable: bool,
}

/// Covariance = (J R F)(J R F)ᵀ + 0.3 px², with `factor` = F row by row.
#[inline(always)]
pub fn footprint<L: Lens>(
    posed: &PosedCloud,
    lens: &L,
    mean: [f64; 3],
    factor: [f64; 9],
) -> Footprint {
    let at = posed.to_camera(mean);
    let seen = lens.project(at);
    let r = &posed.rotation;
    let [top, bottom] = seen.jacobian.map(|row| {
        let turned: [f64; 3] =
            std::array::from_fn(|k| row[0] * r[0][k] + row[1] * r[1][k] + row[2] * r[2][k]);
        let m: [f64; 3] = std::array::from_fn(|k| {
            turned[0] * factor[k] + turned[1] * factor[3 + k] + turned[2] * factor[6 + k]
        });
        m
    });
    let print = covariances(&[top, bottom]);
    let [xx, xy, yy] = print.soft;
    Footprint {
        centre: [seen.u, seen.v],
        xx,
        xy,
        yy,
        sharp: print.sharp_determinant,
        soft: print.soft_determinant,
        depth: seen.depth,
        range_squared: at[0] * at[0] + at[1] * at[1] + at[2] * at[2],
        drawable: seen.drawable,
    }
}

/// A covariance on the picture and what the Mip filter asks of it.
#[derive(Clone, Copy, Debug)]
pub struct Covariances {
    /// xx, xy, yy with the low pass.
    pub soft: [f64; 3],
    pub sharp_determinant: f64,
    pub soft_determinant: f64,
}

/// From the rows of J R F.
#[inline(always)]
pub fn covariances([top, bottom]: &[[f64; 3]; 2]) -> Covariances {
    let dot = |p: &[f64; 3], q: &[f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let (xx, xy, yy) = (dot(top, top), dot(top, bottom), dot(bottom, bottom));
    // |top × bottom|² equals xx·yy - xy² without its cancellation (Binet-Cauchy).
    let cross = [
        top[1] * bottom[2] - top[2] * bottom[1],
        top[2] * bottom[0] - top[0] * bottom[2],
        top[0] * bottom[1] - top[1] * bottom[0],
    ];
    let sharp = dot(&cross, &cross);
    Covariances {
        soft: [xx + LOW_PASS, xy, yy + LOW_PASS],
        sharp_determinant: sharp,
        soft_determinant: sharp + LOW_PASS * (xx + yy) + LOW_PASS * LOW_PASS,
    }
}
