//! What Python sees of the appearance memory.

use numpy::{PyArray1, PyReadonlyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::check::check_length;
use crate::python::lens::{with_lens, LensRequest};
use crate::python::track::reduction::DrawnRequest;
use crate::python::track::request::rigid;
use crate::track::appearance::memory::{self, AppearanceMemory};
use crate::track::picture::Picture;

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;

/// An appearance memory and its camera, relative to the rendering's.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct MemoryRequest<'py> {
    shown: Floats<'py>,
    depth: Floats<'py>,
    lens: LensRequest,
    there_from_here: [f64; 12],
    slack_m: f64,
    worth: f32,
}

/// Colours of a rendering, blended with those of the appearance memory `portrait`; flat RGB.
#[pyfunction]
#[pyo3(signature = (drawn, portrait, *, lens, least_alpha))]
pub(crate) fn laid_on<'py>(
    py: Python<'py>,
    drawn: DrawnRequest<'py>,
    portrait: MemoryRequest<'py>,
    lens: LensRequest,
    least_alpha: f32,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let drawn = drawn.drawn(lens.size())?;
    let (width, height) = portrait.lens.size();
    let (shown, depth) = (portrait.shown.as_slice()?, portrait.depth.as_slice()?);
    check_length("shown", shown, 4 * width * height)?;
    check_length("depth", depth, width * height)?;
    if shown.is_empty() {
        return Err(PyValueError::new_err(
            "portrait: no pixels, wanted at least one",
        ));
    }
    let colours = py.detach(|| {
        with_lens!(&lens.lens(), here => with_lens!(&portrait.lens.lens(), there => {
            let memory = AppearanceMemory {
                shown: Picture { values: shown, width, height },
                depth: Picture { values: depth, width, height },
                lens: there,
                there_from_here: rigid(&portrait.there_from_here),
                slack: portrait.slack_m,
                weight: portrait.worth,
            };
            Simd::detect().run(
                #[inline(always)]
                || memory::laid_on(&drawn, here, &memory, least_alpha),
            )
        }))
    });
    Ok(PyArray1::from_vec(py, colours))
}
