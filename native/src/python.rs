//! What Python sees of the crate: prepared clouds and the engine that draws them.

use std::sync::Arc;

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::pool::Pools;
use crate::python_request::{
    check_length, pool_of, posed_clouds, with_lens, with_picture, DrawRequest, LensRequest,
    PictureArrays,
};
use crate::render::{self, Job};
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
            means: means.as_slice()?,
            scales: scales.as_slice()?,
            rotations: rotations.as_slice()?,
            opacities,
            sh,
            sh_count,
        };
        check_length("means", arrays.means, 3 * n)?;
        check_length("scales", arrays.scales, 3 * n)?;
        check_length("rotations", arrays.rotations, 4 * n)?;
        check_length("sh", arrays.sh, 3 * n * sh_count)?;
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

/// Draws prepared clouds; keeps threads and buffers between pictures.
#[pyclass(frozen, module = "scenes._native", name = "Engine")]
pub struct Engine {
    pub(crate) engine: render::Engine,
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

    /// Left, top, right and bottom, in pixels, of a part outside which nothing of these clouds is
    /// drawn; None if nothing is.
    #[pyo3(signature = (clouds, camera_from_object, *, lens, draw))]
    fn reach<'py>(
        &self,
        py: Python<'py>,
        clouds: Vec<Bound<'py, PreparedCloud>>,
        camera_from_object: PyReadonlyArray2<'py, f64>,
        lens: LensRequest,
        draw: DrawRequest<'py>,
    ) -> PyResult<Option<[usize; 4]>> {
        let view = draw.view(&lens)?;
        let scope = draw.scope(&view)?;
        let pool = pool_of(&self.pools, draw.threads)?;
        let job = Job {
            view,
            scope: &scope,
            background: draw.background(&view)?,
            simd: self.simd,
            pool: &pool,
        };
        let objects = posed_clouds(&clouds, camera_from_object.as_slice()?)?;
        let lens = lens.lens();
        Ok(py.detach(|| with_lens!(&lens, lens => self.engine.reach(&objects, lens, &job))))
    }

    /// Draws clouds, each with its pose (twelve values, 3×4 row by row), over what is in `picture`.
    #[pyo3(signature = (clouds, camera_from_object, *, lens, draw, picture))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        clouds: Vec<Bound<'py, PreparedCloud>>,
        camera_from_object: PyReadonlyArray2<'py, f64>,
        lens: LensRequest,
        draw: DrawRequest<'py>,
        picture: PictureArrays<'py>,
    ) -> PyResult<()> {
        let view = draw.view(&lens)?;
        let scope = draw.scope(&view)?;
        let pool = pool_of(&self.pools, draw.threads)?;
        let job = Job {
            view,
            scope: &scope,
            background: draw.background(&view)?,
            simd: self.simd,
            pool: &pool,
        };
        let objects = posed_clouds(&clouds, camera_from_object.as_slice()?)?;
        let marked = draw.marked;
        let lens = lens.lens();
        with_picture(&picture, &view, |picture| {
            py.detach(
                || with_lens!(&lens, lens => self.engine.render(&objects, lens, &job, marked, picture)),
            );
        })
    }
}
