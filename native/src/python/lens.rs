//! How Python asks for a lens.

use pyo3::prelude::*;

use crate::camera::fisheye::Fisheye;
use crate::camera::kannala_brandt::KannalaBrandt;
use crate::camera::pinhole::Pinhole;

/// Any lens, as Python names it.
#[derive(Clone)]
pub(crate) enum AnyLens {
    Pinhole(Pinhole),
    Fisheye(Fisheye),
    KannalaBrandt(KannalaBrandt),
}

/// Runs the same work for the lens that there is, compiled for each.
macro_rules! with_lens {
    ($any:expr, $lens:ident => $work:expr) => {
        match $any {
            $crate::python::lens::AnyLens::Pinhole($lens) => $work,
            $crate::python::lens::AnyLens::Fisheye($lens) => $work,
            $crate::python::lens::AnyLens::KannalaBrandt($lens) => $work,
        }
    };
}
pub(crate) use with_lens;

/// A camera: a fisheye of the first focal length if it has a largest angle, else a pinhole.
/// A fisheye has a distortion only if a coefficient is not zero.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct LensRequest {
    size: (usize, usize),
    focal: [f64; 2],
    centre: [f64; 2],
    max_angle: Option<f64>,
    distortion: Option<[f64; 4]>,
}

impl LensRequest {
    /// Width and height in pixels.
    pub(crate) fn size(&self) -> (usize, usize) {
        self.size
    }

    pub(crate) fn lens(&self) -> AnyLens {
        let focal = self.focal[0];
        match (self.max_angle, self.distortion) {
            (Some(max_angle), Some(k)) => {
                AnyLens::KannalaBrandt(KannalaBrandt::new(focal, self.centre, max_angle, k))
            }
            (Some(max_angle), None) => AnyLens::Fisheye(Fisheye {
                focal,
                centre: self.centre,
                max_angle,
            }),
            (None, _) => AnyLens::Pinhole(Pinhole {
                width: self.size.0 as f64,
                height: self.size.1 as f64,
                focal: self.focal,
                centre: self.centre,
            }),
        }
    }
}
