//! What Python sees of training. As in `python`, shapes are checked on the other side; the checks
//! here only keep a wrong call from reading out of bounds.

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::pool::Pools;
use crate::machine::simd::Simd;
use crate::project::scope::Scope;
use crate::python::check::check_length;
use crate::python::lens::{with_lens, LensRequest};
use crate::python::request::{pool_of, DrawRequest};
use crate::train::depth_bounds::DepthBounds;
use crate::train::exposure::Exposure;
use crate::train::loss::{Distance, Loss};
use crate::train::splats::{width_of, Rows};
use crate::train::step;
use crate::train::step::{CameraPose, Comparison};
use crate::train::target::Target;

/// L1, 1 - SSIM, and gradients by gain, bias and falloff.
type DistanceTuple = (f64, f64, [f64; 3], [f64; 3], [f64; 2]);

/// A photo to train on, with what of its SSIM does not depend on the splats.
#[pyclass(frozen, module = "scenes._native", name = "TrainingTarget")]
pub struct TrainingTarget {
    target: Target,
}

#[pymethods]
impl TrainingTarget {
    #[new]
    #[pyo3(signature = (rgb, *, size, bounds = None))]
    fn new(
        py: Python<'_>,
        rgb: PyReadonlyArray1<'_, u8>,
        size: (usize, usize),
        bounds: Option<(PyReadonlyArray1<'_, f32>, PyReadonlyArray1<'_, f32>)>,
    ) -> PyResult<Self> {
        let rgb = rgb.as_slice()?;
        if size.0 == 0 || size.1 == 0 || rgb.len() != 3 * size.0 * size.1 {
            return Err(PyValueError::new_err(format!(
                "rgb: {} values, wanted 3 for each of {}×{} pixels",
                rgb.len(),
                size.0,
                size.1
            )));
        }
        let mut target = py.detach(|| Target::new(rgb, size.0, size.1, Simd::detect()));
        if let Some((near, far)) = bounds {
            let (near, far) = (near.as_slice()?, far.as_slice()?);
            check_length("near", near, size.0 * size.1)?;
            check_length("far", far, size.0 * size.1)?;
            target.bounds = Some(DepthBounds {
                near: near.to_vec(),
                far: far.to_vec(),
            });
        }
        Ok(TrainingTarget { target })
    }

    /// Bytes held.
    #[getter]
    fn nbytes(&self) -> usize {
        self.target.size()
    }

    /// Distance of a drawn picture (flat, pixel by pixel) and its gradient, in the same layout.
    #[pyo3(signature = (rgb, *, ssim_share, gain, bias, falloff))]
    fn distance<'py>(
        &self,
        py: Python<'py>,
        rgb: PyReadonlyArray1<'py, f32>,
        ssim_share: f32,
        gain: [f32; 3],
        bias: [f32; 3],
        falloff: [f32; 2],
    ) -> PyResult<(DistanceTuple, Bound<'py, PyArray1<f32>>)> {
        let rgb = rgb.as_slice()?;
        let plane = self.target.width * self.target.height;
        check_length("rgb", rgb, 3 * plane)?;
        let (distance, d_rgb) = py.detach(|| {
            let mut loss = Loss::default();
            let exposure = Exposure {
                gain,
                bias,
                falloff,
            };
            let distance = loss.evaluate(rgb, &self.target, &exposure, ssim_share, Simd::detect());
            let d_rgb: Vec<f32> = (0..plane)
                .flat_map(|place| [0, 1, 2].map(|channel| channel * plane + place))
                .map(|place| loss.d_colour[place])
                .collect();
            (distance, d_rgb)
        });
        Ok((tuple_of(&distance), PyArray1::from_vec(py, d_rgb)))
    }
}

fn tuple_of(distance: &Distance) -> DistanceTuple {
    (
        distance.l1,
        distance.dssim,
        distance.d_gain,
        distance.d_bias,
        distance.d_falloff,
    )
}

/// Flat rows of values, first and second moments; then steps and error per splat.
type RowArrays<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<f32>>,
);

/// Splats in training.
#[pyclass(module = "scenes._native", name = "Trainee")]
pub struct Trainee {
    trainee: step::Trainee,
    pools: Pools,
    simd: Simd,
}

