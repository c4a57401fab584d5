//! What Python sees of cutting places out of a picture.

use numpy::{PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::check::check_length;
use crate::python::lens::{with_lens, LensRequest};
use crate::python::track::request::rigid;
use crate::track::appearance::cut;
use crate::track::appearance::cut::{Cutter, CHANNELS};

type Flat<'py> = Bound<'py, PyArray1<f32>>;

/// Colours, own foreground and what is not covered by anything foreign, flat, at some places of a
/// lens picture of red, green, blue, own and all foreground; `side` pixels each way show `half_m`
/// metres to either side.
#[pyfunction]
#[pyo3(signature = (picture, centres, *, lens, world_from_lens, side, half_m))]
pub(crate) fn cut_out<'py>(
    py: Python<'py>,
    picture: PyReadonlyArrayDyn<'py, f32>,
    centres: PyReadonlyArrayDyn<'py, f64>,
    lens: LensRequest,
    world_from_lens: [f64; 12],
    side: usize,
    half_m: f64,
) -> PyResult<(Flat<'py>, Flat<'py>, Flat<'py>)> {
    let (picture, centres) = (picture.as_slice()?, centres.as_slice()?);
    let (width, height) = lens.size();
    check_length("picture", picture, CHANNELS * width * height)?;
    check_length("centres", centres, centres.len() / 3 * 3)?;
    let any = lens.lens();
    let cuts = py.detach(|| {
        with_lens!(&any, lens => {
            let cutter = Cutter {
                side,
                half_m,
                focal: crate::camera::lens::Lens::focal(lens),
                size: [width, height],
            };
            let pose = rigid(&world_from_lens);
            Simd::detect().run(
                #[inline(always)]
                || cut::cut_out(picture, lens, &pose, centres, &cutter),
            )
        })
    });
    Ok((
        PyArray1::from_vec(py, cuts.colours),
        PyArray1::from_vec(py, cuts.own),
        PyArray1::from_vec(py, cuts.free),
    ))
}
