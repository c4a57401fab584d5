//! Checks that keep a wrong call from reading out of bounds.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pub(crate) fn check_length<T>(name: &str, values: &[T], wanted: usize) -> PyResult<()> {
    if values.len() == wanted {
        return Ok(());
    }
    let got = values.len();
    Err(PyValueError::new_err(format!(
        "{name}: {got} values, wanted {wanted}"
    )))
}
