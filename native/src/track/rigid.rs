//! Poses and vectors of the tracker's kernels, double precision.

pub type Rotation = [[f64; 3]; 3];

/// `x_in_a = rotation · x_in_b + translation`.
#[derive(Clone, Copy)]
pub struct Rigid {
    pub rotation: Rotation,
    pub translation: [f64; 3],
}

#[inline(always)]
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub fn times(rotation: &Rotation, point: [f64; 3]) -> [f64; 3] {
    rotation.map(|row| dot(row, point))
}

/// The point in the frame that the pose leads to.
#[inline(always)]
pub fn in_frame(pose: &Rigid, point: [f64; 3]) -> [f64; 3] {
    let turned = times(&pose.rotation, point);
    std::array::from_fn(|k| turned[k] + pose.translation[k])
}

pub fn product(a: &Rotation, b: &Rotation) -> Rotation {
    a.map(|row| std::array::from_fn(|j| (0..3).map(|k| row[k] * b[k][j]).sum()))
}

pub fn transposed(a: &Rotation) -> Rotation {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// The rotation by a rotation vector (Rodrigues).
pub fn turn(vector: [f64; 3]) -> Rotation {
    let angle = dot(vector, vector).sqrt();
    let (sine, versine) = match angle < 1e-8 {
        true => (1.0, 0.5),
        false => (angle.sin() / angle, (1.0 - angle.cos()) / (angle * angle)),
    };
    let [x, y, z] = vector;
    let skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let squared = product(&skew, &skew);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            f64::from(u8::from(i == j)) + sine * skew[i][j] + versine * squared[i][j]
        })
    })
}

/// The rotation vector of a rotation, of length up to π.
pub fn rotation_vector(rotation: &Rotation) -> [f64; 3] {
    let r = rotation;
    let axis = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]];
    let sine = 0.5 * dot(axis, axis).sqrt();
    let cosine = 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0);
    let scale = match sine < 1e-9 {
        true => 0.5,
        false => 0.5 * sine.atan2(cosine) / sine,
    };
    axis.map(|part| part * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_vector_survives_its_rotation() {
        for vector in [
            [0.0; 3],
            [0.3, -1.2, 0.7],
            [1e-10, 0.0, 2e-9],
            [0.0, 0.0, 3.1],
        ] {
            let again = rotation_vector(&turn(vector));
            for k in 0..3 {
                assert!((again[k] - vector[k]).abs() < 1e-9, "{vector:?} {again:?}");
            }
        }
    }
}
