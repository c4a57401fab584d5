//! In what light an object is seen: how much lighter each side is than it was scanned.
//! `tracking/model/relighting.py` says the same.

use crate::scene::cloud::Cloud;
use crate::track::appearance::light_fit::{fitted, Light, LightModel, Sample};
use crate::track::picture::{filtered, gaussian};

/// Standard deviation of the lens's blur, px, and the taps of its filter; as in `tracking.model.similarity`.
pub const LENS_BLUR_PX: f32 = 0.6;
pub const LENS_TAPS: usize = 5;
/// Where less of the object is drawn, the direction in which it faces is not known.
pub const MIN_ALPHA: f32 = 1e-3;
/// Value of the first spherical harmonic: what a colour of 1 is divided by.
const SH_C0: f32 = 0.282_094_8;

/// A part of the live picture: interleaved colours, what it would show without the object, and one
/// value per pixel of how much no nearer object covers.
#[derive(Clone, Copy)]
pub struct Seen<'a> {
    pub size: [usize; 2],
    pub live: &'a [f32],
    pub empty: &'a [f32],
    pub free: &'a [f32],
}

/// An object drawn alone, as scanned and coloured by where it faces.
#[derive(Clone, Copy)]
pub struct Drawn<'a> {
    pub rgb: &'a [f32],
    pub alpha: &'a [f32],
    pub compass: &'a [f32],
}

impl Drawn<'_> {
    /// Where what a pixel shows faces.
    #[inline(always)]
    fn facing(&self, pixel: usize) -> [f64; 3] {
        let covered = self.alpha[pixel].max(MIN_ALPHA);
        std::array::from_fn(|axis| f64::from(self.compass[3 * pixel + axis] / covered * 2.0 - 1.0))
    }

    /// The colours of the object in some light.
    #[inline(always)]
    pub fn lit(&self, light: &Light, model: &LightModel) -> Vec<f32> {
        let mut lit = vec![0.0; self.rgb.len()];
        for (pixel, to) in lit.chunks_exact_mut(3).enumerate() {
            // Black is black in any light.
            if self.alpha[pixel] > 0.0 {
                let gains = light.gains(self.facing(pixel), model.range);
                for channel in 0..3 {
                    to[channel] = self.rgb[3 * pixel + channel] * gains[channel];
                }
            }
        }
        lit
    }
}

/// The light in which the colours of a rendered object come nearest to the picture's (robust least
/// squares).
#[inline(always)]
pub fn light_of(seen: &Seen, drawn: &Drawn, model: &LightModel) -> Light {
    let lens: [f32; LENS_TAPS] = gaussian(LENS_BLUR_PX);
    let alpha = filtered(drawn.alpha, seen.size, 1, &lens);
    let rgb = filtered(drawn.rgb, seen.size, 3, &lens);
    let weight = |pixel: usize| seen.free[pixel] * alpha[pixel];
    let here: Vec<usize> = (0..alpha.len())
        .filter(|&pixel| weight(pixel) > model.seen)
        .collect();
    let every = (here.len() / model.enough_px).max(1);
    let samples: Vec<Sample> = here
        .into_iter()
        .step_by(every)
        .map(|pixel| {
            let at = |values: &[f32], channel: usize| values[3 * pixel + channel];
            let through = 1.0 - alpha[pixel];
            let [x, y, z] = drawn.facing(pixel);
            Sample {
                rgb: std::array::from_fn(|k| f64::from(at(&rgb, k))),
                sides: [1.0, x, y, z],
                seen: std::array::from_fn(|k| {
                    f64::from(at(seen.live, k) - through * at(seen.empty, k))
                }),
                weight: f64::from(weight(pixel)),
            }
        })
        .collect();
    fitted(&samples, model, None)
}

/// A cloud in some light; what is seen of a side from behind is lit like the whole.
///
/// `facing`: unit vectors away from the object, in the order the splats were given; `eye`: from where
/// they are seen, in their frame.
pub fn relit(
    scanned: &Cloud,
    facing: &[[f64; 3]],
    eye: [f64; 3],
    light: &Light,
    model: &LightModel,
) -> Cloud {
    scanned.recoloured(|index, mean, sh| {
        let towards: f64 = (0..3)
            .map(|k| (eye[k] - f64::from(mean[k])) * facing[index][k])
            .sum();
        let seen = if towards > 0.0 {
            facing[index]
        } else {
            [0.0; 3]
        };
        let gains = light.gains(seen, model.range);
        for coefficient in sh.iter_mut() {
            for (value, gain) in coefficient.iter_mut().zip(gains) {
                *value *= gain;
            }
        }
        for (value, gain) in sh[0].iter_mut().zip(gains) {
            *value += (gain - 1.0) * (0.5 / SH_C0);
        }
    })
}
