//! What Python sees of the light that an object stands in.

use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;

use crate::machine::simd::Simd;
use crate::python::alone::Alone;
use crate::python::check::check_length;
use crate::python::track::setting::Setting;
use crate::render::alone::Drawing;
use crate::track::appearance::light_fit::{Light, LightModel};
use crate::track::appearance::relight::{light_of, relit, Drawn};

/// The constants of relighting in `tracking.kernels.photometry`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct LightConstants {
    residual_scale: f64,
    even: f64,
    white: f64,
    fits: usize,
    range: [f32; 2],
    enough_px: usize,
    seen: f32,
    least_power: f64,
}

impl LightConstants {
    pub(crate) fn model(&self) -> LightModel {
        LightModel {
            residual_scale: self.residual_scale,
            even: self.even,
            white: self.white,
            fits: self.fits,
            range: self.range,
            enough_px: self.enough_px,
            seen: self.seen,
            least_power: self.least_power,
        }
    }
}

/// An object drawn as scanned and coloured by where it faces, and where each of its splats does.
#[pyclass(frozen, module = "scenes._native", name = "Shell")]
pub struct Shell {
    scanned: Py<Alone>,
    compass: Py<Alone>,
    facing: Vec<[f64; 3]>,
}

#[pymethods]
impl Shell {
    #[new]
    fn new(
        scanned: Py<Alone>,
        compass: Py<Alone>,
        facing: PyReadonlyArrayDyn<'_, f64>,
    ) -> PyResult<Self> {
        let facing = facing.as_slice()?;
        check_length("facing", facing, 3 * scanned.get().cloud().places.len())?;
        let facing = facing.chunks_exact(3);
        Ok(Shell {
            scanned,
            compass,
            facing: facing.map(|axis| [axis[0], axis[1], axis[2]]).collect(),
        })
    }
}

/// A shell as it is drawn at one pose.
struct Pictures {
    scanned: Drawing,
    compass: Drawing,
}

impl Pictures {
    fn drawn(&self) -> Drawn<'_> {
        Drawn {
            rgb: &self.scanned.rgb,
            alpha: &self.scanned.alpha,
            compass: &self.compass.rgb,
        }
    }
}

/// Estimates the light in which an object is seen; the twin is `tracking.model.relighting.LitView`.
#[pyclass(frozen, module = "scenes._native", name = "Relighter")]
pub struct Relighter {
    model: LightModel,
    simd: Simd,
}

#[pymethods]
impl Relighter {
    #[new]
    fn new(constants: LightConstants) -> Self {
        Relighter {
            model: constants.model(),
            simd: Simd::detect(),
        }
    }

    /// How much lighter an object that faces nowhere is seen at a pose (x, y, z, yaw), how much more
    /// along its x, y and z, and what is added by colour.
    fn light(
        &self,
        py: Python<'_>,
        setting: &Setting,
        shell: &Shell,
        upright: [f64; 4],
    ) -> PyResult<([f64; 4], [f64; 3])> {
        let pictures = self.drawn(py, setting, shell, upright)?;
        let light = self.estimated(setting, &pictures);
        Ok((light.by_side, light.tint))
    }

    /// Similarity score of an object at a pose, in the light estimated there, and the picture.
    fn resemblance(
        &self,
        py: Python<'_>,
        setting: &Setting,
        shell: &Shell,
        upright: [f64; 4],
    ) -> PyResult<f64> {
        let pictures = self.drawn(py, setting, shell, upright)?;
        let light = self.estimated(setting, &pictures);
        let drawn = pictures.drawn();
        Ok(self.simd.run(
            #[inline(always)]
            || {
                let lit = drawn.lit(&light, &self.model);
                setting.plain().similarity(&lit, drawn.alpha)
            },
        ))
    }

    /// The object in the light estimated at a pose; `fine` is how it will be drawn.
    fn relit(
        &self,
        py: Python<'_>,
        setting: &Setting,
        shell: &Shell,
        fine: &Alone,
        upright: [f64; 4],
    ) -> PyResult<Alone> {
        let pictures = self.drawn(py, setting, shell, upright)?;
        let light = self.estimated(setting, &pictures);
        let scanned = shell.scanned.get();
        let eye = scanned.eye(upright);
        let cloud = relit(scanned.cloud(), &shell.facing, eye, &light, &self.model);
        Ok(fine.with(py, cloud))
    }
}

impl Relighter {
    fn drawn(
        &self,
        py: Python<'_>,
        setting: &Setting,
        shell: &Shell,
        upright: [f64; 4],
    ) -> PyResult<Pictures> {
        let (scanned, compass) = (shell.scanned.get(), shell.compass.get());
        for alone in [scanned, compass] {
            alone.check_size(setting.plain().size())?;
        }
        let pool = scanned.pool()?;
        Ok(py.detach(|| {
            let [scanned, compass] = [scanned, compass].map(|alone| {
                let mut drawing = Drawing::default();
                alone.draw(upright, &pool, &mut drawing);
                drawing
            });
            Pictures { scanned, compass }
        }))
    }

    fn estimated(&self, setting: &Setting, pictures: &Pictures) -> Light {
        let (seen, drawn) = (setting.plain().seen(), pictures.drawn());
        self.simd.run(
            #[inline(always)]
            || light_of(&seen, &drawn, &self.model),
        )
    }
}
