//! A window as the solver reads it, kept between the calls from Python.

use std::sync::OnceLock;

use numpy::{PyArray1, PyReadonlyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::check::check_length;
use crate::track::background::change::Change;
use crate::track::fit::edges::CHANNELS;
use crate::track::picture::{filtered, gaussian, Picture};

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;
type Doubles<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Texture is compared after a Gaussian of this many pixels.
const TEXTURE_BLUR_PX: f32 = 0.8;

/// A window of a lens picture as the solver reads it.
#[pyclass(frozen, module = "scenes._native", name = "SeenWindow")]
pub struct SeenWindow {
    pixels: Vec<f32>,
    smooth: OnceLock<Vec<f32>>,
    width: usize,
    height: usize,
}

#[pymethods]
impl SeenWindow {
    #[new]
    fn new(
        live: Floats<'_>,
        foreground: Floats<'_>,
        own: Floats<'_>,
        hidden: Floats<'_>,
        size: (usize, usize),
    ) -> PyResult<Self> {
        let count = size.0 * size.1;
        let (live, foreground) = (live.as_slice()?, foreground.as_slice()?);
        let (own, hidden) = (own.as_slice()?, hidden.as_slice()?);
        check_length("live", live, 3 * count)?;
        check_length("foreground", foreground, count)?;
        check_length("own", own, count)?;
        check_length("hidden", hidden, count)?;
        if count == 0 {
            return Err(PyValueError::new_err(
                "window: no pixels, wanted at least one",
            ));
        }
        let [live, foreground, own, hidden] = [live, foreground, own, hidden].map(<[f32]>::to_vec);
        let change = Change {
            live,
            foreground,
            own,
            hidden,
        };
        Ok(SeenWindow::of(&change, size.into()))
    }

    /// Foreground, own, hidden and the smoothed live colours (3) at (N, 2) pixels, flat.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        pixels: Doubles<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let (window, smooth) = (self.picture(), self.smooth());
        let mut values = Vec::new();
        for place in pixels.as_slice()?.chunks_exact(2) {
            let place = [place[0], place[1]];
            values.extend_from_slice(&window.sample(place)[3..6]);
            values.extend_from_slice(&smooth.sample(place));
        }
        Ok(PyArray1::from_vec(py, values))
    }
}

impl SeenWindow {
    #[inline(always)]
    pub(crate) fn of(change: &Change, [width, height]: [usize; 2]) -> Self {
        let masks = change.foreground.iter().zip(&change.own);
        let masks = masks.zip(&change.hidden);
        let mut pixels: Vec<[f32; CHANNELS]> = Vec::with_capacity(width * height);
        pixels.extend(change.live.chunks_exact(3).zip(masks).map(
            |(rgb, ((&foreground, &own), &hidden))| {
                [rgb[0], rgb[1], rgb[2], foreground, own, hidden, 0.0, 0.0]
            },
        ));
        let pixels = pixels.into_flattened();
        SeenWindow {
            pixels,
            smooth: OnceLock::new(),
            width,
            height,
        }
    }

    pub(crate) fn picture(&self) -> Picture<'_, CHANNELS> {
        Picture {
            values: &self.pixels,
            width: self.width,
            height: self.height,
        }
    }

    /// The live colours, smoothed like a texture's values.
    pub(crate) fn smooth(&self) -> Picture<'_, 3> {
        let values = self.smooth.get_or_init(|| {
            let mut live = Vec::with_capacity(3 * self.width * self.height);
            for pixel in self.pixels.chunks_exact(CHANNELS) {
                live.extend_from_slice(&pixel[..3]);
            }
            let kernel: [f32; 7] = gaussian(TEXTURE_BLUR_PX);
            Simd::detect().run(
                #[inline(always)]
                || filtered(&live, [self.width, self.height], 3, &kernel),
            )
        });
        Picture {
            values,
            width: self.width,
            height: self.height,
        }
    }
}
