//! One cloud on black, drawn through one camera at one upright pose after the other.

use std::sync::Arc;

use rayon::ThreadPool;

use crate::camera::lens::Lens;
use crate::machine::simd::Simd;
use crate::project::posed::{PosedCloud, View};
use crate::project::scope::Scope;
use crate::render::engine::Engine;
use crate::render::job::{Background, Job, Picture};
use crate::scene::cloud::Cloud;

/// A cloud, and from where it is seen.
pub struct Alone {
    pub cloud: Arc<Cloud>,
    pub view: View,
    /// Row-major 3×4.
    pub camera_from_world: [f64; 12],
}

/// Colours, weighted with the alpha, and the alpha; for one picture after the other.
#[derive(Default)]
pub struct Drawing {
    pub rgb: Vec<f32>,
    pub alpha: Vec<f32>,
    depth: Vec<f32>,
    ids: Vec<i32>,
}

impl Alone {
    /// Draws the cloud at `upright`: x, y, z and yaw of its pose in the world.
    pub fn draw<L: Lens>(
        &self,
        upright: [f64; 4],
        lens: &L,
        engine: &Engine,
        simd: Simd,
        pool: &ThreadPool,
        drawing: &mut Drawing,
    ) {
        let View { width, height, .. } = self.view;
        drawing.hold(width * height);
        let job = Job {
            view: self.view,
            scope: &Scope::whole(width, height),
            background: Background::Plain([0.0; 3]),
            simd,
            pool,
        };
        let pose = camera_from_upright(&self.camera_from_world, upright);
        let objects = [PosedCloud::new(&self.cloud, &pose, 0)];
        engine.render(&objects, lens, &job, None, &mut drawing.picture());
    }

    /// From where something upright in the world is seen, in its own frame.
    pub fn eye(&self, upright: [f64; 4]) -> [f64; 3] {
        let pose = camera_from_upright(&self.camera_from_world, upright);
        PosedCloud::new(&self.cloud, &pose, 0).eye()
    }
}

impl Drawing {
    fn hold(&mut self, pixels: usize) {
        self.rgb.resize(3 * pixels, 0.0);
        self.alpha.resize(pixels, 0.0);
        self.depth.resize(pixels, 0.0);
        self.ids.resize(pixels, 0);
    }

    fn picture(&mut self) -> Picture<'_> {
        Picture {
            rgb: &mut self.rgb,
            alpha: &mut self.alpha,
            depth: &mut self.depth,
            ids: &mut self.ids,
        }
    }
}

/// The pose in the camera, row-major 3×4, of something upright in the world.
fn camera_from_upright(camera_from_world: &[f64; 12], [x, y, z, yaw]: [f64; 4]) -> [f64; 12] {
    let (sine, cosine) = yaw.sin_cos();
    let mut pose = [0.0; 12];
    for (row, to) in camera_from_world
        .chunks_exact(4)
        .zip(pose.chunks_exact_mut(4))
    {
        to[0] = cosine * row[0] + sine * row[1];
        to[1] = cosine * row[1] - sine * row[0];
        to[2] = row[2];
        to[3] = row[0] * x + row[1] * y + row[2] * z + row[3];
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_to_the_left_brings_x_to_y() {
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let quarter = std::f64::consts::FRAC_PI_2;
        let pose = camera_from_upright(&identity, [1.0, 2.0, 3.0, quarter]);
        let wanted = [0.0, -1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0];
        for (got, wanted) in pose.iter().zip(wanted) {
            assert!((got - wanted).abs() < 1e-12);
        }
    }
}
