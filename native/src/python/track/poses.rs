//! How Python asks for the likelihood of an object at many poses.

use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::python::check::check_length;
use crate::python::cloud::PreparedCloud;
use crate::python::engine::Engine;
use crate::python::lens::LensRequest;
use crate::python::request::{pose_rows, DrawRequest};
use crate::render::alone::Twice;
use crate::track::appearance::poses::{Body, Placing, Posed, Tolerance};

type Doubles<'py> = PyReadonlyArrayDyn<'py, f64>;

/// By whom it is drawn, through which lens and how.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct DrawingRequest<'py> {
    pub(crate) engine: Bound<'py, Engine>,
    pub(crate) lens: LensRequest,
    pub(crate) draw: DrawRequest<'py>,
}

/// An object; of every level, as scanned and coloured by where it faces.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct BodyRequest<'py> {
    corners: [[f64; 3]; 8],
    radius_m: f64,
    levels: Vec<[Bound<'py, PreparedCloud>; 2]>,
}

impl BodyRequest<'_> {
    pub(crate) fn plain(&self) -> Body<'_> {
        let levels = self.levels.iter();
        Body {
            corners: self.corners,
            radius_m: self.radius_m,
            levels: levels
                .map(|[scanned, compass]| Twice::new(&scanned.get().cloud, &compass.get().cloud))
                .collect(),
        }
    }
}

/// Poses, row by row, and how each is placed and compared.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PosesRequest<'py> {
    camera_from_object: Doubles<'py>,
    radius_px: Doubles<'py>,
    /// By pose, which of the body's levels is drawn.
    level: Vec<usize>,
    margin_px: f64,
    ring: f64,
    fine_px: usize,
    reach: f64,
    shared_px: f64,
    shared_m: f64,
    sigma: f32,
    most_misfit: f32,
    occluded: f32,
}

impl PosesRequest<'_> {
    /// The poses of an object with so many levels.
    pub(crate) fn poses(&self, levels: usize) -> PyResult<Vec<Posed>> {
        let count = self.level.len();
        let radius_px = self.radius_px.as_slice()?;
        check_length("radius_px", radius_px, count)?;
        if let Some(level) = self.level.iter().find(|&&level| level >= levels) {
            return Err(PyValueError::new_err(format!(
                "level: {level}, wanted one below {levels}"
            )));
        }
        let rows = pose_rows(self.camera_from_object.as_slice()?, count)?;
        let each = rows.zip(radius_px).zip(&self.level);
        Ok(each
            .map(|((camera_from_object, &radius_px), &level)| Posed {
                camera_from_object,
                radius_px,
                level,
            })
            .collect())
    }

    pub(crate) fn placing(&self) -> Placing {
        Placing {
            margin_px: self.margin_px,
            ring: self.ring,
            fine_px: self.fine_px,
            reach: self.reach,
            shared_px: self.shared_px,
            shared_m: self.shared_m,
        }
    }

    pub(crate) fn tolerance(&self) -> Tolerance {
        Tolerance {
            sigma: self.sigma,
            most_misfit: self.most_misfit,
            occluded: self.occluded,
        }
    }
}
