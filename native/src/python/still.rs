//! What Python sees of `still`.

use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::project::posed::View;
use crate::project::scope::Scope;
use crate::python::cloud::PreparedCloud;
use crate::python::engine::Engine;
use crate::python::lens::{with_lens, AnyLens, LensRequest};
use crate::python::request::{
    picture_arrays, pool_of, pose_rows, with_picture, DrawRequest, KeptBackground, PictureArrays,
};
use crate::render::job::Job;
use crate::render::still::{Placed, Still};

/// The picture of a camera that stands still, and what it was drawn from.
#[pyclass(frozen, module = "scenes._native", name = "StillPicture")]
pub struct StillPicture {
    lens: AnyLens,
    view: View,
    scope: Scope,
    background: KeptBackground,
    still: Mutex<Still>,
    rgb: Py<PyArray1<f32>>,
    alpha: Py<PyArray1<f32>>,
    depth: Py<PyArray1<f32>>,
    ids: Py<PyArray1<i32>>,
}

#[pymethods]
impl StillPicture {
    #[new]
    #[pyo3(signature = (*, lens, draw))]
    fn new(py: Python<'_>, lens: LensRequest, draw: DrawRequest<'_>) -> PyResult<Self> {
        let view = draw.view(&lens)?;
        let (rgb, alpha, depth, ids) = picture_arrays(py, &view);
        Ok(StillPicture {
            lens: lens.lens(),
            view,
            scope: draw.scope(&view)?,
            background: KeptBackground::of(&draw.background(&view)?),
            still: Mutex::default(),
            rgb: rgb.unbind(),
            alpha: alpha.unbind(),
            depth: depth.unbind(),
            ids: ids.unbind(),
        })
    }

    /// Flat rgb, alpha, depth and ids; each update writes into these same arrays.
    #[getter]
    fn arrays<'py>(&self, py: Python<'py>) -> PictureArrays<'py> {
        (
            self.rgb.bind(py).clone(),
            self.alpha.bind(py).clone(),
            self.depth.bind(py).clone(),
            self.ids.bind(py).clone(),
        )
    }

    /// Draws what changed since the last update; returns one flag per 16×16 tile, row by row.
    #[pyo3(signature = (engine, clouds, camera_from_object, *, threads))]
    fn update<'py>(
        &self,
        py: Python<'py>,
        engine: &Bound<'py, Engine>,
        clouds: Vec<Bound<'py, PreparedCloud>>,
        camera_from_object: PyReadonlyArray2<'py, f64>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let poses = pose_rows(camera_from_object.as_slice()?, clouds.len())?;
        let objects = clouds
            .iter()
            .zip(poses)
            .map(|(cloud, pose)| Placed {
                cloud: cloud.get().cloud.clone(),
                pose,
            })
            .collect();
        let engine = engine.get();
        let pool = pool_of(&engine.pools, threads)?;
        let job = Job {
            view: self.view,
            scope: &self.scope,
            background: self.background.borrow(),
            simd: engine.simd,
            pool: &pool,
        };
        // Borrowing the arrays refuses a second update at the same time.
        let touched = with_picture(&self.arrays(py), &self.view, |picture| {
            py.detach(|| {
                let mut still = self.still.lock().unwrap_or_else(PoisonError::into_inner);
                with_lens!(&self.lens, lens => still.update(objects, lens, &job, picture))
            })
        })?;
        Ok(PyArray1::from_vec(py, touched))
    }
}
