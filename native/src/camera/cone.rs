//! Where the silhouette of an ellipsoid falls on a picture: boxes that hold it.
//!
//! The ellipsoid is given by its tangent planes through the eye: l with lᵀ N l = 0, N = mean·meanᵀ
//! minus the squared reach times the covariance. The eye is outside, so N has one positive
//! eigenvalue.

use crate::camera::round::RoundLens;
use crate::camera::window::{PixelBox, EVERYWHERE};

pub(crate) type Vector = [f64; 3];
pub(crate) type Matrix = [[f64; 3]; 3];

/// The exact box of a silhouette; a side beyond which it leaves the front of the pinhole is open.
pub fn box_on_pinhole(
    focal: &[f64; 2],
    centre: &[f64; 2],
    planes: &Matrix,
    mean: &Vector,
) -> PixelBox {
    use std::f64::consts::FRAC_PI_2;
    std::array::from_fn(|axis| {
        let Some([low, high]) = turns(planes, mean, [2, axis]) else {
            return [f64::NEG_INFINITY, f64::INFINITY];
        };
        let at = |turn: f64, beyond: f64| {
            if turn.abs() < FRAC_PI_2 {
                focal[axis] * turn.tan() + centre[axis]
            } else {
                beyond
            }
        };
        [at(low, f64::NEG_INFINITY), at(high, f64::INFINITY)]
    })
}

/// The turns, from axis `from` to axis `to`, under which an ellipsoid is seen that is flattened onto
/// those two axes: their middle within -π..π. None if the eye is in its midst.
fn turns(planes: &Matrix, mean: &Vector, [from, to]: [usize; 2]) -> Option<[f64; 2]> {
    use std::f64::consts::PI;
    let (aa, ab, bb) = (planes[from][from], planes[from][to], planes[to][to]);
    // Eigenvalues of the 2×2 block: middle ± half.
    let (middle, lean) = (0.5 * (aa + bb), 0.5 * (aa - bb));
    let half = lean.hypot(ab);
    let (most, least) = (middle + half, middle - half);
    if !(most > 0.0 && least < 0.0) {
        return None;
    }
    let mut turn = 0.5 * ab.atan2(lean);
    if turn.cos() * mean[from] + turn.sin() * mean[to] < 0.0 {
        turn -= PI.copysign(turn);
    }
    let spread = (-least / most).sqrt().atan() + 1e-6;
    Some([turn - spread, turn + spread])
}

/// A box that holds the circular cone about a silhouette, on a lens whose picture is round.
pub(crate) fn box_on_round<L: RoundLens>(lens: &L, planes: &Matrix, mean: &Vector) -> PixelBox {
    use std::f64::consts::{FRAC_PI_2, PI};
    let centre = lens.centre();
    let (values, vectors) = eigen(planes);
    let first = (0..3).fold(0, |best, k| if values[k] > values[best] { k } else { best });
    let least = values.iter().fold(0.0f64, |least, &v| least.min(v));
    if values[first] <= 0.0 {
        return EVERYWHERE;
    }
    let facing = if (0..3).map(|r| vectors[r][first] * mean[r]).sum::<f64>() < 0.0 {
        -1.0
    } else {
        1.0
    };
    let axis: Vector = std::array::from_fn(|r| facing * vectors[r][first]);
    let half_angle = (-least / values[first]).sqrt().atan() + 1e-6;
    let off_axis = axis[0].hypot(axis[1]);
    let angle = off_axis.atan2(axis[2]);
    let (nearest, farthest) = (angle - half_angle, angle + half_angle);
    let outer = lens.radius(farthest.min(PI));
    if nearest <= 0.0 || farthest >= PI {
        return centre.map(|c| [c - outer, c + outer]);
    }
    let inner = lens.radius(nearest);
    // The flattened ellipsoid is seen under a smaller azimuth than the cone.
    let Some(azimuths) = turns(planes, mean, [0, 1]) else {
        return centre.map(|c| [c - outer, c + outer]);
    };
    // The box of a sector: its corners, and where it crosses the axes of the picture.
    let crossings = (-3..=3).map(|k| f64::from(k) * FRAC_PI_2);
    let crossings = crossings.filter(|azimuth| (azimuths[0]..azimuths[1]).contains(azimuth));
    let mut found = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for azimuth in crossings.chain(azimuths) {
        let (sine, cosine) = azimuth.sin_cos();
        for radius in [inner, outer] {
            for (span, along) in found.iter_mut().zip([cosine, sine]) {
                *span = [span[0].min(radius * along), span[1].max(radius * along)];
            }
        }
    }
    std::array::from_fn(|k| found[k].map(|v| centre[k] + v))
}

/// Eigenvalues of a symmetric matrix, and its eigenvectors as columns (Jacobi's rotations).
pub(crate) fn eigen(matrix: &Matrix) -> ([f64; 3], Matrix) {
    const SWEEPS: usize = 8;
    let mut a = *matrix;
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let ratio = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let tangent = 1f64.copysign(ratio) / (ratio.abs() + ratio.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            let sine = tangent * cosine;
            for row in &mut a {
                (row[p], row[q]) = (
                    cosine * row[p] - sine * row[q],
                    sine * row[p] + cosine * row[q],
                );
            }
            #[allow(clippy::needless_range_loop)] // two columns of one matrix
            for k in 0..3 {
                (a[p][k], a[q][k]) = (
                    cosine * a[p][k] - sine * a[q][k],
                    sine * a[p][k] + cosine * a[q][k],
                );
            }
            for row in &mut vectors {
                (row[p], row[q]) = (
                    cosine * row[p] - sine * row[q],
                    sine * row[p] + cosine * row[q],
                );
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2]], vectors)
}
