//! What Python sees of the gradients.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::camera::curvature::Curved;
use crate::gradients::tape;
use crate::gradients::tape::PictureGradients;
use crate::machine::pool::Pools;
use crate::machine::simd::Simd;
use crate::pose::engine::PoseEngine;
use crate::pose::motion::{Directions, Twist};
use crate::pose::sums::{NormalSums, Target};
use crate::pose::tile::Drawn;
use crate::project::posed::{PosedCloud, View};
use crate::project::scope::Scope;
use crate::python::check::check_length;
use crate::python::cloud::PreparedCloud;
use crate::python::lens::{with_lens, AnyLens, LensRequest};
use crate::python::request::{
    picture_arrays, pool_of, posed_clouds, with_picture, DrawRequest, KeptBackground, PictureArrays,
};
use crate::render::job::{Background, Job};

/// Flat gradients of one object: means, scales, rotations, opacities, sh, and its twist.
type ObjectArrays<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    [f64; 6],
);

/// Upper triangle of JᵀJ row by row, Jᵀr, squares, drawn grey and alpha.
type NormalArrays<'py> = (
    Vec<f64>,
    Vec<f64>,
    [f64; 2],
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
);

/// One engine for each number of degrees of freedom.
#[derive(Default)]
struct PoseEngines {
    three: PoseEngine<3>,
    four: PoseEngine<4>,
    six: PoseEngine<6>,
}

/// Draws pictures that can be differentiated; keeps threads between them.
#[pyclass(frozen, module = "scenes._native", name = "Differentiator")]
pub struct Differentiator {
    pools: Pools,
    simd: Simd,
    engines: PoseEngines,
}

#[pymethods]
impl Differentiator {
    #[new]
    #[pyo3(signature = (*, instructions = None))]
    fn new(instructions: Option<&str>) -> PyResult<Self> {
        let simd = match instructions {
            None => Simd::detect(),
            Some(name) => Simd::named(name).ok_or_else(|| {
                PyValueError::new_err(format!("instructions: this machine has no {name:?}"))
            })?,
        };
        Ok(Differentiator {
            pools: Pools::default(),
            simd,
            engines: PoseEngines::default(),
        })
    }

