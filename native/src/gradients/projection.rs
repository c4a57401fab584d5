//! From a splat's sums over the picture to the gradients of its own values and of its pose.
//!
//! The chain: sums -> centre, covariance, opacity and colour on the picture -> (through the camera,
//! with its second derivatives) mean, scales, quaternion, coefficients, and a twist of the object.

use crate::camera::curvature::Curved;
use crate::camera::lens::LOW_PASS;
use crate::gradients::backward::SUMS;
use crate::project::ewa::{covariances, Covariances};
use crate::project::posed::{PosedCloud, View};
use crate::project::record::Record;
use crate::scene::cloud::{rotation_of, Cloud};
use crate::scene::sh_slope::basis_and_slopes;

type Vector = [f64; 3];
type Matrix = [[f64; 3]; 3];

/// Gradient with respect to a small motion of an object in camera axes:
/// `x += shift + turn × x`, the axis of the turn through the camera's centre.
#[derive(Clone, Copy, Debug, Default)]
pub struct TwistGradient {
    pub shift: Vector,
    pub turn: Vector,
}

impl TwistGradient {
    pub fn add(&mut self, other: &TwistGradient) {
        for axis in 0..3 {
            self.shift[axis] += other.shift[axis];
            self.turn[axis] += other.turn[axis];
        }
    }
}

/// Gradients of one splat.
pub struct SplatGradient {
    pub object: u32,
    pub index: u32,
    pub mean: Vector,
    pub scale: Vector,
    /// Of the quaternion as given, whatever its norm.
    pub rotation: [f64; 4],
    pub opacity: f64,
    pub colour: ColourGradients,
    pub twist: TwistGradient,
}

/// Gradients of the coefficients are `basis[k] · colour[channel]`.
pub struct ColourGradients {
    pub colour: Vector,
    pub basis: [f64; 16],
    /// Coefficients in use.
    pub count: usize,
}

/// Gradients of one object's splats, in the order and shape of its arrays.
pub struct ObjectGradients {
    pub means: Vec<f32>,
    pub scales: Vec<f32>,
    pub rotations: Vec<f32>,
    pub opacities: Vec<f32>,
    pub sh: Vec<f32>,
    pub twist: TwistGradient,
    sh_count: usize,
}

impl ObjectGradients {
    pub fn zero(cloud: &Cloud) -> ObjectGradients {
        let count = cloud.originals.len();
        ObjectGradients {
            means: vec![0.0; 3 * count],
            scales: vec![0.0; 3 * count],
            rotations: vec![0.0; 4 * count],
            opacities: vec![0.0; count],
            sh: vec![0.0; 3 * cloud.sh_count * count],
            twist: TwistGradient::default(),
            sh_count: cloud.sh_count,
        }
    }

    /// Writes a splat's gradients to its place.
    pub fn put(&mut self, splat: &SplatGradient) {
        let i = splat.index as usize;
        write(&mut self.means[3 * i..], &splat.mean);
        write(&mut self.scales[3 * i..], &splat.scale);
        write(&mut self.rotations[4 * i..], &splat.rotation);
        self.opacities[i] = splat.opacity as f32;
        let ColourGradients {
            colour,
            basis,
            count,
        } = &splat.colour;
        let rows = self.sh[3 * self.sh_count * i..].chunks_exact_mut(3);
        for (row, value) in rows.zip(basis).take(*count) {
            write(row, &colour.map(|v| v * value));
        }
    }
}

fn write(to: &mut [f32], values: &[f64]) {
    for (to, &value) in to.iter_mut().zip(values) {
        *to = value as f32;
    }
}

