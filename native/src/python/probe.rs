//! What Python sees of the stages of a picture.

use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::gradients::probe;
use crate::gradients::probe::Sight;
use crate::machine::simd::Simd;
use crate::python::gradients::Tape;
use crate::python::lens::with_lens;
use crate::python::request::posed_clouds;

/// The stages of a recorded picture, each to be timed from outside.
#[pyclass(module = "scenes._native", name = "Probe")]
pub struct Probe {
    tape: Py<Tape>,
    probe: probe::Probe,
}

/// Runs `$work` with what the probe's picture is of, without the interpreter lock.
macro_rules! with_sight {
    ($self:ident, $py:ident, |$probe:ident, $sight:ident| $work:expr) => {{
        let tape = $self.tape.bind($py).get();
        let clouds = tape.bound_clouds($py);
        let objects = posed_clouds(&clouds, &tape.poses)?;
        let objects = objects.as_slice();
        let job = tape.job();
        let $probe = &mut $self.probe;
        $py.detach(|| {
            with_lens!(&tape.lens, lens => {
                let $sight = Sight { objects, lens, job: &job };
                $work
            })
        })
    }};
}

#[pymethods]
impl Probe {
    #[new]
    fn new(tape: Py<Tape>) -> Self {
        Probe {
            tape,
            probe: probe::Probe::default(),
        }
    }

    /// Culls and projects.
    fn project(&mut self, py: Python<'_>) -> PyResult<()> {
        with_sight!(self, py, |probe, sight| probe.project(&sight));
        Ok(())
    }

    /// Sorts what `project` found, once.
    fn sort(&mut self, py: Python<'_>) -> PyResult<()> {
        with_sight!(self, py, |probe, sight| probe.sort(sight.job));
        Ok(())
    }

    /// Lists the splats of every tile.
    fn bin(&mut self, py: Python<'_>) -> PyResult<()> {
        with_sight!(self, py, |probe, sight| probe.bin(sight.job));
        Ok(())
    }

    /// Blends every tile on one thread and forgets it.
    fn blend(&mut self, py: Python<'_>, instructions: &str) -> PyResult<()> {
        let simd = named(instructions)?;
        with_sight!(self, py, |probe, sight| probe.blend(&sight, simd));
        Ok(())
    }

    /// Samples that `blend` goes through: those that change a pixel, and all lanes.
    fn count_lanes(&mut self, py: Python<'_>, instructions: &str) -> PyResult<(u64, u64)> {
        let simd = named(instructions)?;
        let count = with_sight!(self, py, |probe, sight| probe.count_lanes(&sight, simd));
        Ok((count.useful, count.processed))
    }

    /// Draws the whole picture from the lists, into memory kept for it.
    fn draw(&mut self, py: Python<'_>) -> PyResult<()> {
        with_sight!(self, py, |probe, sight| probe.draw(&sight));
        Ok(())
    }

    /// Blends backwards; the arrays are flat.
    fn blend_back(
        &mut self,
        py: Python<'_>,
        d_rgb: PyReadonlyArray1<'_, f32>,
        d_alpha: PyReadonlyArray1<'_, f32>,
        d_depth: PyReadonlyArray1<'_, f32>,
    ) -> PyResult<()> {
        let tape = self.tape.clone_ref(py);
        let d_picture = tape.get().picture_gradients(&d_rgb, &d_alpha, &d_depth)?;
        with_sight!(self, py, |probe, sight| probe
            .blend_back(&sight, &d_picture));
        Ok(())
    }

    /// Runs the inner loop alone over a whole tile, all lanes in use; returns how many lanes that
    /// were, 0 for "scalar".
    #[staticmethod]
    fn blend_everywhere(py: Python<'_>, instructions: &str, times: usize) -> PyResult<u64> {
        let simd = named(instructions)?;
        Ok(py.detach(|| probe::blend_everywhere(simd, times)))
    }
}

fn named(instructions: &str) -> PyResult<Simd> {
    Simd::named(instructions).ok_or_else(|| {
        PyValueError::new_err(format!(
            "instructions: got {instructions:?}, wanted one of Engine.available()"
        ))
    })
}
