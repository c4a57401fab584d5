//! What Python asks of the tracker's kernels, checked and free of Python.

use numpy::ndarray::Axis;
use numpy::{Element, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::camera::lens::Lens;
use crate::python::check::check_length;
use crate::python::lens::LensRequest;
use crate::python::track::seen_window::SeenWindow;
use crate::track::background::expected::Layer;
use crate::track::fit::solve::{Outline, Prior, Problem, SolveModel, Texture, UNKNOWNS};
use crate::track::rigid::Rigid;

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;
type Doubles<'py> = PyReadonlyArrayDyn<'py, f64>;

/// Another object drawn into a rectangle of the lens picture.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct LayerRequest<'py> {
    pub(crate) corner: [isize; 2],
    pub(crate) size: [usize; 2],
    pub(crate) rgb: Floats<'py>,
    pub(crate) alpha: Floats<'py>,
    pub(crate) nearer: Floats<'py>,
}

/// Contour points of an object.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct OutlineRequest<'py> {
    pub(crate) points: Doubles<'py>,
    pub(crate) normals: Doubles<'py>,
    pub(crate) inner_px: Doubles<'py>,
    pub(crate) outer_px: Doubles<'py>,
    pub(crate) colours: Floats<'py>,
}

/// Texture points of an object.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct TextureRequest<'py> {
    pub(crate) points: Doubles<'py>,
    pub(crate) values: Floats<'py>,
    pub(crate) slopes: Floats<'py>,
    pub(crate) correlation: f64,
}

/// What a pose is measured against, apart from the window.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ProblemRequest<'py> {
    pub(crate) lens: LensRequest,
    pub(crate) focal: f64,
    pub(crate) camera_from_world: [f64; 12],
    pub(crate) outline: OutlineRequest<'py>,
    pub(crate) texture: Option<TextureRequest<'py>>,
    pub(crate) centre: [f64; 3],
    pub(crate) prior_mean: [f64; 12],
    pub(crate) prior_sigma: [f64; UNKNOWNS],
    pub(crate) prior_halo: f64,
    pub(crate) low_pass_px: f64,
    pub(crate) is_round: bool,
}

/// The rows of a picture that comes in parts, one below the other; rows may be apart, their values
/// may not.
pub(crate) fn rows_of_picture<'a, T: Element>(
    name: &str,
    parts: &'a [PyReadonlyArrayDyn<'_, T>],
    [height, line]: [usize; 2],
) -> PyResult<Vec<&'a [T]>> {
    let mut rows = Vec::with_capacity(height);
    for part in parts {
        let values = part.as_array();
        let count = values.shape().first().copied().unwrap_or(0);
        let lines = (0..count).map(|row| values.clone().index_axis_move(Axis(0), row).to_slice());
        rows.extend(lines.flatten().filter(|row| row.len() == line));
    }
    if rows.len() != height {
        let shapes: Vec<_> = parts.iter().map(|part| part.shape().to_vec()).collect();
        return Err(PyValueError::new_err(format!(
            "{name}: parts of {shapes:?}, wanted {height} rows of {line} values without gaps"
        )));
    }
    Ok(rows)
}

pub(crate) fn layer_of<'a>(request: &'a LayerRequest<'_>) -> PyResult<Layer<'a>> {
    let [width, height] = request.size;
    let layer = Layer {
        left: request.corner[0],
        top: request.corner[1],
        width,
        height,
        rgb: request.rgb.as_slice()?,
        alpha: request.alpha.as_slice()?,
        nearer: request.nearer.as_slice()?,
    };
    check_length("layer.rgb", layer.rgb, 3 * width * height)?;
    check_length("layer.alpha", layer.alpha, width * height)?;
    check_length("layer.nearer", layer.nearer, width * height)?;
    Ok(layer)
}

/// A problem with its arrays borrowed and checked, free of Python.
pub(crate) struct PlainProblem<'a> {
    outline: Outline<'a>,
    texture: Option<Texture<'a>>,
    camera_from_world: Rigid,
    centre: [f64; 3],
    prior: Prior,
    model: SolveModel,
}

impl<'a> PlainProblem<'a> {
    pub(crate) fn of(request: &'a ProblemRequest<'_>, model: &SolveModel) -> PyResult<Self> {
        let outline = Outline {
            points: request.outline.points.as_slice()?,
            normals: request.outline.normals.as_slice()?,
            inner: request.outline.inner_px.as_slice()?,
            outer: request.outline.outer_px.as_slice()?,
            colours: request.outline.colours.as_slice()?,
        };
        let count = outline.inner.len();
        check_length("outline.points", outline.points, 3 * count)?;
        check_length("outline.normals", outline.normals, 2 * count)?;
        check_length("outline.outer_px", outline.outer, count)?;
        check_length("outline.colours", outline.colours, 3 * count)?;
        let mut model = SolveModel {
            focal: request.focal,
            is_round: request.is_round,
            low_pass_px: request.low_pass_px,
            ..*model
        };
        let mut texture = None;
        if let Some(asked) = &request.texture {
            let found = Texture {
                points: asked.points.as_slice()?,
                values: asked.values.as_slice()?,
                slopes: asked.slopes.as_slice()?,
            };
            check_length("texture.values", found.values, found.points.len())?;
            check_length("texture.slopes", found.slopes, 2 * found.points.len())?;
            model.texture_correlation = asked.correlation;
            texture = Some(found);
        }
        Ok(PlainProblem {
            outline,
            texture,
            camera_from_world: rigid(&request.camera_from_world),
            centre: request.centre,
            prior: Prior {
                mean: rigid(&request.prior_mean),
                sigma: request.prior_sigma,
                silhouette_bias: request.prior_halo,
            },
            model,
        })
    }

    pub(crate) fn seen<'b, L: Lens>(
        &'b self,
        lens: &'b L,
        window: &'b SeenWindow,
    ) -> Problem<'b, L> {
        Problem {
            lens,
            camera_from_world: self.camera_from_world,
            window: window.picture(),
            smooth: window.smooth(),
            outline: self.outline,
            texture: self.texture,
            centre: self.centre,
            prior: self.prior,
            model: self.model,
        }
    }
}

/// A pose from its 3 × 4 matrix, row by row.
pub(crate) fn rigid(rows: &[f64; 12]) -> Rigid {
    Rigid {
        rotation: std::array::from_fn(|i| std::array::from_fn(|j| rows[4 * i + j])),
        translation: std::array::from_fn(|i| rows[4 * i + 3]),
    }
}

pub(crate) fn rows_of(pose: &Rigid) -> [f64; 12] {
    std::array::from_fn(|k| match k % 4 {
        3 => pose.translation[k / 4],
        column => pose.rotation[k / 4][column],
    })
}