/// Gradients of the splat behind `record`, given its sums over all tiles (see `backward::Sums`).
pub fn gradients_of_splat<L: Curved>(
    posed: &PosedCloud,
    lens: &L,
    view: &View,
    record: &Record,
    sums: &[f64; SUMS],
) -> SplatGradient {
    let original = &posed.cloud.originals[record.index as usize];
    let mean = original.mean.map(f64::from);
    let scale = original.scale.map(f64::from);
    let turn = &posed.rotation;
    let at = posed.to_camera(mean);
    let seen = lens.project(at);
    let bend = lens.bend(at);

    // On the picture: m = J R F, Σ = m mᵀ + low pass.
    let factor = original.factor();
    let factor: Matrix = std::array::from_fn(|r| std::array::from_fn(|k| factor[3 * r + k]));
    let to_picture = seen.jacobian.map(|row| row_times(&row, turn));
    let m = to_picture.map(|row| row_times(&row, &factor));
    let print = covariances(&m);
    let (d_centre, mut d_covariance) = picture_gradients(&print, sums);
    if view.antialias {
        // ln of the opacity's factor is half of ln det(sharp) - ln det(soft).
        let [xx, xy, yy] = print.soft;
        let sharp = [xx - LOW_PASS, xy, yy - LOW_PASS];
        let gain = inverse(&sharp, print.sharp_determinant);
        let loss = inverse(&print.soft, print.soft_determinant);
        for k in 0..3 {
            d_covariance[k] += 0.5 * sums[0] * (gain[k] - loss[k]);
        }
    }

    // d Σ = 2 · sym(d m mᵀ)
    let [xx, xy, yy] = d_covariance.map(|v| 2.0 * v);
    let d_m: [Vector; 2] = [
        std::array::from_fn(|k| xx * m[0][k] + xy * m[1][k]),
        std::array::from_fn(|k| xy * m[0][k] + yy * m[1][k]),
    ];
    let d_factor: Matrix = std::array::from_fn(|r| {
        std::array::from_fn(|k| to_picture[0][r] * d_m[0][k] + to_picture[1][r] * d_m[1][k])
    });
    let (d_scale, d_rotation) = factor_gradients(original.rotation, &scale, &d_factor);
    let d_jacobian = d_m.map(|row| {
        let in_object: Vector = std::array::from_fn(|r| dot(&row, &factor[r]));
        std::array::from_fn::<f64, 3, _>(|r| dot(&in_object, &turn[r]))
    });

    let mut d_at: Vector = std::array::from_fn(|axis| {
        let straight = d_centre[0] * bend.centre[0][axis]
            + d_centre[1] * bend.centre[1][axis]
            + sums[9] * bend.depth[axis];
        let bent: f64 = (0..2)
            .map(|row| {
                (0..3)
                    .map(|column| d_jacobian[row][column] * bend.jacobian[row][column][axis])
                    .sum::<f64>()
            })
            .sum();
        straight + bent
    });
    let mut d_turn = cross(&at, &d_at);
    for (row, d_row) in seen.jacobian.iter().zip(&d_jacobian) {
        let twist = cross(row, d_row);
        // J [turn]ₓ is the row J × turn, so its gradient is d J × J.
        for axis in 0..3 {
            d_turn[axis] -= twist[axis];
        }
    }

    // A turn about the camera does not change the direction a splat is seen from.
    let colour = colour_gradients(posed, view, record, mean, &sums[6..9]);
    let d_direction: Vector = std::array::from_fn(|r| dot(&turn[r], &colour.1));
    for axis in 0..3 {
        d_at[axis] += d_direction[axis];
    }
    SplatGradient {
        object: record.object,
        index: record.index,
        mean: std::array::from_fn(|k| (0..3).map(|r| turn[r][k] * d_at[r]).sum()),
        scale: d_scale,
        rotation: d_rotation,
        opacity: if original.opacity <= 1.0 {
            sums[0] / f64::from(original.opacity)
        } else {
            0.0
        },
        colour: colour.0,
        twist: TwistGradient {
            shift: d_at,
            turn: d_turn,
        },
    }
}

/// Gradients of the centre and of the covariance (xx, xy, yy of a symmetric matrix).
fn picture_gradients(print: &Covariances, sums: &[f64; SUMS]) -> ([f64; 2], [f64; 3]) {
    use std::f64::consts::{LN_2, LOG2_E};
    let [_, xy, yy] = print.soft;
    let a = (0.5 * LOG2_E * yy / print.soft_determinant).sqrt();
    let b = -a * xy / yy;
    let c = (0.5 * LOG2_E / yy).sqrt();
    let [_, u, v, uu, uv, vv, ..] = *sums;
    let centre = [2.0 * LN_2 * a * u, 2.0 * LN_2 * (b * u + c * v)];
    // 2 ln²2 · Wᵀ M W with W = [a b; 0 c].
    let scale = 2.0 * LN_2 * LN_2;
    let covariance = [
        scale * a * a * uu,
        scale * a * (b * uu + c * uv),
        scale * (b * b * uu + 2.0 * b * c * uv + c * c * vv),
    ];
    (centre, covariance)
}

