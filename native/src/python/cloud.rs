//! A prepared cloud, as Python holds it.

use std::sync::Arc;

use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::python::check::check_length;
use crate::scene::cloud::{Cloud, SplatArrays};

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
