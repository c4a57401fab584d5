//! What Python sees of a cloud that is drawn alone: made once, drawn at many poses by others.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::python::cloud::PreparedCloud;
use crate::python::engine::Engine;
use crate::python::lens::{with_lens, AnyLens, LensRequest};
use crate::python::request::{pool_of, DrawRequest};
use crate::render::alone::{Alone as PlainAlone, Drawer, Drawing};
use crate::scene::cloud::Cloud;

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

    /// Fails unless it is drawn with as many pixels as a picture of `size`.
    pub(crate) fn check_size(&self, size: [usize; 2]) -> PyResult<()> {
        let own = [self.alone.view.width, self.alone.view.height];
        match own == size {
            true => Ok(()),
            false => Err(PyValueError::new_err(format!(
                "alone: drawn with {own:?} px, wanted {size:?} px"
            ))),
        }
    }

    /// The same with another cloud.
    pub(crate) fn with(&self, py: Python<'_>, cloud: Cloud) -> Alone {
        Alone {
            alone: PlainAlone {
                cloud: Arc::new(cloud),
                ..self.alone
            },
            lens: self.lens.clone(),
            threads: self.threads,
            engine: self.engine.clone_ref(py),
        }
    }

    /// The cloud that is drawn.
    pub(crate) fn cloud(&self) -> &Cloud {
        &self.alone.cloud
    }

    /// From where it is seen at a pose, in its own frame.
    pub(crate) fn eye(&self, upright: [f64; 4]) -> [f64; 3] {
        self.alone.eye(upright)
    }

    pub(crate) fn pool(&self) -> PyResult<Arc<ThreadPool>> {
        pool_of(&self.engine.get().pools, self.threads)
    }

    /// Draws the cloud at x, y, z and yaw of its pose in the world.
    pub(crate) fn draw(&self, upright: [f64; 4], pool: &ThreadPool, drawing: &mut Drawing) {
        let Engine { engine, simd, .. } = self.engine.get();
        let simd = *simd;
        let drawer = Drawer { engine, simd, pool };
        with_lens!(&self.lens, lens => self.alone.draw(upright, lens, &drawer, drawing));
    }
}