/// Gradients of the scales and of the quaternion as given, from those of R·S.
fn factor_gradients(quaternion: [f32; 4], scale: &Vector, d: &Matrix) -> (Vector, [f64; 4]) {
    let q = quaternion.map(f64::from);
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    let unit = q.map(|v| v / norm);
    let [w, x, y, z] = unit;
    let rotation = rotation_of(unit);
    let d_scale = std::array::from_fn(|k| (0..3).map(|r| d[r][k] * rotation[r][k]).sum());
    let g: Matrix = d.map(|row| std::array::from_fn(|k| row[k] * scale[k]));
    let d_unit = [
        2.0 * (x * (g[2][1] - g[1][2]) + y * (g[0][2] - g[2][0]) + z * (g[1][0] - g[0][1])),
        2.0 * (y * (g[0][1] + g[1][0]) + z * (g[0][2] + g[2][0]) + w * (g[2][1] - g[1][2])
            - 2.0 * x * (g[1][1] + g[2][2])),
        2.0 * (x * (g[0][1] + g[1][0]) + z * (g[1][2] + g[2][1]) + w * (g[0][2] - g[2][0])
            - 2.0 * y * (g[0][0] + g[2][2])),
        2.0 * (x * (g[0][2] + g[2][0]) + y * (g[1][2] + g[2][1]) + w * (g[1][0] - g[0][1])
            - 2.0 * z * (g[0][0] + g[1][1])),
    ];
    let along: f64 = unit.iter().zip(&d_unit).map(|(a, b)| a * b).sum();
    let d_quaternion = std::array::from_fn(|k| (d_unit[k] - unit[k] * along) / norm);
    (d_scale, d_quaternion)
}

/// Gradients of the coefficients, and of the vector from the eye to the mean in the object's frame.
fn colour_gradients(
    posed: &PosedCloud,
    view: &View,
    record: &Record,
    mean: Vector,
    d_colour: &[f64],
) -> (ColourGradients, Vector) {
    let eye = posed.eye();
    let offset: Vector = std::array::from_fn(|axis| mean[axis] - eye[axis]);
    let length = dot(&offset, &offset).sqrt();
    let direction = offset.map(|v| v / if length > 0.0 { length } else { 1.0 });
    // A colour clamped at 0 does not follow its coefficients.
    let colour: Vector = std::array::from_fn(|channel| {
        if record.colour[channel] > 0.0 {
            d_colour[channel]
        } else {
            0.0
        }
    });
    let (basis, slopes) = basis_and_slopes(direction);
    let count = posed.cloud.sh_count.min((view.sh_degree + 1).pow(2));
    let mut along = [0.0; 3];
    if count > 1 && length > 0.0 {
        let rows = posed.cloud.sh_of_splat(record.index as usize);
        for (row, slope) in rows.zip(&slopes).take(count) {
            let share: f64 = (0..3).map(|c| f64::from(row[c]) * colour[c]).sum();
            for axis in 0..3 {
                along[axis] += share * slope[axis];
            }
        }
        let radial = dot(&along, &direction);
        along = std::array::from_fn(|axis| (along[axis] - radial * direction[axis]) / length);
    }
    let gradients = ColourGradients {
        colour,
        basis,
        count,
    };
    (gradients, along)
}

/// Inverse of a symmetric 2×2 matrix given as xx, xy, yy.
fn inverse([xx, xy, yy]: &[f64; 3], determinant: f64) -> [f64; 3] {
    [yy / determinant, -xy / determinant, xx / determinant]
}

fn dot(p: &Vector, q: &Vector) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

fn cross(p: &Vector, q: &Vector) -> Vector {
    [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ]
}

fn row_times(row: &Vector, matrix: &Matrix) -> Vector {
    std::array::from_fn(|k| row[0] * matrix[0][k] + row[1] * matrix[1][k] + row[2] * matrix[2][k])
}
