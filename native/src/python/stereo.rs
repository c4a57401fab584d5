//! What Python sees of a photo's depth by others.

use numpy::{PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::stereo::census::HalfPixels;
use crate::stereo::semi_global::{planes, Prices};
use crate::stereo::sweep::{Costs, Other, Planes};

/// A photo, and in the same unit as `swept_depth`'s: turn (row by row) and shift of pixels into it.
type OtherPhoto<'py> = (PyReadonlyArray2<'py, u8>, [f64; 9], [f64; 3]);

/// Inverse depth of every pixel of a photo, flat; 0 where it is not known.
///
/// `inverse` is the first inverse depth, the step and how many there are; `prices` are those of a
/// change to the next plane and of a jump, and the edge that halves the jump's.
#[pyfunction]
#[pyo3(signature = (grey, others, *, inverse, prices, margin, noise))]
pub(crate) fn swept_depth<'py>(
    py: Python<'py>,
    grey: PyReadonlyArray2<'py, u8>,
    others: Vec<OtherPhoto<'py>>,
    inverse: (f32, f32, usize),
    prices: (u16, u16, u16),
    margin: f32,
    noise: f32,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let (first, step, count) = inverse;
    let (small, jump, edge) = prices;
    if count < 3 || jump > MAX_PRICE || small > jump || edge == 0 {
        return Err(PyValueError::new_err(format!(
            "swept_depth: {count} planes at prices {prices:?}, wanted 3 planes or more, prices up to \
             {MAX_PRICE} in order, and an edge"
        )));
    }
    let census = |photo: &PyReadonlyArray2<'_, u8>| -> PyResult<HalfPixels> {
        let size = size_of(photo)?;
        Ok(HalfPixels::of(
            photo.as_slice()?,
            size,
            noise,
            Simd::detect(),
        ))
    };
    let (size, own) = (size_of(&grey)?, census(&grey)?);
    let others = others.iter().map(|(photo, turn, shift)| {
        // Half pixels are twice as many; the third coordinate is what both are divided by.
        let scale = |k: usize| if k < 2 { 2.0 } else { 1.0 };
        Ok(Other {
            census: census(photo)?,
            turn: std::array::from_fn(|k| {
                std::array::from_fn(|j| (scale(k) * turn[3 * k + j]) as f32)
            }),
            shift: std::array::from_fn(|k| (scale(k) * shift[k]) as f32),
        })
    });
    let others = others.collect::<PyResult<Vec<_>>>()?;
    let grey = grey.as_slice()?;
    let steps = Planes { first, step, count };
    let prices = Prices {
        small,
        jump,
        edge,
        margin,
    };
    let found = py.detach(|| {
        let simd = Simd::detect();
        let costs = Costs::of(&own, size, &others, steps, simd);
        planes(&costs, grey, prices, simd)
    });
    let inverse = found.into_iter().map(|plane| {
        if plane < 0.0 {
            0.0
        } else {
            steps.inverse(plane)
        }
    });
    Ok(PyArray1::from_vec(py, inverse.collect()))
}

/// Sums of eight paths of such prices stay in 16 bits.
const MAX_PRICE: u16 = 1000;

/// Places among half pixels, four a pixel, are counted in single precision.
const MAX_PIXELS: usize = 1 << 22;

fn size_of(photo: &PyReadonlyArray2<'_, u8>) -> PyResult<[usize; 2]> {
    let shape = photo.shape();
    if shape.contains(&0) || shape[0] * shape[1] > MAX_PIXELS {
        return Err(PyValueError::new_err(format!(
            "photo: shape {shape:?}, wanted 1 to {MAX_PIXELS} pixels"
        )));
    }
    Ok([shape[1], shape[0]])
}
