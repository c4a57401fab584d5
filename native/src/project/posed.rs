//! An object where it stands before the camera, and how the picture of it is asked for.

use crate::scene::cloud::Cloud;

/// Splats further away (metres) are not drawn: sums of their depths would overflow.
const MAX_DEPTH: f64 = 1e15;

/// One posed object as the projection sees it.
pub struct PosedCloud<'a> {
    pub cloud: &'a Cloud,
    pub rotation: [[f64; 3]; 3],
    pub translation: [f64; 3],
    pub object: u32,
}

impl<'a> PosedCloud<'a> {
    /// `pose`: camera from object, row-major 3×4.
    pub fn new(cloud: &'a Cloud, pose: &[f64; 12], object: usize) -> PosedCloud<'a> {
        PosedCloud {
            cloud,
            rotation: std::array::from_fn(|row| std::array::from_fn(|k| pose[4 * row + k])),
            translation: std::array::from_fn(|row| pose[4 * row + 3]),
            object: object as u32,
        }
    }

    #[inline(always)]
    pub fn to_camera(&self, p: [f64; 3]) -> [f64; 3] {
        let r = &self.rotation;
        std::array::from_fn(|row| {
            r[row][0] * p[0] + r[row][1] * p[1] + r[row][2] * p[2] + self.translation[row]
        })
    }

    /// Camera centre in the object's frame.
    pub fn eye(&self) -> [f64; 3] {
        std::array::from_fn(|axis| {
            -(0..3)
                .map(|row| self.rotation[row][axis] * self.translation[row])
                .sum::<f64>()
        })
    }
}

/// What is the same for all splats of one picture.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub width: usize,
    pub height: usize,
    pub near: f64,
    pub antialias: bool,
    pub sh_degree: usize,
    /// Splats whose largest standard deviation is seen under more than this are drawn by `wide`;
    /// radians.
    pub exact_above: f64,
}

impl View {
    /// Whether splats so deep are drawn.
    #[inline(always)]
    pub(crate) fn reaches(&self, depth: f64) -> bool {
        (depth >= self.near) & (depth <= MAX_DEPTH)
    }
}
