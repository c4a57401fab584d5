//! What Python sees of the crate. Shapes and dtypes are checked by `scenes.render.native`; the checks
//! here only keep a wrong call from reading out of bounds.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::camera::{Fisheye, Pinhole};
use crate::pool::Pools;
use crate::project::{PosedCloud, View};
use crate::render::{self, Job, Picture, MAX_SIDE};
use crate::scene::{Cloud, SplatArrays};
use crate::simd::Simd;

/// A splat cloud prepared for drawing.
#[pyclass(frozen, module = "scenes._native", name = "PreparedCloud")]
pub struct PreparedCloud {
    pub(crate) cloud: Arc<Cloud>,
}

#[pymethods]
impl PreparedCloud {
    #[new]
    #[pyo3(signature = (means, scales, rotations, opacities, sh))]
    fn new(
        py: Python<'_>,
        means: PyReadonlyArray1<'_, f32>,
        scales: PyReadonlyArray1<'_, f32>,
        rotations: PyReadonlyArray1<'_, f32>,
        opacities: PyReadonlyArray1<'_, f32>,
        sh: PyReadonlyArray1<'_, f32>,
    ) -> PyResult<Self> {
        let opacities = opacities.as_slice()?;
        let n = opacities.len();
        let sh = sh.as_slice()?;
        let sh_count = sh.len() / (3 * n.max(1));
        let arrays = SplatArrays {
            means: checked("means", means.as_slice()?, 3 * n)?,
            scales: checked("scales", scales.as_slice()?, 3 * n)?,
            rotations: checked("rotations", rotations.as_slice()?, 4 * n)?,
            opacities,
            sh: checked("sh", sh, 3 * n * sh_count)?,
            sh_count,
        };
        if n > 0 && ![1, 4, 9, 16].contains(&sh_count) {
            return Err(PyValueError::new_err(format!(
                "sh: {sh_count} coefficients per splat, wanted 1, 4, 9 or 16"
            )));
        }
        let cloud = py.detach(|| Cloud::new(arrays));
        Ok(PreparedCloud {
            cloud: Arc::new(cloud),
        })
    }

    /// Splats that can be drawn.
    #[getter]
    fn count(&self) -> usize {
        self.cloud.count
    }

    /// Splats dropped because they are damaged.
    #[getter]
    fn dropped(&self) -> usize {
        self.cloud.dropped
    }
}

fn checked<'a>(name: &str, values: &'a [f32], wanted: usize) -> PyResult<&'a [f32]> {
    if values.len() != wanted {
        let got = values.len();
        return Err(PyValueError::new_err(format!(
            "{name}: {got} values, wanted {wanted}"
        )));
    }
    Ok(values)
}

/// Flat arrays of a picture: rgb, alpha, depth, ids.
pub(crate) type PictureArrays<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<i32>>,
);

/// Draws prepared clouds; keeps threads and buffers between pictures.
#[pyclass(frozen, module = "scenes._native", name = "Engine")]
pub struct Engine {
    engine: render::Engine,
    pub(crate) pools: Pools,
    pub(crate) simd: Simd,
}

#[pymethods]
impl Engine {
    #[new]
    #[pyo3(signature = (*, portable = false, instructions = None))]
    fn new(portable: bool, instructions: Option<&str>) -> PyResult<Self> {
        let simd = match instructions {
            None if portable => Simd::SCALAR,
            None => Simd::detect(),
            Some(name) => Simd::named(name).ok_or_else(|| {
                let known: Vec<&str> = Simd::available().into_iter().map(Simd::name).collect();
                let known = known.join(", ");
                PyValueError::new_err(format!(
                    "instructions: got {name:?}, wanted one this machine has: {known}"
                ))
            })?,
        };
        Ok(Engine {
            engine: render::Engine::default(),
            pools: Pools::default(),
            simd,
        })
    }

