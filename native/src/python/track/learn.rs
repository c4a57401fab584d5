//! What Python sees of learning the empty room.

use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::check::check_length;
use crate::python::track::request::rows_of_picture;
use crate::track::background::expected::Exposure;
use crate::track::background::learn::{learn, LearnModel, Strip};

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;
type Flags<'py> = PyReadonlyArrayDyn<'py, bool>;
type Flat<'py, T> = Bound<'py, PyArray1<T>>;
type LearnedArrays<'py> = (Flat<'py, f32>, Flat<'py, f32>, Flat<'py, bool>);

/// Constants of learning, as `tracking.kernels.background` gathers them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Constants {
    relit_ratio: [f32; 2],
    relit_hue: f32,
    blend: f32,
    noise_floor: f32,
    misalignment_px: f32,
}

/// Learns the empty room from live pictures.
#[pyclass(frozen, module = "scenes._native", name = "RoomLearner")]
pub struct RoomLearner {
    simd: Simd,
    constants: Constants,
}

#[pymethods]
impl RoomLearner {
    #[new]
    fn new(constants: Constants) -> Self {
        RoomLearner {
            simd: Simd::detect(),
            constants,
        }
    }

    /// New background image (`plate`), noise and which pixels were ever learned, of whole rows of a
    /// lens picture, flat. The rows of the live picture may be apart.
    #[pyo3(signature = (live, plate, learned, usable, *, lens_size, top, exposure, sides, level, is_cautious))]
    #[allow(clippy::too_many_arguments)]
    fn learn<'py>(
        &self,
        py: Python<'py>,
        live: PyReadonlyArrayDyn<'py, u8>,
        plate: Floats<'py>,
        learned: Flags<'py>,
        usable: Flags<'py>,
        lens_size: [usize; 2],
        top: usize,
        exposure: [[f32; 3]; 3],
        sides: [usize; 3],
        level: f32,
        is_cautious: bool,
    ) -> PyResult<LearnedArrays<'py>> {
        let (width, rows) = (lens_size[0], live.shape()[0]);
        let live = [live];
        if width == 0 || rows == 0 || sides.iter().any(|side| side % 2 == 0) {
            return Err(PyValueError::new_err(format!(
                "rows: {rows} of {width} px with surroundings of {sides:?} px, wanted at least one \
                 pixel and odd sides"
            )));
        }
        let strip = Strip {
            live: rows_of_picture("live", &live, [rows, 3 * width])?,
            background: plate.as_slice()?,
            learned: learned.as_slice()?,
            usable: usable.as_slice()?,
            top,
            lens: lens_size,
        };
        check_length("plate", strip.background, 3 * width * rows)?;
        check_length("learned", strip.learned, width * rows)?;
        check_length("usable", strip.usable, width * rows)?;
        let [gain, falloff, offset] = exposure;
        let exposure = Exposure {
            gain,
            falloff,
            offset,
        };
        let constants = &self.constants;
        let model = LearnModel {
            coherent_level: level,
            coherent_side: sides[0],
            rough_side: sides[1],
            wary_side: sides[2],
            relit_ratio: constants.relit_ratio,
            relit_hue: constants.relit_hue,
            blend: constants.blend,
            noise_floor: constants.noise_floor,
            misalignment_px: constants.misalignment_px,
            is_cautious,
        };
        let found = py.detach(|| {
            self.simd.run(
                #[inline(always)]
                || learn(&strip, &exposure, &model),
            )
        });
        Ok((
            PyArray1::from_vec(py, found.background),
            PyArray1::from_vec(py, found.noise),
            PyArray1::from_vec(py, found.known),
        ))
    }
}
