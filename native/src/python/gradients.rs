//! What Python sees of the gradients.

use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::gradients::tape;
use crate::gradients::tape::PictureGradients;
use crate::machine::pool::Pools;
use crate::machine::simd::Simd;
use crate::project::posed::View;
use crate::project::scope::Scope;
use crate::python::cloud::PreparedCloud;
use crate::python::lens::{with_lens, AnyLens, LensRequest};
use crate::python::request::{
    picture_arrays, pool_of, posed_clouds, with_picture, DrawRequest, KeptBackground, PictureArrays,
};
use crate::render::job::Job;

/// Flat gradients of one object: means, scales, rotations, opacities, sh, and its twist.
type ObjectArrays<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    [f64; 6],
);

/// Draws pictures that can be differentiated; keeps threads between them.
#[pyclass(frozen, module = "scenes._native", name = "Differentiator")]
pub struct Differentiator {
    pools: Pools,
    simd: Simd,
}

#[pymethods]
impl Differentiator {
    #[new]
    #[pyo3(signature = (*, instructions = None))]
    fn new(instructions: Option<&str>) -> PyResult<Self> {
        let simd = match instructions {
            None => Simd::detect(),
            Some(name) => Simd::named(name).ok_or_else(|| {
                PyValueError::new_err(format!("instructions: this machine has no {name:?}"))
            })?,
        };
        Ok(Differentiator {
            pools: Pools::default(),
            simd,
        })
    }

    /// Draws as `Engine` does, and remembers how.
    #[pyo3(signature = (clouds, camera_from_object, *, lens, draw))]
    fn record<'py>(
        &self,
        py: Python<'py>,
        clouds: Vec<Bound<'py, PreparedCloud>>,
        camera_from_object: PyReadonlyArray2<'py, f64>,
        lens: LensRequest,
        draw: DrawRequest<'py>,
    ) -> PyResult<(PictureArrays<'py>, Tape)> {
        let view = draw.view(&lens)?;
        let scope = draw.scope(&view)?;
        let pool = pool_of(&self.pools, draw.threads)?;
        let job = draw.job(view, &scope, self.simd, &pool)?;
        let poses = camera_from_object.as_slice()?.to_vec();
        let objects = posed_clouds(&clouds, &poses)?;
        let arrays = picture_arrays(py, &view);
        let lens = lens.lens();
        let tape = with_picture(&arrays, &view, |picture| {
            py.detach(
                || with_lens!(&lens, lens => tape::Tape::record(&objects, lens, &job, picture)),
            )
        })?;
        let background = KeptBackground::of(&job.background);
        let tape = Tape {
            tape,
            clouds: clouds.into_iter().map(Bound::unbind).collect(),
            poses,
            lens,
            view,
            scope,
            background,
            simd: self.simd,
            pool,
        };
        Ok((arrays, tape))
    }
}

/// A picture drawn by `Differentiator::record`, ready to be differentiated any number of times.
#[pyclass(frozen, module = "scenes._native", name = "Tape")]
pub struct Tape {
    tape: tape::Tape,
    clouds: Vec<Py<PreparedCloud>>,
    pub(crate) poses: Vec<f64>,
    pub(crate) lens: AnyLens,
    view: View,
    scope: Scope,
    background: KeptBackground,
    simd: Simd,
    pool: Arc<ThreadPool>,
}

#[pymethods]
impl Tape {
    /// Gradients of a loss, given its gradients with respect to the picture (flat arrays).
    #[pyo3(signature = (d_rgb, d_alpha, d_depth))]
    fn gradients<'py>(
        &self,
        py: Python<'py>,
        d_rgb: PyReadonlyArray1<'py, f32>,
        d_alpha: PyReadonlyArray1<'py, f32>,
        d_depth: PyReadonlyArray1<'py, f32>,
    ) -> PyResult<Vec<ObjectArrays<'py>>> {
        let d_picture = self.picture_gradients(&d_rgb, &d_alpha, &d_depth)?;
        let clouds = self.bound_clouds(py);
        let objects = posed_clouds(&clouds, &self.poses)?;
        let job = self.job();
        let gradients = py.detach(|| {
            with_lens!(&self.lens, lens => self.tape.gradients(&objects, lens, &job, &d_picture))
        });
        Ok(gradients
            .into_iter()
            .map(|object| {
                let [a, b, c] = object.twist.shift;
                let [d, e, f] = object.twist.turn;
                (
                    PyArray1::from_vec(py, object.means),
                    PyArray1::from_vec(py, object.scales),
                    PyArray1::from_vec(py, object.rotations),
                    PyArray1::from_vec(py, object.opacities),
                    PyArray1::from_vec(py, object.sh),
                    [a, b, c, d, e, f],
                )
            })
            .collect())
    }
}

impl Tape {
    pub(crate) fn job(&self) -> Job<'_> {
        Job {
            view: self.view,
            scope: &self.scope,
            background: self.background.borrow(),
            simd: self.simd,
            pool: &self.pool,
        }
    }

    pub(crate) fn bound_clouds<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PreparedCloud>> {
        self.clouds
            .iter()
            .map(|cloud| cloud.bind(py).clone())
            .collect()
    }

    pub(crate) fn picture_gradients<'a>(
        &self,
        d_rgb: &'a PyReadonlyArray1<'_, f32>,
        d_alpha: &'a PyReadonlyArray1<'_, f32>,
        d_depth: &'a PyReadonlyArray1<'_, f32>,
    ) -> PyResult<PictureGradients<'a>> {
        let pixels = self.view.width * self.view.height;
        let (rgb, alpha, depth) = (d_rgb.as_slice()?, d_alpha.as_slice()?, d_depth.as_slice()?);
        if rgb.len() != 3 * pixels || alpha.len() != pixels || depth.len() != pixels {
            return Err(PyValueError::new_err(format!(
                "d_rgb, d_alpha, d_depth: {}, {}, {} values, wanted {}, {pixels}, {pixels}",
                rgb.len(),
                alpha.len(),
                depth.len(),
                3 * pixels
            )));
        }
        Ok(PictureGradients { rgb, alpha, depth })
    }
}
