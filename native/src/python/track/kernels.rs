//! What Python sees of the tracker's kernels.

use numpy::{PyArray1, PyReadonlyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::check::check_length;
use crate::python::lens::with_lens;
use crate::python::track::request::{
    layer_of, rigid, rows_of, rows_of_picture, LayerRequest, PlainProblem, ProblemRequest,
};
use crate::python::track::seen_window::SeenWindow;
use crate::track::background::change::{change, ChangeModel, BINS};
use crate::track::background::expected::{Cut, Exposure, Window};
use crate::track::fit::edges::EdgeModel;
use crate::track::fit::judge::{JudgeModel, Surface};
use crate::track::fit::solve::{Estimate, SolveModel};

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;
type Doubles<'py> = PyReadonlyArrayDyn<'py, f64>;
type Flat<'py, T> = Bound<'py, PyArray1<T>>;

/// The tracker's constants, as `tracking.kernels` gathers them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Constants {
    neighbour_noise: f32,
    likeness_gain: f32,
    shadow_darkest: [f32; 2],
    shadow_gone: [f32; 2],
    shadow_discount: f32,
    shadow_hue: f32,
    sample_step_px: f64,
    side_px: f64,
    least_step: f64,
    distance_penalty: f64,
    foreign: f64,
    light_range: [f32; 2],
    alike_sigma: f32,
    cut_px: f64,
    weak_reach_px: f64,
    weak_slope: f64,
    weak_sigma_px: f64,
    edge_sigma_px: f64,
    coarse_sigma_px: f64,
    faint_contrast: f64,
    contour_correlation: f64,
    texture_sigma: f64,
    texture_cutoff: f64,
    judge_reach_px: f64,
    agree_px: f64,
    misfit_cutoff: f64,
    together_px: f32,
    least_together: usize,
    least_shown: usize,
    detail_px: f32,
}

fn window_of(window: [usize; 4], shrink: usize, lens: [usize; 2]) -> PyResult<Window> {
    let [left, top, width, height] = window;
    if shrink == 0 || width == 0 || height == 0 {
        return Err(PyValueError::new_err(format!(
            "window: {window:?} of {shrink} px each, wanted at least one pixel"
        )));
    }
    Ok(Window {
        left,
        top,
        width,
        height,
        shrink,
        lens,
    })
}

fn cut_of<'a>(
    live: &'a [PyReadonlyArrayDyn<'_, u8>],
    plate: &'a [Floats<'_>],
    noise: &'a [Floats<'_>],
    window: &Window,
) -> PyResult<Cut<'a>> {
    let [lines, line] = [window.height, window.width].map(|side| side * window.shrink);
    Ok(Cut {
        live: rows_of_picture("live", live, [lines, 3 * line])?,
        background: rows_of_picture("plate", plate, [lines, 3 * line])?,
        noise: rows_of_picture("noise", noise, [lines, line])?,
    })
}

fn exposure_of([gain, falloff, offset]: [[f32; 3]; 3]) -> Exposure {
    Exposure {
        gain,
        falloff,
        offset,
    }
}

/// The tracker's kernels with their constants.
#[pyclass(frozen, module = "scenes._native", name = "TrackKernels")]
pub struct TrackKernels {
    simd: Simd,
    change: ChangeModel,
    solve: SolveModel,
    judge: JudgeModel,
}

type ChangeArrays<'py> = (
    Flat<'py, f32>,
    Flat<'py, f32>,
    Flat<'py, f32>,
    Flat<'py, f32>,
    Bound<'py, SeenWindow>,
);
type EdgeArrays<'py> = (
    Flat<'py, f64>,
    Flat<'py, f64>,
    Flat<'py, bool>,
    Flat<'py, bool>,
);

#[pymethods]
impl TrackKernels {
    #[new]
    fn new(constants: Constants) -> Self {
        let c = constants;
        TrackKernels {
            simd: Simd::detect(),
            change: ChangeModel {
                neighbour_noise: c.neighbour_noise,
                likeness_gain: c.likeness_gain,
                shadow_darkest: c.shadow_darkest,
                shadow_gone: c.shadow_gone,
                shadow_discount: c.shadow_discount,
                shadow_hue: c.shadow_hue,
            },
            solve: SolveModel {
                edges: EdgeModel {
                    sample_step_px: c.sample_step_px,
                    side_px: c.side_px,
                    least_step: c.least_step,
                    distance_penalty: c.distance_penalty,
                    foreign: c.foreign,
                    light_range: c.light_range,
                    alike_sigma: c.alike_sigma,
                    cut_px: c.cut_px,
                    weak_reach_px: c.weak_reach_px,
                    weak_slope: c.weak_slope,
                    weak_sigma_px: c.weak_sigma_px,
                    edge_sigma_px: c.edge_sigma_px,
                    coarse_sigma_px: c.coarse_sigma_px,
                    faint_contrast: c.faint_contrast,
                },
                low_pass_px: 0.0,
                contour_correlation: c.contour_correlation,
                texture_sigma: c.texture_sigma,
                texture_cutoff: c.texture_cutoff,
                texture_correlation: 1.0,
                focal: 1.0,
                is_round: false,
            },
            judge: JudgeModel {
                reach_px: c.judge_reach_px,
                agree_px: c.agree_px,
                misfit_cutoff: c.misfit_cutoff,
                together_px: c.together_px,
                least_together: c.least_together,
                least_shown: c.least_shown,
                detail_px: c.detail_px,
            },
        }
    }

