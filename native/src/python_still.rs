//! What Python sees of `still`.

use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::camera::{Fisheye, Pinhole};
use crate::project::View;
use crate::python::{view_of, Engine, PreparedCloud};
use crate::render::{Job, Picture};
use crate::still::{Placed, Still};

#[derive(Clone, Copy)]
enum AnyLens {
    Pinhole(Pinhole),
    Fisheye(Fisheye),
}

/// The picture of a camera that stands still, and what it was drawn from.
#[pyclass(frozen, module = "scenes._native", name = "StillPicture")]
pub struct StillPicture {
    lens: AnyLens,
    view: View,
    background: [f32; 3],
    still: Mutex<Still>,
    rgb: Py<PyArray1<f32>>,
    alpha: Py<PyArray1<f32>>,
    depth: Py<PyArray1<f32>>,
    ids: Py<PyArray1<i32>>,
}

#[pymethods]
impl StillPicture {
    /// A fisheye if `max_angle` is given (then the first focal length counts), else a pinhole.
    #[new]
    #[pyo3(signature = (*, size, focal, centre, max_angle, background, near, antialias, sh_degree))]
    #[allow(clippy::too_many_arguments)] // Python names them all
    fn new(
        py: Python<'_>,
        size: (usize, usize),
        focal: [f64; 2],
        centre: [f64; 2],
        max_angle: Option<f64>,
        background: [f32; 3],
        near: f64,
        antialias: bool,
        sh_degree: usize,
    ) -> PyResult<Self> {
        let view = view_of(size, near, antialias, sh_degree)?;
        let lens = match max_angle {
            Some(max_angle) => AnyLens::Fisheye(Fisheye {
                focal: focal[0],
                centre,
                max_angle,
            }),
            None => AnyLens::Pinhole(Pinhole {
                width: size.0 as f64,
                height: size.1 as f64,
                focal,
                centre,
            }),
        };
        let pixels = view.width * view.height;
        Ok(StillPicture {
            lens,
            view,
            background,
            still: Mutex::default(),
            rgb: PyArray1::zeros(py, 3 * pixels, false).unbind(),
            alpha: PyArray1::zeros(py, pixels, false).unbind(),
            depth: PyArray1::zeros(py, pixels, false).unbind(),
            ids: PyArray1::zeros(py, pixels, false).unbind(),
        })
    }

    /// Flat rgb, alpha, depth and ids; each update writes into these same arrays.
    #[getter]
    #[allow(clippy::type_complexity)] // the tuple is the documentation
    fn arrays(
        &self,
        py: Python<'_>,
    ) -> (
        Py<PyArray1<f32>>,
        Py<PyArray1<f32>>,
        Py<PyArray1<f32>>,
        Py<PyArray1<i32>>,
    ) {
        (
            self.rgb.clone_ref(py),
            self.alpha.clone_ref(py),
            self.depth.clone_ref(py),
            self.ids.clone_ref(py),
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
        let poses = camera_from_object.as_slice()?;
        if poses.len() != 12 * clouds.len() {
            return Err(PyValueError::new_err(format!(
                "camera_from_object: {} values, wanted 12 for each of {} clouds",
                poses.len(),
                clouds.len()
            )));
        }
        let objects: Vec<Placed> = clouds
            .iter()
            .zip(poses.chunks_exact(12))
            .map(|(cloud, pose)| Placed {
                cloud: cloud.get().cloud.clone(),
                pose: std::array::from_fn(|entry| pose[entry]),
            })
            .collect();
        let engine = engine.get();
        let pool = engine
            .pools
            .get(threads)
            .map_err(|error| PyRuntimeError::new_err(format!("threads: {error}")))?;
        let job = Job {
            view: self.view,
            background: self.background,
            simd: engine.simd,
            pool: &pool,
        };
        // Borrowing the arrays first refuses a second update at the same time.
        let mut rgb = self.rgb.bind(py).try_readwrite()?;
        let mut alpha = self.alpha.bind(py).try_readwrite()?;
        let mut depth = self.depth.bind(py).try_readwrite()?;
        let mut ids = self.ids.bind(py).try_readwrite()?;
        let mut picture = Picture {
            rgb: rgb.as_slice_mut()?,
            alpha: alpha.as_slice_mut()?,
            depth: depth.as_slice_mut()?,
            ids: ids.as_slice_mut()?,
        };
        let touched = py.detach(|| {
            let mut still = self.still.lock().unwrap_or_else(PoisonError::into_inner);
            match &self.lens {
                AnyLens::Pinhole(lens) => still.update(objects, lens, &job, &mut picture),
                AnyLens::Fisheye(lens) => still.update(objects, lens, &job, &mut picture),
            }
        });
        Ok(PyArray1::from_vec(py, touched))
    }
}
