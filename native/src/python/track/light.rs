//! What Python sees of a lens's exposure and of colours at rest.

use numpy::{PyArray1, PyReadonlyArray3, PyReadonlyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::python::check::check_length;
use crate::track::fit::light;

type Doubles<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Gain, falloff and offset of one channel.
#[pyfunction]
pub(crate) fn exposure(
    plate: Doubles<'_>,
    radius2: Doubles<'_>,
    seen: Doubles<'_>,
    rounds: usize,
) -> PyResult<[f64; 3]> {
    let (plate, seen) = (plate.as_slice()?, seen.as_slice()?);
    let radius2 = radius2.as_slice()?;
    check_length("radius2", radius2, plate.len())?;
    check_length("seen", seen, plate.len())?;
    if plate.is_empty() {
        return Err(PyValueError::new_err(
            "exposure: no pixels, wanted at least one",
        ));
    }
    Ok(light::exposure(plate, radius2, seen, rounds))
}

/// Mean RGB, 0..1, of squares of `side` pixels whose left and top are in `corners`. The rows of
/// the picture may be apart, their pixels may not.
#[pyfunction]
pub(crate) fn patch_means<'py>(
    py: Python<'py>,
    live: PyReadonlyArray3<'py, u8>,
    corners: PyReadonlyArrayDyn<'py, i64>,
    side: usize,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let live = live.as_array();
    let (height, width, channels) = live.dim();
    if channels != 3 || live.strides()[1..] != [3, 1] {
        return Err(PyValueError::new_err(format!(
            "live: shape {:?} with strides {:?}, wanted RGB pixels without gaps",
            live.shape(),
            live.strides()
        )));
    }
    let inside = |corner: &[i64]| -> PyResult<[usize; 2]> {
        let fits = |at: i64, size: usize| at >= 0 && at as usize + side <= size;
        if !(fits(corner[0], width) && fits(corner[1], height)) {
            return Err(PyValueError::new_err(format!(
                "corners: {corner:?}, wanted {side} px squares within {width}×{height} px"
            )));
        }
        Ok([corner[0] as usize, corner[1] as usize])
    };
    let corners = corners.as_slice()?.chunks_exact(2).map(inside);
    let corners = corners.collect::<PyResult<Vec<_>>>()?;
    let rows: Vec<_> = live.outer_iter().collect();
    let rows: Vec<&[u8]> = rows.iter().filter_map(|row| row.to_slice()).collect();
    if rows.len() != height {
        return Err(PyValueError::new_err("live: rows with gaps, wanted none"));
    }
    let means = light::patch_means(&corners, side, |row, column| &rows[row][3 * column..]);
    Ok(PyArray1::from_vec(py, means))
}