    /// Instruction sets this machine has, the narrowest first.
    #[staticmethod]
    fn available() -> Vec<&'static str> {
        Simd::available().into_iter().map(Simd::name).collect()
    }

    /// Instruction set in use.
    #[getter]
    fn simd(&self) -> &'static str {
        self.simd.name()
    }

    /// Draws through u = fx·x/z + cx; `focal` = (fx, fy).
    #[pyo3(signature = (clouds, camera_from_object, *, size, focal, centre, background, near,
                        antialias, sh_degree, threads))]
    #[allow(clippy::too_many_arguments)] // Python names them all
    fn render_pinhole<'py>(
        &self,
        py: Python<'py>,
        clouds: Vec<Bound<'py, PreparedCloud>>,
        camera_from_object: PyReadonlyArray2<'py, f64>,
        size: (usize, usize),
        focal: [f64; 2],
        centre: [f64; 2],
        background: [f32; 3],
        near: f64,
        antialias: bool,
        sh_degree: usize,
        threads: usize,
    ) -> PyResult<PictureArrays<'py>> {
        let lens = Pinhole {
            width: size.0 as f64,
            height: size.1 as f64,
            focal,
            centre,
        };
        let view = view_of(size, near, antialias, sh_degree)?;
        let poses = camera_from_object.as_slice()?;
        self.render(py, &clouds, poses, &lens, view, background, threads)
    }

    /// Draws through r = focal·angle, up to `max_angle` radians off axis.
    #[pyo3(signature = (clouds, camera_from_object, *, size, focal, centre, max_angle, background,
                        near, antialias, sh_degree, threads))]
    #[allow(clippy::too_many_arguments)] // Python names them all
    fn render_fisheye<'py>(
        &self,
        py: Python<'py>,
        clouds: Vec<Bound<'py, PreparedCloud>>,
        camera_from_object: PyReadonlyArray2<'py, f64>,
        size: (usize, usize),
        focal: f64,
        centre: [f64; 2],
        max_angle: f64,
        background: [f32; 3],
        near: f64,
        antialias: bool,
        sh_degree: usize,
        threads: usize,
    ) -> PyResult<PictureArrays<'py>> {
        let lens = Fisheye {
            focal,
            centre,
            max_angle,
        };
        let view = view_of(size, near, antialias, sh_degree)?;
        let poses = camera_from_object.as_slice()?;
        self.render(py, &clouds, poses, &lens, view, background, threads)
    }
}

impl Engine {
    #[allow(clippy::too_many_arguments)] // the two public methods spell out what differs
    fn render<'py, L: crate::camera::Lens>(
        &self,
        py: Python<'py>,
        clouds: &[Bound<'py, PreparedCloud>],
        poses: &[f64],
        lens: &L,
        view: View,
        background: [f32; 3],
        threads: usize,
    ) -> PyResult<PictureArrays<'py>> {
        let objects = posed_clouds(clouds, poses)?;
        let pixels = view.width * view.height;
        let rgb = PyArray1::zeros(py, 3 * pixels, false);
        let alpha = PyArray1::zeros(py, pixels, false);
        let depth = PyArray1::zeros(py, pixels, false);
        let ids = PyArray1::zeros(py, pixels, false);
        {
            let mut rgb = rgb.readwrite();
            let mut alpha = alpha.readwrite();
            let mut depth = depth.readwrite();
            let mut ids = ids.readwrite();
            let mut picture = Picture {
                rgb: rgb.as_slice_mut()?,
                alpha: alpha.as_slice_mut()?,
                depth: depth.as_slice_mut()?,
                ids: ids.as_slice_mut()?,
            };
            let pool = self
                .pools
                .get(threads)
                .map_err(|error| PyRuntimeError::new_err(format!("threads: {error}")))?;
            let job = Job {
                view,
                background,
                simd: self.simd,
                pool: &pool,
            };
            py.detach(|| self.engine.render(&objects, lens, &job, &mut picture));
        }
        Ok((rgb, alpha, depth, ids))
    }
}

/// Clouds with their poses, twelve values (3×4, row by row) each.
pub(crate) fn posed_clouds<'a>(
    clouds: &'a [Bound<'_, PreparedCloud>],
    poses: &[f64],
) -> PyResult<Vec<PosedCloud<'a>>> {
    if poses.len() != 12 * clouds.len() {
        return Err(PyValueError::new_err(format!(
            "camera_from_object: {} values, wanted 12 for each of {} clouds",
            poses.len(),
            clouds.len()
        )));
    }
    Ok(clouds
        .iter()
        .zip(poses.chunks_exact(12))
        .enumerate()
        .map(|(index, (cloud, pose))| PosedCloud {
            cloud: &cloud.get().cloud,
            rotation: std::array::from_fn(|row| std::array::from_fn(|k| pose[4 * row + k])),
            translation: std::array::from_fn(|row| pose[4 * row + 3]),
            object: index as u32,
        })
        .collect())
}

pub(crate) fn view_of(
    (width, height): (usize, usize),
    near: f64,
    antialias: bool,
    sh_degree: usize,
) -> PyResult<View> {
    if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
        return Err(PyValueError::new_err(format!(
            "camera: {width}×{height} px, wanted 1 to {MAX_SIDE} each way"
        )));
    }
    if sh_degree > 3 || !(near > 0.0 && near.is_finite()) {
        return Err(PyValueError::new_err(format!(
            "sh_degree {sh_degree} (wanted 0 to 3), near {near} m (wanted finite, above 0)"
        )));
    }
    Ok(View {
        width,
        height,
        near,
        antialias,
        sh_degree,
    })
}
