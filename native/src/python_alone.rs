//! What Python sees of a cloud that is drawn alone: made once, drawn at many poses by others.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::alone::{Alone as PlainAlone, Drawing};
use crate::python::{Engine, PreparedCloud};
use crate::python_request::{pool_of, with_lens, AnyLens, DrawRequest, LensRequest};

/// A cloud drawn alone on black through one camera.
#[pyclass(frozen, module = "scenes._native", name = "Alone")]
pub struct Alone {
    alone: PlainAlone,
    lens: AnyLens,
    threads: usize,
    engine: Py<Engine>,
}

#[pymethods]
impl Alone {
    #[new]
    #[pyo3(signature = (engine, cloud, camera_from_world, *, lens, draw))]
    fn new(
        engine: Py<Engine>,
        cloud: &Bound<'_, PreparedCloud>,
        camera_from_world: [f64; 12],
        lens: LensRequest,
        draw: DrawRequest<'_>,
    ) -> PyResult<Self> {
        let view = draw.view(&lens)?;
        let alone = PlainAlone {
            cloud: Arc::clone(&cloud.get().cloud),
            view,
            camera_from_world,
        };
        Ok(Alone {
            alone,
            lens: lens.lens(),
            threads: draw.threads,
            engine,
        })
    }
}

impl Alone {
    /// How many pixels it is drawn with each way per pixel of a picture of `size`.
    pub(crate) fn finer_than(&self, size: [usize; 2]) -> PyResult<usize> {
        let own = [self.alone.view.width, self.alone.view.height];
        let finer = own[0] / size[0];
        if finer > 0 && own == size.map(|side| finer * side) {
            return Ok(finer);
        }
        Err(PyValueError::new_err(format!(
            "alone: drawn with {own:?} px, wanted a whole multiple of {size:?} px"
        )))
    }

    pub(crate) fn pool(&self) -> PyResult<Arc<ThreadPool>> {
        pool_of(&self.engine.get().pools, self.threads)
    }

    /// Draws the cloud at x, y, z and yaw of its pose in the world.
    pub(crate) fn draw(&self, upright: [f64; 4], pool: &ThreadPool, drawing: &mut Drawing) {
        let Engine { engine, simd, .. } = self.engine.get();
        with_lens!(&self.lens, lens => self.alone.draw(upright, lens, engine, *simd, pool, drawing));
    }
}
