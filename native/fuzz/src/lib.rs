//! Any bytes as a scene of splats, and what must hold whatever they are.

mod scene;

use std::sync::OnceLock;

use _native::camera::curvature::Curved;
use _native::camera::fisheye::Fisheye;
use _native::camera::pinhole::Pinhole;
use _native::gradients::tape::{PictureGradients, Tape};
use _native::machine::simd::Simd;
use _native::project::posed::PosedCloud;
use _native::project::scope::Scope;
use _native::render::engine::Engine;
use _native::render::job::{Background, Job, Picture};
use rayon::{ThreadPool, ThreadPoolBuilder};

use scene::{Bytes, Scene};

/// Alpha of two instruction sets, and colour relative to the brightest, may differ by this.
const TOLERANCE: f32 = 2e-4;

/// Draws the scene that the bytes describe with every instruction set, forward and backward.
///
/// # Panics
/// If a value of the picture is not finite, alpha leaves 0..1, a gradient is not a number, or two
/// instruction sets disagree.
pub fn check(bytes: &[u8]) {
    let mut bytes = Bytes::new(bytes);
    let scene = Scene::new(&mut bytes);
    let (focal, centre) = (scene.focal, scene.centre);
    match scene.max_angle {
        Some(max_angle) => check_through(
            &Fisheye {
                focal: focal[0],
                centre,
                max_angle,
            },
            &scene,
        ),
        None => check_through(
            &Pinhole {
                width: scene.view.width as f64,
                height: scene.view.height as f64,
                focal,
                centre,
            },
            &scene,
        ),
    }
}

fn check_through<L: Curved>(lens: &L, scene: &Scene) {
    let objects = scene.posed();
    let scope = Scope::whole(scene.view.width, scene.view.height);
    let mut first: Option<Outcome> = None;
    for simd in Simd::available() {
        let job = Job {
            view: scene.view,
            scope: &scope,
            background: Background::Plain(scene.background),
            simd,
            pool: pool(),
        };
        let outcome = Outcome::of(&objects, lens, &job);
        outcome.check_values();
        match &first {
            Some(portable) => outcome.check_against(portable, simd.name()),
            None => first = Some(outcome),
        }
    }
}

/// Everything that one instruction set makes of a scene.
struct Outcome {
    rgb: Vec<f32>,
    alpha: Vec<f32>,
    depth: Vec<f32>,
    gradients: Vec<f32>,
}

impl Outcome {
    fn of<L: Curved>(objects: &[PosedCloud], lens: &L, job: &Job) -> Outcome {
        let pixels = job.view.width * job.view.height;
        let draw = |tape: bool| {
            let (mut rgb, mut alpha) = (vec![0.0; 3 * pixels], vec![0.0; pixels]);
            let (mut depth, mut ids) = (vec![0.0; pixels], vec![0; pixels]);
            let mut picture = Picture {
                rgb: &mut rgb,
                alpha: &mut alpha,
                depth: &mut depth,
                ids: &mut ids,
            };
            let tape = if tape {
                Some(Tape::record(objects, lens, job, &mut picture))
            } else {
                Engine::default().render(objects, lens, job, None, &mut picture);
                None
            };
            assert!(ids.iter().all(|&id| id >= -1 && id < objects.len() as i32));
            (rgb, alpha, depth, tape)
        };
        let (rgb, alpha, depth, _) = draw(false);
        let (recorded, _, _, tape) = draw(true);
        assert!(rgb == recorded, "a recorded picture differs");
        let slopes: Vec<f32> = (0..pixels).map(|i| (i % 7) as f32 - 3.0).collect();
        let d_picture = PictureGradients {
            rgb: &slopes.repeat(3),
            alpha: &slopes,
            depth: &slopes,
        };
        let found = tape.map(|tape| tape.gradients(objects, lens, job, &d_picture));
        let gradients = found
            .into_iter()
            .flatten()
            .flat_map(|o| [o.means, o.scales, o.rotations, o.opacities, o.sh].concat())
            .collect();
        Outcome {
            rgb,
            alpha,
            depth,
            gradients,
        }
    }

    fn check_values(&self) {
        for (name, values) in [("rgb", &self.rgb), ("depth", &self.depth)] {
            assert!(values.iter().all(|v| v.is_finite()), "{name} {values:?}");
        }
        assert!(self.alpha.iter().all(|v| (0.0..=1.0).contains(v)));
        assert!(self.gradients.iter().all(|v| !v.is_nan()), "gradients");
    }

    fn check_against(&self, portable: &Outcome, name: &str) {
        let apart = |a: &[f32], b: &[f32]| {
            let pairs = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            pairs.fold(0.0, f32::max)
        };
        let brightest = portable
            .rgb
            .iter()
            .fold(1.0, |most: f32, v| most.max(v.abs()));
        let (alpha, rgb) = (
            apart(&self.alpha, &portable.alpha),
            apart(&self.rgb, &portable.rgb),
        );
        assert!(alpha <= TOLERANCE, "{name}: alpha is {alpha} apart");
        assert!(rgb <= TOLERANCE * brightest, "{name}: rgb is {rgb} apart");
    }
}

fn pool() -> &'static ThreadPool {
    static POOL: OnceLock<ThreadPool> = OnceLock::new();
    POOL.get_or_init(|| {
        let one = ThreadPoolBuilder::new().num_threads(1);
        one.build().expect("a thread can be started")
    })
}
