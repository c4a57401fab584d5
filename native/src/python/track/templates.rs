//! What Python sees of comparing places with templates.

use numpy::{PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::check::check_length;
use crate::track::appearance::templates::{compared, Places, Templates};

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;
type Flat<'py> = Bound<'py, PyArray1<f32>>;

/// Overlap and correlation, flat, of some places with each template: pictures of `pixels` pixels.
#[pyfunction]
#[pyo3(signature = (colours, own, free, *, alpha, drawn, pixels))]
pub(crate) fn compare_templates<'py>(
    py: Python<'py>,
    colours: Floats<'py>,
    own: Floats<'py>,
    free: Floats<'py>,
    alpha: Floats<'py>,
    drawn: Floats<'py>,
    pixels: usize,
) -> PyResult<(Flat<'py>, Flat<'py>)> {
    let places = Places {
        colours: colours.as_slice()?,
        own: own.as_slice()?,
        free: free.as_slice()?,
    };
    let templates = Templates {
        alpha: alpha.as_slice()?,
        colours: drawn.as_slice()?,
    };
    let whole = pixels.max(1);
    let count = places.own.len() / whole * pixels;
    check_length("own", places.own, count)?;
    check_length("free", places.free, count)?;
    check_length("colours", places.colours, 3 * count)?;
    let count = templates.alpha.len() / whole * pixels;
    check_length("alpha", templates.alpha, count)?;
    check_length("drawn", templates.colours, 3 * count)?;
    let [overlap, correlation] = py.detach(|| {
        Simd::detect().run(
            #[inline(always)]
            || compared(&places, &templates, whole),
        )
    });
    Ok((
        PyArray1::from_vec(py, overlap),
        PyArray1::from_vec(py, correlation),
    ))
}
