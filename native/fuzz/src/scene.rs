//! Bytes to a scene. Splats may hold any values; what Python refuses before it calls (cameras,
//! options, poses) stays within what it lets through.

use std::f64::consts::PI;

use _native::camera::lens::{FOCAL_PX, MAX_CENTRE_PX};
use _native::project::posed::{PosedCloud, View};
use _native::scene::cloud::{Cloud, SplatArrays};

const MAX_SPLATS: usize = 40;
const MAX_SIDE: usize = 40;
const SH_COUNTS: [usize; 4] = [1, 4, 9, 16];

/// What Python lets through.
const MAX_BACKGROUND: f32 = 1e15;

/// Values at which float code breaks.
const ODD: [f32; 16] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    0.0,
    -0.0,
    1e-45,
    1.2e-38,
    -1.0,
    1.0,
    3e38,
    -3e38,
    1e9,
    1e4,
    1e-9,
    0.99,
    1.0 / 255.0,
];

/// Reads values from bytes; past the end everything is zero.
pub struct Bytes<'a> {
    left: &'a [u8],
}

impl<'a> Bytes<'a> {
    pub fn new(left: &'a [u8]) -> Self {
        Bytes { left }
    }

    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.left.split_first() else {
            return 0;
        };
        self.left = rest;
        first
    }

    fn upto(&mut self, most: usize) -> usize {
        usize::from(self.byte()) % (most + 1)
    }

    /// 0..1 in 2^16 steps.
    fn share(&mut self) -> f64 {
        f64::from(u16::from_le_bytes([self.byte(), self.byte()])) / 65535.0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.share() * (high - low)
    }

    /// Within the limits most of the time; else odd, or four bytes as they are.
    fn wild(&mut self, low: f64, high: f64) -> f32 {
        match self.byte() {
            odd @ 0..=15 => ODD[usize::from(odd)],
            16..=23 => f32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()]),
            _ => self.between(low, high) as f32,
        }
    }

    /// A finite number, mostly within the limits.
    fn finite(&mut self, low: f64, high: f64) -> f64 {
        let value = f64::from(self.wild(low, high));
        if value.is_finite() {
            value
        } else {
            low
        }
    }

    /// A finite number above zero.
    fn positive(&mut self, low: f64, high: f64) -> f64 {
        let value = self.finite(low, high);
        if value > 0.0 {
            value
        } else {
            low
        }
    }
}

/// A cloud and where it is.
struct Object {
    cloud: Cloud,
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

/// Everything that is drawn.
pub struct Scene {
    objects: Vec<Object>,
    pub view: View,
    pub focal: [f64; 2],
    pub centre: [f64; 2],
    /// None for a pinhole.
    pub max_angle: Option<f64>,
    pub background: [f32; 3],
}

impl Scene {
    pub fn new(bytes: &mut Bytes) -> Scene {
        let view = View {
            width: 1 + bytes.upto(MAX_SIDE - 1),
            height: 1 + bytes.upto(MAX_SIDE - 1),
            near: bytes.positive(1e-3, 1.0),
            antialias: bytes.upto(1) == 1,
            sh_degree: bytes.upto(3),
            exact_above: f64::INFINITY,
        };
        let is_pinhole = bytes.upto(1) == 0;
        let [shortest, longest] = FOCAL_PX;
        let focal = std::array::from_fn(|_| bytes.positive(1.0, 200.0).clamp(shortest, longest));
        let centre = std::array::from_fn(|_| {
            let place = bytes.finite(-10.0, 50.0);
            place.clamp(-MAX_CENTRE_PX, MAX_CENTRE_PX)
        });
        let max_angle = bytes.between(0.01, PI);
        let background = std::array::from_fn(|_| {
            let channel = bytes.finite(0.0, 1.0) as f32;
            channel.clamp(-MAX_BACKGROUND, MAX_BACKGROUND)
        });
        Scene {
            objects: (0..1 + bytes.upto(1)).map(|_| object(bytes)).collect(),
            view,
            focal,
            centre,
            max_angle: (!is_pinhole).then_some(max_angle),
            background,
        }
    }

    pub fn posed(&self) -> Vec<PosedCloud<'_>> {
        let posed = self
            .objects
            .iter()
            .enumerate()
            .map(|(index, object)| PosedCloud {
                cloud: &object.cloud,
                rotation: object.rotation,
                translation: object.translation,
                object: index as u32,
            });
        posed.collect()
    }
}

fn object(bytes: &mut Bytes) -> Object {
    let count = bytes.upto(MAX_SPLATS);
    let sh_count = SH_COUNTS[bytes.upto(3)];
    let many = |bytes: &mut Bytes, each: usize, low: f64, high: f64| -> Vec<f32> {
        (0..each * count).map(|_| bytes.wild(low, high)).collect()
    };
    // Depth is along the third axis: most means lie in front of the camera.
    let mut means = many(bytes, 3, -1.0, 1.0);
    for mean in means.chunks_exact_mut(3) {
        mean[2] += 1.0;
    }
    let scales: Vec<f32> = many(bytes, 3, -7.0, 0.5)
        .into_iter()
        .map(|v| {
            if (-7.0..=0.5).contains(&v) {
                v.exp()
            } else {
                v
            }
        })
        .collect();
    let rotations = many(bytes, 4, -1.0, 1.0);
    let opacities = many(bytes, 1, 0.0, 1.0);
    let sh = many(bytes, 3 * sh_count, -1.0, 1.0);
    Object {
        cloud: Cloud::new(SplatArrays {
            means: &means,
            scales: &scales,
            rotations: &rotations,
            opacities: &opacities,
            sh: &sh,
            sh_count,
        }),
        rotation: rotation(bytes),
        translation: std::array::from_fn(|_| bytes.finite(-0.5, 0.5)),
    }
}

/// About z, then about x: proper to the last digits, as Python makes sure.
fn rotation(bytes: &mut Bytes) -> [[f64; 3]; 3] {
    let (sz, cz) = bytes.between(-PI, PI).sin_cos();
    let (sx, cx) = bytes.between(-PI, PI).sin_cos();
    [
        [cz, -sz, 0.0],
        [cx * sz, cx * cz, -sx],
        [sx * sz, sx * cz, cx],
    ]
}
