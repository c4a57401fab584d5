//! An object at many poses: at each it is placed in a window, drawn there alone and weighed.
//! `tracking.likelihood.pose_likelihood.pose_support` does so for one.

use rayon::prelude::*;

use crate::camera::lens::Lens;
use crate::project::posed::View;
use crate::render::alone::{Drawer, Drawing, Twice};
use crate::track::appearance::compared::{Drawn, Part, Window};
use crate::track::appearance::support::{support, Support, SupportModel, Terms};

/// The constants of `tracking.likelihood.drawn_object`, and of terms in `pose_likelihood`.
#[derive(Clone, Copy)]
pub struct Placing {
    /// Margin around an object's box that is drawn: px, and radii.
    pub margin_px: f64,
    pub ring: f64,
    /// Objects drawn smaller than this, px, are drawn at twice the size.
    pub fine_px: usize,
    /// Reach of what is unknown, radii.
    pub reach: f64,
    /// Side of the square that shares one error: px of the window, and m on the object.
    pub shared_px: f64,
    pub shared_m: f64,
}

/// How exactly a pose has to be right.
#[derive(Clone, Copy)]
pub struct Tolerance {
    pub sigma: f32,
    pub most_misfit: f32,
    pub occluded: f32,
}

/// An object as scanned and coloured by where it faces, in its own frame.
pub struct Body<'a> {
    /// Of its box, m.
    pub corners: [[f64; 3]; 8],
    pub radius_m: f64,
    /// For pictures of it, by size.
    pub levels: Vec<Twice<'a>>,
}

/// A pose.
pub struct Posed {
    /// Row-major 3×4.
    pub camera_from_object: [f64; 12],
    /// Radius of the object there, px of the window.
    pub radius_px: f64,
    /// Which of the levels is drawn.
    pub level: usize,
}

/// A window in which poses of a body are compared.
pub struct Comparison<'a, L: Lens> {
    pub window: Window<'a>,
    pub lens: &'a L,
    /// Of the window.
    pub view: View,
    pub body: Body<'a>,
    pub placing: Placing,
    pub tolerance: Tolerance,
    pub model: &'a SupportModel,
    pub drawer: Drawer<'a>,
}

/// Buffers kept from one pose to the next.
#[derive(Default)]
struct Pictures {
    scanned: Drawing,
    compass: Drawing,
}

impl<L: Lens> Comparison<'_, L> {
    /// What the window says for each pose; nothing for those outside. The same to the bit for any
    /// number of threads.
    pub fn supports(&self, poses: &[Posed]) -> Vec<Support> {
        let each = || {
            let poses = poses.par_iter();
            let supports = poses.map_init(Pictures::default, |pictures, posed| {
                self.support(posed, pictures)
            });
            supports.collect()
        };
        self.drawer.pool.install(each)
    }

    fn support(&self, posed: &Posed, pictures: &mut Pictures) -> Support {
        let Some(part) = self.part(posed) else {
            return Support::default();
        };
        let finer = match part.width.max(part.height) < self.placing.fine_px {
            true => 2,
            false => 1,
        };
        let corner = [part.left, part.top].map(|at| at as f64);
        let size = [part.width, part.height].map(|side| side as f64);
        let lens = self.lens.of_part(corner, size, finer as f64);
        let view = View {
            width: finer * part.width,
            height: finer * part.height,
            ..self.view
        };
        let Pictures { scanned, compass } = pictures;
        let level = &self.body.levels[posed.level];
        let pose = &posed.camera_from_object;
        let pictures = [&mut *scanned, &mut *compass];
        self.drawer.draw_twice(level, pose, &lens, view, pictures);
        let drawn = Drawn {
            finer,
            rgb: &scanned.rgb,
            alpha: &scanned.alpha,
            depth: &scanned.depth,
            compass: &compass.rgb,
            compass_alpha: &compass.alpha,
        };
        let terms = self.terms(posed, part);
        self.drawer.simd.run(
            #[inline(always)]
            || support(&self.window, &drawn, &terms, self.model),
        )
    }

    /// The part of the window around the body's box; None if it is outside.
    fn part(&self, posed: &Posed) -> Option<Part> {
        let window = [self.view.width as f64, self.view.height as f64];
        let circle = self.lens.circle();
        let pose = &posed.camera_from_object;
        let in_camera = |[x, y, z]: [f64; 3]| {
            std::array::from_fn(|row| {
                let [a, b, c, away]: [f64; 4] = std::array::from_fn(|k| pose[4 * row + k]);
                a * x + b * y + c * z + away
            })
        };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut is_seen = false;
        for corner in self.body.corners {
            let seen = self.lens.project(in_camera(corner));
            let pixel = [seen.u, seen.v];
            for axis in 0..2 {
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
            let is_inside = (0..2).all(|axis| (0.0..=window[axis]).contains(&pixel[axis]));
            let is_in_circle =
                circle.is_none_or(|(radius, [x, y])| (pixel[0] - x).hypot(pixel[1] - y) <= radius);
            is_seen |= seen.drawable && is_inside && is_in_circle;
        }
        let margin = self.placing.margin_px + self.placing.ring * posed.radius_px;
        let low = low.map(|at| (at - margin).floor().max(0.0));
        let high: [f64; 2] =
            std::array::from_fn(|axis| (high[axis] + margin).ceil().min(window[axis]));
        let is_part = is_seen && (0..2).all(|axis| low[axis] < high[axis]);
        is_part.then(|| Part {
            left: low[0] as usize,
            top: low[1] as usize,
            width: (high[0] - low[0]) as usize,
            height: (high[1] - low[1]) as usize,
        })
    }

    fn terms(&self, posed: &Posed, part: Part) -> Terms {
        let Placing {
            ring,
            reach,
            shared_px,
            shared_m,
            ..
        } = self.placing;
        let radius = posed.radius_px;
        let scan_px = radius * shared_m / self.body.radius_m;
        Terms {
            part,
            ring_px: (ring * radius).round_ties_even().max(1.0) as usize,
            reach_px: (reach * radius) as f32,
            shared_px2: shared_px * shared_px + scan_px * scan_px,
            sigma: self.tolerance.sigma,
            most_misfit: self.tolerance.most_misfit,
            occluded: self.tolerance.occluded,
        }
    }
}
