//! What Python sees of how far a window speaks for an object at a pose.

use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::python::check::check_length;
use crate::python::engine::Engine;
use crate::python::lens::with_lens;
use crate::python::request::pool_of;
use crate::python::track::poses::{BodyRequest, DrawingRequest, PosesRequest};
use crate::python::track::relight::LightConstants;
use crate::render::alone::Drawer;
use crate::track::appearance::compared::{Behind, Window};
use crate::track::appearance::poses::Comparison;
use crate::track::appearance::support::{Support, SupportModel};
use crate::track::appearance::unknown::UnknownModel;

type Floats<'py> = PyReadonlyArrayDyn<'py, f32>;

/// The constants of `tracking.likelihood.pose_likelihood`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Constants {
    light: LightConstants,
    light_sigma: [f64; 3],
    foreign: f32,
    unknown_edge: f32,
    unknown_prior: f32,
    unknown_range: [f32; 2],
    unknown_gap_px: usize,
    behind_m: f32,
    behind_share: f32,
    least_px: f64,
    least_changed: f32,
    least_lit: usize,
    residual_sigma: f32,
    most_misfit: f32,
}

/// A window's pictures.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct WindowRequest<'py> {
    pub(crate) size: [usize; 2],
    live: Floats<'py>,
    empty: Floats<'py>,
    expected: Floats<'py>,
    changed: Floats<'py>,
    foreground: Floats<'py>,
    room_misfit: Floats<'py>,
    foreign_misfit: Floats<'py>,
    hidden: Floats<'py>,
    claimed: Floats<'py>,
    range_m: Floats<'py>,
    in_any_light: bool,
}

impl WindowRequest<'_> {
    pub(crate) fn window(&self) -> PyResult<Window<'_>> {
        let count = self.size[0] * self.size[1];
        let pictures = [
            ("live", &self.live, 3 * count),
            ("empty", &self.empty, 3 * count),
            ("expected", &self.expected, 3 * count),
            ("changed", &self.changed, count),
            ("foreground", &self.foreground, count),
            ("room_misfit", &self.room_misfit, count),
            ("foreign_misfit", &self.foreign_misfit, count),
            ("hidden", &self.hidden, count),
            ("claimed", &self.claimed, count),
            ("range_m", &self.range_m, count),
        ];
        for (name, values, wanted) in pictures {
            check_length(name, values.as_slice()?, wanted)?;
        }
        Ok(Window {
            width: self.size[0],
            live: self.live.as_slice()?,
            empty: self.empty.as_slice()?,
            expected: self.expected.as_slice()?,
            changed: self.changed.as_slice()?,
            foreground: self.foreground.as_slice()?,
            room_misfit: self.room_misfit.as_slice()?,
            foreign_misfit: self.foreign_misfit.as_slice()?,
            hidden: self.hidden.as_slice()?,
            claimed: self.claimed.as_slice()?,
            range_m: self.range_m.as_slice()?,
            in_any_light: self.in_any_light,
        })
    }
}

/// Nats, samples, open, matched and unknown fractions, and area.
type Said = (f64, f64, f64, f64, f64, f64);

fn said(found: &Support) -> Said {
    (
        found.nats,
        found.samples,
        found.open_fraction,
        found.matched_fraction,
        found.unknown_fraction,
        found.area_px,
    )
}

/// The likelihood of poses; the twin is `tests.twins.likelihood`.
#[pyclass(frozen, module = "scenes._native", name = "PoseLikelihood")]
pub struct PoseLikelihood {
    model: SupportModel,
}

#[pymethods]
impl PoseLikelihood {
    #[new]
    fn new(constants: Constants) -> Self {
        let c = constants;
        PoseLikelihood {
            model: SupportModel {
                light: c.light.model(),
                light_sigma: c.light_sigma,
                foreign: c.foreign,
                unknown: UnknownModel {
                    edge_sigma: c.unknown_edge,
                    prior_weight: c.unknown_prior,
                    range: c.unknown_range,
                    gap_px: c.unknown_gap_px,
                },
                behind: Behind {
                    m: c.behind_m,
                    share: c.behind_share,
                },
                least_px: c.least_px,
                least_changed: c.least_changed,
                least_lit: c.least_lit,
                residual_sigma: c.residual_sigma,
                most_misfit: c.most_misfit,
            },
        }
    }

    /// Nats, samples, open, matched and unknown fractions, and area of an object at each of some
    /// poses, placed and drawn here.
    fn supports<'py>(
        &self,
        py: Python<'py>,
        window: WindowRequest<'py>,
        body: BodyRequest<'py>,
        poses: PosesRequest<'py>,
        drawing: DrawingRequest<'py>,
    ) -> PyResult<Vec<Said>> {
        let DrawingRequest { engine, lens, draw } = drawing;
        let view = draw.view(&lens)?;
        let seen = window.window()?;
        if window.size != [view.width, view.height] {
            return Err(PyValueError::new_err(format!(
                "lens: {:?} px, wanted the window's {:?}",
                [view.width, view.height],
                window.size
            )));
        }
        let plain = body.plain();
        let poses_of_body = poses.poses(plain.levels.len())?;
        let Engine {
            engine,
            pools,
            simd,
        } = engine.get();
        let pool = pool_of(pools, draw.threads)?;
        let (placing, tolerance) = (poses.placing(), poses.tolerance());
        let found = py.detach(|| {
            with_lens!(&lens.lens(), lens => {
                let comparison = Comparison {
                    window: seen,
                    lens,
                    view,
                    body: plain,
                    placing,
                    tolerance,
                    model: &self.model,
                    drawer: Drawer {
                        engine,
                        simd: *simd,
                        pool: &pool,
                    },
                };
                comparison.supports(&poses_of_body)
            })
        });
        Ok(found.iter().map(said).collect())
    }
}
