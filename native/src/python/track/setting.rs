//! A part of the live picture that small objects are compared with, kept between the calls.

use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::alone::Alone;
use crate::python::check::check_length;
use crate::render::alone::Drawing;
use crate::track::appearance::similarity::{Setting as PlainSetting, SimilarityModel};
use crate::track::picture::shrunk;

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;

/// The constants of similarity in `tracking.kernels.photometry`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Constants {
    strange: f32,
    on_object: f32,
    doubt_px: f64,
    closely: bool,
}

/// A part of the live picture, and what it would show without the object.
#[pyclass(frozen, module = "scenes._native", name = "Setting")]
pub struct Setting {
    setting: PlainSetting,
    simd: Simd,
}

#[pymethods]
impl Setting {
    #[new]
    #[pyo3(signature = (live, empty, free, *, size, constants))]
    fn new(
        live: Floats<'_>,
        empty: Floats<'_>,
        free: Floats<'_>,
        size: [usize; 2],
        constants: Constants,
    ) -> PyResult<Self> {
        let count = size[0] * size[1];
        let (live, empty, free) = (live.as_slice()?, empty.as_slice()?, free.as_slice()?);
        check_length("live", live, 3 * count)?;
        check_length("empty", empty, 3 * count)?;
        check_length("free", free, count)?;
        if count == 0 {
            return Err(PyValueError::new_err(
                "setting: no pixels, wanted at least one",
            ));
        }
        let model = SimilarityModel {
            strange: constants.strange,
            on_object: constants.on_object,
            doubt_px: constants.doubt_px,
            closely: constants.closely,
        };
        Ok(Setting {
            setting: PlainSetting::new(live, empty, free, size, model),
            simd: Simd::detect(),
        })
    }

    /// Pixels in which the live picture differs from the rendering over the background.
    fn strange(&self, py: Python<'_>, rgb: Floats<'_>, alpha: Floats<'_>) -> PyResult<f64> {
        self.compare(py, &rgb, &alpha, PlainSetting::unexplained_px)
    }

    /// Similarity score of a rendered object and the picture: at most 1, about 0 by chance.
    fn resemblance(&self, py: Python<'_>, rgb: Floats<'_>, alpha: Floats<'_>) -> PyResult<f64> {
        self.compare(py, &rgb, &alpha, PlainSetting::similarity)
    }

    /// `strange` of a cloud at each of some poses, each x, y, z and yaw in the world.
    fn strange_at(
        &self,
        py: Python<'_>,
        alone: &Bound<'_, Alone>,
        upright: Vec<[f64; 4]>,
    ) -> PyResult<Vec<f64>> {
        self.compare_at(py, alone.get(), upright, PlainSetting::unexplained_px)
    }

    /// `resemblance` of a cloud at each of some poses, each x, y, z and yaw in the world.
    fn resemblance_at(
        &self,
        py: Python<'_>,
        alone: &Bound<'_, Alone>,
        upright: Vec<[f64; 4]>,
    ) -> PyResult<Vec<f64>> {
        self.compare_at(py, alone.get(), upright, PlainSetting::similarity)
    }
}

impl Setting {
    pub(crate) fn plain(&self) -> &PlainSetting {
        &self.setting
    }

    /// Compares a picture of an object with the live one.
    fn compare(
        &self,
        py: Python<'_>,
        rgb: &Floats<'_>,
        alpha: &Floats<'_>,
        measure: impl Fn(&PlainSetting, &[f32], &[f32]) -> f64 + Sync,
    ) -> PyResult<f64> {
        let [width, height] = self.setting.size();
        let (rgb, alpha) = (rgb.as_slice()?, alpha.as_slice()?);
        check_length("rgb", rgb, 3 * width * height)?;
        check_length("alpha", alpha, width * height)?;
        Ok(py.detach(|| {
            self.simd.run(
                #[inline(always)]
                || measure(&self.setting, rgb, alpha),
            )
        }))
    }

    /// Compares a cloud, drawn at each of some poses, with the picture.
    fn compare_at(
        &self,
        py: Python<'_>,
        alone: &Alone,
        upright: Vec<[f64; 4]>,
        measure: impl Fn(&PlainSetting, &[f32], &[f32]) -> f64 + Sync,
    ) -> PyResult<Vec<f64>> {
        let size = self.setting.size();
        let finer = alone.finer_than(size)?;
        let pool = alone.pool()?;
        Ok(py.detach(|| {
            let mut drawing = Drawing::default();
            let each = upright.into_iter().map(|upright| {
                alone.draw(upright, &pool, &mut drawing);
                self.simd.run(
                    #[inline(always)]
                    || {
                        if finer == 1 {
                            return measure(&self.setting, &drawing.rgb, &drawing.alpha);
                        }
                        let rgb = shrunk::<3>(&drawing.rgb, size, finer);
                        measure(
                            &self.setting,
                            &rgb,
                            &shrunk::<1>(&drawing.alpha, size, finer),
                        )
                    },
                )
            });
            each.collect()
        }))
    }
}
