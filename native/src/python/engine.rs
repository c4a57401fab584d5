//! What Python sees of the crate: prepared clouds and the engine that draws them.

use numpy::PyReadonlyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::pool::Pools;
use crate::machine::simd::Simd;
use crate::python::cloud::PreparedCloud;
use crate::python::lens::{with_lens, LensRequest};
use crate::python::request::{pool_of, posed_clouds, with_picture, DrawRequest, PictureArrays};
use crate::render::engine;

/// Draws prepared clouds; keeps threads and buffers between pictures.
#[pyclass(frozen, module = "scenes._native", name = "Engine")]
pub struct Engine {
    pub(crate) engine: engine::Engine,
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
            engine: engine::Engine::default(),
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
        let job = draw.job(view, &scope, self.simd, &pool)?;
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
        let job = draw.job(view, &scope, self.simd, &pool)?;
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