    /// Live picture, foreground, own colours and what is hidden, of a window of a lens picture, and
    /// all of that for the solver.
    ///
    /// The pictures are cut from the lens's, in parts one below the other; `window` is left and top in
    /// lens pixels, then width and height in pixels of the window, each `shrink` × `shrink` of the lens.
    #[pyo3(signature = (live, plate, noise, *, lens_size, window, shrink, exposure, layers, table))]
    #[allow(clippy::too_many_arguments)]
    fn change<'py>(
        &self,
        py: Python<'py>,
        live: PyReadonlyArrayDyn<'py, u8>,
        plate: Vec<Floats<'py>>,
        noise: Vec<Floats<'py>>,
        lens_size: [usize; 2],
        window: [usize; 4],
        shrink: usize,
        exposure: [[f32; 3]; 3],
        layers: Vec<LayerRequest<'py>>,
        table: Floats<'py>,
    ) -> PyResult<ChangeArrays<'py>> {
        let window = window_of(window, shrink, lens_size)?;
        let live = [live];
        let cut = cut_of(&live, &plate, &noise, &window)?;
        let table = table.as_slice()?;
        check_length("table", table, BINS * BINS * BINS)?;
        let layers = layers.iter().map(layer_of).collect::<PyResult<Vec<_>>>()?;
        let exposure = exposure_of(exposure);
        let (found, seen) = py.detach(|| {
            self.simd.run(
                #[inline(always)]
                || {
                    let found = change(&cut, &window, &exposure, &layers, table, &self.change);
                    let seen = SeenWindow::of(&found, [window.width, window.height]);
                    (found, seen)
                },
            )
        });
        Ok((
            PyArray1::from_vec(py, found.live),
            PyArray1::from_vec(py, found.foreground),
            PyArray1::from_vec(py, found.own),
            PyArray1::from_vec(py, found.hidden),
            Bound::new(py, seen)?,
        ))
    }

    /// A pose after some Gauss-Newton steps per search distance: rotation and translation row by
    /// row (12), silhouette bias (`halo`, m), information (7 × 7, flat).
    #[pyo3(signature = (window, problem, start, halo, *, rounds))]
    fn refine(
        &self,
        py: Python<'_>,
        window: &SeenWindow,
        problem: ProblemRequest<'_>,
        start: [f64; 12],
        halo: f64,
        rounds: Vec<(f64, usize)>,
    ) -> PyResult<([f64; 12], f64, Vec<f64>)> {
        let lens = problem.lens.lens();
        let problem = PlainProblem::of(&problem, &self.solve)?;
        let mut at = Estimate {
            world_from_object: rigid(&start),
            silhouette_bias: halo,
            information: Default::default(),
        };
        py.detach(|| {
            with_lens!(&lens, lens => {
                let problem = problem.seen(lens, window);
                for (reach_px, steps) in rounds {
                    at = self.simd.run(#[inline(always)] || problem.refine(at, reach_px, steps));
                }
            });
        });
        let information = at.information.as_flattened().to_vec();
        Ok((
            rows_of(&at.world_from_object),
            at.silhouette_bias,
            information,
        ))
    }

    /// What is seen at every contour point of a pose: outward distance of the edge less what the
    /// silhouette bias explains, its standard deviation, whether it was found, whether something is
    /// in front.
    #[pyo3(signature = (window, problem, pose, halo, *, reach_px))]
    fn edges<'py>(
        &self,
        py: Python<'py>,
        window: &SeenWindow,
        problem: ProblemRequest<'py>,
        pose: [f64; 12],
        halo: f64,
        reach_px: f64,
    ) -> PyResult<EdgeArrays<'py>> {
        let lens = problem.lens.lens();
        let problem = PlainProblem::of(&problem, &self.solve)?;
        let found = py.detach(|| {
            with_lens!(&lens, lens => {
                let problem = problem.seen(lens, window);
                self.simd.run(#[inline(always)] || problem.edges(&rigid(&pose), halo, reach_px))
            })
        });
        Ok((
            PyArray1::from_iter(py, found.iter().map(|edge| edge.offset)),
            PyArray1::from_iter(py, found.iter().map(|edge| edge.sigma)),
            PyArray1::from_iter(py, found.iter().map(|edge| edge.found)),
            PyArray1::from_iter(py, found.iter().map(|edge| edge.covered || edge.foreign)),
        ))
    }

    /// Scores of a pose: inlier ratio, free share, misfit, roughness, variance inflation of neighbouring
    /// errors, visible and covered fractions, colour correlation.
    #[pyo3(signature = (window, problem, pose, halo, *, surface, colours, is_textured))]
    #[allow(clippy::too_many_arguments)]
    fn judge(
        &self,
        py: Python<'_>,
        window: &SeenWindow,
        problem: ProblemRequest<'_>,
        pose: [f64; 12],
        halo: f64,
        surface: Doubles<'_>,
        colours: Floats<'_>,
        is_textured: bool,
    ) -> PyResult<[f64; 8]> {
        let lens = problem.lens.lens();
        let problem = PlainProblem::of(&problem, &self.solve)?;
        let surface = Surface {
            points: surface.as_slice()?,
            colours: colours.as_slice()?,
        };
        check_length("colours", surface.colours, surface.points.len())?;
        let found = py.detach(|| {
            with_lens!(&lens, lens => {
                let problem = problem.seen(lens, window);
                self.simd.run(
                    #[inline(always)]
                    || problem.judge(&rigid(&pose), halo, &surface, is_textured, &self.judge),
                )
            })
        });
        Ok([
            found.inlier_ratio,
            found.free_share,
            found.misfit,
            found.roughness,
            found.variance_inflation,
            found.visible_fraction,
            found.covered_fraction,
            found.correlation,
        ])
    }
}