    /// Draws as `Engine` does, and remembers how.
    #[pyo3(signature = (clouds, camera_from_object, *, lens, draw))]
    fn record<'py>(
        &self,
        py: Python<'py>,
        clouds: Vec<Bound<'py, PreparedCloud>>,
        camera_from_object: PyReadonlyArray2<'py, f64>,
        lens: LensRequest,
        draw: DrawRequest<'py>,
    ) -> PyResult<(PictureArrays<'py>, Tape)> {
        let view = draw.view(&lens)?;
        let scope = draw.scope(&view)?;
        let pool = pool_of(&self.pools, draw.threads)?;
        let job = draw.job(view, &scope, self.simd, &pool)?;
        let poses = camera_from_object.as_slice()?.to_vec();
        let objects = posed_clouds(&clouds, &poses)?;
        let arrays = picture_arrays(py, &view);
        let lens = lens.lens();
        let tape = with_picture(&arrays, &view, |picture| {
            py.detach(
                || with_lens!(&lens, lens => tape::Tape::record(&objects, lens, &job, picture)),
            )
        })?;
        let background = KeptBackground::of(&job.background);
        let tape = Tape {
            tape,
            clouds: clouds.into_iter().map(Bound::unbind).collect(),
            poses,
            lens,
            view,
            scope,
            background,
            simd: self.simd,
            pool,
        };
        Ok((arrays, tape))
    }

    /// Draws one cloud and sums the normal equations of its pose, gain and bias.
    ///
    /// `target` holds grey, its weight, background, silhouette, its weight and occluder depth, all
    /// flat; `twists` is (D, 6).
    #[pyo3(signature = (cloud, camera_from_object, twists, target, *, lens, draw, luma, gain, bias))]
    #[allow(clippy::too_many_arguments)] // Python names them all
    fn pose_normals<'py>(
        &self,
        py: Python<'py>,
        cloud: Bound<'py, PreparedCloud>,
        camera_from_object: PyReadonlyArray2<'py, f64>,
        twists: PyReadonlyArray2<'py, f64>,
        target: [PyReadonlyArray1<'py, f32>; 6],
        lens: LensRequest,
        draw: DrawRequest<'py>,
        luma: [f32; 3],
        gain: f32,
        bias: f32,
    ) -> PyResult<NormalArrays<'py>> {
        let view = draw.view(&lens)?;
        let lens = lens.lens();
        let clouds = [cloud];
        let objects = posed_clouds(&clouds, camera_from_object.as_slice()?)?;
        let pixels = view.width * view.height;
        let target = target_of(&target, pixels, gain, bias)?;
        let twists = twists_of(&twists)?;
        let grey = PyArray1::zeros(py, pixels, false);
        let alpha = PyArray1::zeros(py, pixels, false);
        let pool = pool_of(&self.pools, draw.threads)?;
        let scope = Scope::whole(view.width, view.height);
        let job = Job {
            view,
            scope: &scope,
            background: Background::Plain([0.0; 3]),
            simd: self.simd,
            pool: &pool,
        };
        let unknowns = twists.len() + 2;
        let sums = {
            let mut grey = grey.readwrite();
            let mut alpha = alpha.readwrite();
            let mut drawn = Drawn {
                grey: grey.as_slice_mut()?,
                alpha: alpha.as_slice_mut()?,
            };
            let object = &objects[0];
            py.detach(|| {
                with_lens!(&lens, lens => {
                    let mut call = Call { object, lens, job: &job, luma, target: &target, drawn: &mut drawn };
                    match twists.len() {
                        3 => call.run(&self.engines.three, &twists),
                        4 => call.run(&self.engines.four, &twists),
                        6 => call.run(&self.engines.six, &twists),
                        _ => None,
                    }
                })
            })
        };
        let sums = sums.expect("`twists_of` lets no other number through");
        Ok((
            sums.pairs[..unknowns * (unknowns + 1) / 2].to_vec(),
            sums.gradient[..unknowns].to_vec(),
            sums.squares,
            grey,
            alpha,
        ))
    }
}

/// A picture drawn by `Differentiator::record`, ready to be differentiated any number of times.
#[pyclass(frozen, module = "scenes._native", name = "Tape")]
pub struct Tape {
    tape: tape::Tape,
    clouds: Vec<Py<PreparedCloud>>,
    pub(crate) poses: Vec<f64>,
    pub(crate) lens: AnyLens,
    view: View,
    scope: Scope,
    background: KeptBackground,
    simd: Simd,
    pool: Arc<ThreadPool>,
}

#[pymethods]
impl Tape {
    /// Gradients of a loss, given its gradients with respect to the picture (flat arrays).
    #[pyo3(signature = (d_rgb, d_alpha, d_depth))]
    fn gradients<'py>(
        &self,
        py: Python<'py>,
        d_rgb: PyReadonlyArray1<'py, f32>,
        d_alpha: PyReadonlyArray1<'py, f32>,
        d_depth: PyReadonlyArray1<'py, f32>,
    ) -> PyResult<Vec<ObjectArrays<'py>>> {
        let d_picture = self.picture_gradients(&d_rgb, &d_alpha, &d_depth)?;
        let clouds = self.bound_clouds(py);
        let objects = posed_clouds(&clouds, &self.poses)?;
        let job = self.job();
        let gradients = py.detach(|| {
            with_lens!(&self.lens, lens => self.tape.gradients(&objects, lens, &job, &d_picture))
        });
        Ok(gradients
            .into_iter()
            .map(|object| {
                let [a, b, c] = object.twist.shift;
                let [d, e, f] = object.twist.turn;
                (
                    PyArray1::from_vec(py, object.means),
                    PyArray1::from_vec(py, object.scales),
                    PyArray1::from_vec(py, object.rotations),
                    PyArray1::from_vec(py, object.opacities),
                    PyArray1::from_vec(py, object.sh),
                    [a, b, c, d, e, f],
                )
            })
            .collect())
    }
}

