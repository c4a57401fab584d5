//! One cloud on black, drawn through one camera at one upright pose after the other.

use std::sync::Arc;

use rayon::ThreadPool;

use crate::camera::lens::Lens;
use crate::machine::simd::Simd;
use crate::project::posed::{PosedCloud, View};
use crate::project::scope::Scope;
use crate::render::engine::Engine;
use crate::render::job::{Background, Job, Picture};
use crate::scene::cloud::{Cloud, LANES};
use crate::scene::sh;

/// A cloud, and from where it is seen.
pub struct Alone {
    pub cloud: Arc<Cloud>,
    pub view: View,
    /// Row-major 3×4.
    pub camera_from_world: [f64; 12],
}

/// Colours and depths, weighted with the alpha, and the alpha; for one picture after the other.
#[derive(Default)]
pub struct Drawing {
    pub rgb: Vec<f32>,
    pub alpha: Vec<f32>,
    pub depth: Vec<f32>,
    ids: Vec<i32>,
}

/// Who draws, and with which instructions and threads.
#[derive(Clone, Copy)]
pub struct Drawer<'a> {
    pub engine: &'a Engine,
    pub simd: Simd,
    pub pool: &'a ThreadPool,
}

impl Drawer<'_> {
    /// Draws a cloud on black, at its pose in the camera, row-major 3×4.
    pub fn draw<L: Lens>(
        &self,
        cloud: &Cloud,
        pose: &[f64; 12],
        lens: &L,
        view: View,
        drawing: &mut Drawing,
    ) {
        drawing.hold(view.width * view.height);
        let scope = Scope::whole(view.width, view.height);
        let objects = [PosedCloud::new(cloud, pose, 0)];
        let job = self.job(view, &scope);
        self.engine
            .render(&objects, lens, &job, None, &mut drawing.picture());
    }

    /// Draws a cloud as scanned and in other colours.
    pub fn draw_twice<L: Lens>(
        &self,
        twice: &Twice,
        pose: &[f64; 12],
        lens: &L,
        view: View,
        [scanned, coloured]: [&mut Drawing; 2],
    ) {
        // Wide splats are drawn by what their cloud holds, not by what the projection leaves of them.
        let Some(colours) = twice
            .colours
            .as_ref()
            .filter(|_| !view.exact_above.is_finite())
        else {
            self.draw(twice.scanned, pose, lens, view, scanned);
            return self.draw(twice.coloured, pose, lens, view, coloured);
        };
        let pictures = [scanned, coloured].map(|drawing| {
            drawing.hold(view.width * view.height);
            drawing.picture()
        });
        let [mut scanned, mut coloured] = pictures;
        let scope = Scope::whole(view.width, view.height);
        let object = PosedCloud::new(twice.scanned, pose, 0);
        let job = self.job(view, &scope);
        let pictures = [&mut scanned, &mut coloured];
        self.engine
            .render_twice(object, colours, lens, &job, pictures);
    }

    fn job<'b>(&'b self, view: View, scope: &'b Scope) -> Job<'b> {
        Job {
            view,
            scope,
            background: Background::Plain([0.0; 3]),
            simd: self.simd,
            pool: self.pool,
        }
    }
}

/// A cloud, and some of its splats in colours that are the same from all sides.
pub struct Twice<'a> {
    scanned: &'a Cloud,
    coloured: &'a Cloud,
    /// By the index of a splat as scanned: where the one projection serves both.
    colours: Option<Vec<Option<[f32; 3]>>>,
}

impl<'a> Twice<'a> {
    pub fn new(scanned: &'a Cloud, coloured: &'a Cloud) -> Self {
        Twice {
            scanned,
            coloured,
            colours: colours_by_splat(scanned, coloured),
        }
    }
}

/// The colour that each splat of a cloud has in another one, by its index; None if that one draws
/// what the cloud does not, or colours that depend on the side.
fn colours_by_splat(cloud: &Cloud, coloured: &Cloud) -> Option<Vec<Option<[f32; 3]>>> {
    if coloured.sh_count != 1 {
        return None;
    }
    let is_drawn = |cloud: &Cloud, index: usize| cloud.places[index] != u32::MAX;
    let mut left = coloured.originals.iter().enumerate().peekable();
    let mut colours = Vec::with_capacity(cloud.originals.len());
    for (index, splat) in cloud.originals.iter().enumerate() {
        let found = left.next_if(|(_, other)| *other == splat);
        let found = found.filter(|&(other, _)| is_drawn(coloured, other));
        if found.is_some() && !is_drawn(cloud, index) {
            return None;
        }
        colours.push(found.map(|(other, _)| even_colour(coloured, other)));
    }
    left.next().is_none().then_some(colours)
}

/// The colour of a splat from all sides, of which it has one coefficient.
fn even_colour(cloud: &Cloud, index: usize) -> [f32; 3] {
    let place = cloud.places[index] as usize;
    let nowhere = [[0.0; LANES]; 3];
    let eight = sh::colours(cloud.sh_of(place / LANES), 1, &nowhere);
    eight.map(|channel| channel[place % LANES])
}

impl Alone {
    /// Draws the cloud at `upright`: x, y, z and yaw of its pose in the world.
    pub fn draw<L: Lens>(
        &self,
        upright: [f64; 4],
        lens: &L,
        drawer: &Drawer,
        drawing: &mut Drawing,
    ) {
        let pose = camera_from_upright(&self.camera_from_world, upright);
        drawer.draw(&self.cloud, &pose, lens, self.view, drawing);
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
    use crate::scene::cloud::SplatArrays;

    /// Splats at these places, each with opacity `opacity` and its place for its colour.
    fn cloud_of(places: &[f32], opacity: f32) -> Cloud {
        let all = |values: &[f32]| values.repeat(places.len());
        let means: Vec<f32> = places.iter().flat_map(|&x| [x, 0.0, 1.0]).collect();
        let sh: Vec<f32> = places.iter().flat_map(|&x| [x; 3]).collect();
        Cloud::new(SplatArrays {
            means: &means,
            scales: &all(&[0.1, 0.1, 0.1]),
            rotations: &all(&[1.0, 0.0, 0.0, 0.0]),
            opacities: &all(&[opacity]),
            sh: &sh,
            sh_count: 1,
        })
    }

    #[test]
    fn splats_that_another_cloud_has_get_its_colours() {
        let (cloud, some) = (cloud_of(&[0.3, 0.1, 0.2], 0.9), cloud_of(&[0.3, 0.2], 0.9));
        let colours = colours_by_splat(&cloud, &some).expect("one projection serves both");
        let wanted = [Some(0.3f32), None, Some(0.2)].map(|x| x.map(|x| 0.5 + 0.282_094_8 * x));
        assert_eq!(colours, wanted.map(|value| value.map(|value| [value; 3])));
    }

    #[test]
    fn one_projection_does_not_serve_a_cloud_of_other_splats() {
        let cloud = cloud_of(&[0.3, 0.1, 0.2], 0.9);
        for other in [&[0.3, 0.4][..], &[0.2, 0.3], &[0.3, 0.1, 0.2, 0.2]] {
            assert!(colours_by_splat(&cloud, &cloud_of(other, 0.9)).is_none());
        }
        assert!(colours_by_splat(&cloud, &cloud_of(&[0.3], 0.8)).is_none());
    }

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