#[pymethods]
impl Trainee {
    #[new]
    #[pyo3(signature = (values, first, second, steps, error, *, sh_count, portable = false))]
    #[allow(clippy::too_many_arguments)] // Python names them all
    fn new(
        values: PyReadonlyArray1<'_, f32>,
        first: PyReadonlyArray1<'_, f32>,
        second: PyReadonlyArray1<'_, f32>,
        steps: PyReadonlyArray1<'_, u32>,
        error: PyReadonlyArray1<'_, f32>,
        sh_count: usize,
        portable: bool,
    ) -> PyResult<Self> {
        let rows = Rows {
            sh_count,
            values: values.as_slice()?.to_vec(),
            first: first.as_slice()?.to_vec(),
            second: second.as_slice()?.to_vec(),
            steps: steps.as_slice()?.to_vec(),
            error: error.as_slice()?.to_vec(),
        };
        let wanted = rows.count() * width_of(sh_count);
        let long = [&rows.values, &rows.first, &rows.second];
        if ![1, 4, 9, 16].contains(&sh_count)
            || long.iter().any(|v| v.len() != wanted)
            || rows.error.len() != rows.count()
        {
            return Err(PyValueError::new_err(format!(
                "rows: {} values for {} splats of {sh_count} coefficients, wanted {wanted}",
                rows.values.len(),
                rows.count()
            )));
        }
        Ok(Trainee {
            trainee: step::Trainee::new(rows),
            pools: Pools::default(),
            simd: if portable {
                Simd::SCALAR
            } else {
                Simd::detect()
            },
        })
    }

    /// Copies of everything kept by row.
    fn rows<'py>(&self, py: Python<'py>) -> RowArrays<'py> {
        let rows = &self.trainee.splats.rows;
        (
            PyArray1::from_slice(py, &rows.values),
            PyArray1::from_slice(py, &rows.first),
            PyArray1::from_slice(py, &rows.second),
            PyArray1::from_slice(py, &rows.steps),
            PyArray1::from_slice(py, &rows.error),
        )
    }

    /// Nanoseconds spent so far drawing, comparing, going back through the tiles, and the rest.
    #[getter]
    fn spent_ns(&self) -> [u64; 4] {
        self.trainee.spent_ns
    }

    /// One step of Adam at `rates` (one per number of a row).
    ///
    /// `draw` is of the whole picture: its region and tile mask are not looked at.
    #[pyo3(signature = (target, camera_from_world, rates, *, lens, draw, ssim_share, gain, bias, falloff, depth_price))]
    #[allow(clippy::too_many_arguments)] // Python names them all
    fn step(
        &mut self,
        py: Python<'_>,
        target: &Bound<'_, TrainingTarget>,
        camera_from_world: [f64; 12],
        rates: PyReadonlyArray1<'_, f32>,
        lens: LensRequest,
        draw: DrawRequest<'_>,
        ssim_share: f32,
        gain: [f32; 3],
        bias: [f32; 3],
        falloff: [f32; 2],
        depth_price: f32,
    ) -> PyResult<DistanceTuple> {
        let rates = rates.as_slice()?;
        check_length("rates", rates, self.trainee.splats.rows.width())?;
        let target = &target.get().target;
        let view = draw.view(&lens)?;
        if [view.width, view.height] != [target.width, target.height] {
            return Err(PyValueError::new_err(format!(
                "lens: {}×{} px, wanted the target's {}×{} px",
                view.width, view.height, target.width, target.height
            )));
        }
        let pose = pose_of(&camera_from_world);
        let comparison = Comparison {
            exposure: Exposure {
                gain,
                bias,
                falloff,
            },
            ssim_share,
            depth_price,
        };
        let pool = pool_of(&self.pools, draw.threads)?;
        let scope = Scope::whole(view.width, view.height);
        let job = draw.job(view, &scope, self.simd, &pool)?;
        let lens = lens.lens();
        let trainee = &mut self.trainee;
        let distance = py.detach(|| {
            pool.install(|| {
                with_lens!(&lens, lens => {
                    trainee.step(&pose, lens, &job, target, &comparison, rates)
                })
            })
        });
        Ok(tuple_of(&distance))
    }
}

fn pose_of(rows: &[f64; 12]) -> CameraPose {
    CameraPose {
        rotation: std::array::from_fn(|row| std::array::from_fn(|k| rows[4 * row + k])),
        translation: std::array::from_fn(|row| rows[4 * row + 3]),
    }
}