/// What does not depend on the number of degrees of freedom.
struct Call<'a, 'b, L> {
    object: &'a PosedCloud<'a>,
    lens: &'a L,
    job: &'a Job<'a>,
    luma: [f32; 3],
    target: &'a Target<'a>,
    drawn: &'a mut Drawn<'b>,
}

impl<L: Curved> Call<'_, '_, L> {
    fn run<const D: usize>(
        &mut self,
        engine: &PoseEngine<D>,
        twists: &[Twist],
    ) -> Option<NormalSums> {
        let directions = Directions::<D> {
            twists: twists.try_into().ok()?,
            luma: self.luma,
        };
        Some(engine.normal_sums(
            self.object,
            self.lens,
            self.job,
            &directions,
            self.target,
            self.drawn,
        ))
    }
}

impl Tape {
    pub(crate) fn job(&self) -> Job<'_> {
        Job {
            view: self.view,
            scope: &self.scope,
            background: self.background.borrow(),
            simd: self.simd,
            pool: &self.pool,
        }
    }

    pub(crate) fn bound_clouds<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PreparedCloud>> {
        self.clouds
            .iter()
            .map(|cloud| cloud.bind(py).clone())
            .collect()
    }

    pub(crate) fn picture_gradients<'a>(
        &self,
        d_rgb: &'a PyReadonlyArray1<'_, f32>,
        d_alpha: &'a PyReadonlyArray1<'_, f32>,
        d_depth: &'a PyReadonlyArray1<'_, f32>,
    ) -> PyResult<PictureGradients<'a>> {
        let pixels = self.view.width * self.view.height;
        let (rgb, alpha, depth) = (d_rgb.as_slice()?, d_alpha.as_slice()?, d_depth.as_slice()?);
        if rgb.len() != 3 * pixels || alpha.len() != pixels || depth.len() != pixels {
            return Err(PyValueError::new_err(format!(
                "d_rgb, d_alpha, d_depth: {}, {}, {} values, wanted {}, {pixels}, {pixels}",
                rgb.len(),
                alpha.len(),
                depth.len(),
                3 * pixels
            )));
        }
        Ok(PictureGradients { rgb, alpha, depth })
    }
}

/// Six flat pictures in the order of `Differentiator::pose_normals`.
fn target_of<'a>(
    arrays: &'a [PyReadonlyArray1<'_, f32>; 6],
    pixels: usize,
    gain: f32,
    bias: f32,
) -> PyResult<Target<'a>> {
    let flat = |place: usize| -> PyResult<&'a [f32]> {
        let values = arrays[place].as_slice()?;
        check_length(&format!("target[{place}]"), values, pixels)?;
        Ok(values)
    };
    Ok(Target {
        grey: flat(0)?,
        grey_weight: flat(1)?,
        background: flat(2)?,
        silhouette: flat(3)?,
        silhouette_weight: flat(4)?,
        occluder: flat(5)?,
        gain,
        bias,
    })
}

fn twists_of(rows: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Twist>> {
    let [count, columns] = [rows.shape()[0], rows.shape()[1]];
    if ![3, 4, 6].contains(&count) || columns != 6 {
        return Err(PyValueError::new_err(format!(
            "twists: ({count}, {columns}) values, wanted 3, 4 or 6 rows of 6"
        )));
    }
    Ok(rows
        .as_slice()?
        .chunks_exact(6)
        .map(|row| Twist {
            shift: std::array::from_fn(|axis| row[axis] as f32),
            turn: std::array::from_fn(|axis| row[3 + axis] as f32),
        })
        .collect())
}
