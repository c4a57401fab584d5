//! What Python sees of how far a window speaks for an object at a pose.

use numpy::PyReadonlyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::check::check_length;
use crate::python::engine::Engine;
use crate::python::lens::with_lens;
use crate::python::request::pool_of;
use crate::python::track::poses::{BodyRequest, DrawingRequest, PosesRequest};
use crate::python::track::relight::LightConstants;
use crate::render::alone::Drawer;
use crate::track::appearance::compared::{Behind, Drawn, Part, Window};
use crate::track::appearance::poses::Comparison;
use crate::track::appearance::support::{support, Support, SupportModel, Terms};
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

/// An object drawn alone, as scanned and coloured by where it faces.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct DrawnRequest<'py> {
    finer: usize,
    rgb: Floats<'py>,
    alpha: Floats<'py>,
    depth: Floats<'py>,
    compass: Floats<'py>,
    compass_alpha: Floats<'py>,
}

impl DrawnRequest<'_> {
    fn drawn(&self, part: Part) -> PyResult<Drawn<'_>> {
        let count = part.width * part.height * self.finer * self.finer;
        let pictures = [
            ("rgb", &self.rgb, 3 * count),
            ("alpha", &self.alpha, count),
            ("depth", &self.depth, count),
            ("compass", &self.compass, 3 * count),
            ("compass_alpha", &self.compass_alpha, count),
        ];
        for (name, values, wanted) in pictures {
            check_length(name, values.as_slice()?, wanted)?;
        }
        Ok(Drawn {
            finer: self.finer,
            rgb: self.rgb.as_slice()?,
            alpha: self.alpha.as_slice()?,
            depth: self.depth.as_slice()?,
            compass: self.compass.as_slice()?,
            compass_alpha: self.compass_alpha.as_slice()?,
        })
    }
}

/// How a pose is compared; `part` is left, top, width and height.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct TermsRequest {
    part: [usize; 4],
    ring_px: usize,
    reach_px: f32,
    shared_px2: f64,
    sigma: f32,
    most_misfit: f32,
    occluded: f32,
}

impl TermsRequest {
    fn terms(&self, [columns, rows]: [usize; 2]) -> PyResult<Terms> {
        let [left, top, width, height] = self.part;
        if width == 0 || height == 0 || left + width > columns || top + height > rows {
            let part = self.part;
            return Err(PyValueError::new_err(format!(
                "part: {part:?}, wanted pixels within {columns}×{rows}"
            )));
        }
        Ok(Terms {
            part: Part {
                left,
                top,
                width,
                height,
            },
            ring_px: self.ring_px,
            reach_px: self.reach_px,
            shared_px2: self.shared_px2,
            sigma: self.sigma,
            most_misfit: self.most_misfit,
            occluded: self.occluded,
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
    simd: Simd,
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
            simd: Simd::detect(),
        }
    }

    /// Nats, samples, open, matched and unknown fractions, and area of an object drawn in a part of a
    /// window.
    fn support(
        &self,
        py: Python<'_>,
        window: WindowRequest<'_>,
        drawn: DrawnRequest<'_>,
        terms: TermsRequest,
    ) -> PyResult<Said> {
        let terms = terms.terms(window.size)?;
        let (window, drawn) = (window.window()?, drawn.drawn(terms.part)?);
        let found = py.detach(|| {
            self.simd.run(
                #[inline(always)]
                || support(&window, &drawn, &terms, &self.model),
            )
        });
        Ok(said(&found))
    }

    /// The same of an object at each of some poses, each placed and drawn here.
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
