//! In what light an object is seen: how much lighter each side is than it was scanned.
//! `tracking/relight.py` says the same.

use crate::scene::cloud::Cloud;
use crate::track::picture::{filtered, gaussian};

/// Standard deviation of the lens's blur, px, and the taps of its filter; as in `tracking.resemblance`.
const LENS_BLUR_PX: f32 = 0.6;
const LENS_TAPS: usize = 5;
/// Where less of the object is drawn, the direction in which it faces is not known.
const LEAST_ALPHA: f32 = 1e-3;
/// Value of the first spherical harmonic: what a colour of 1 is divided by.
const SH_C0: f32 = 0.282_094_8;
/// What is even, what comes from x, y and z, what is added to red, green and blue.
const UNKNOWNS: usize = 7;

type Row = [f64; UNKNOWNS];

/// The constants of `tracking.relight`.
#[derive(Clone, Copy)]
pub struct LightModel {
    pub strange: f64,
    pub even: f64,
    pub white: f64,
    pub fits: usize,
    pub range: [f32; 2],
    pub enough_px: usize,
    pub seen: f32,
    pub least_power: f64,
}

/// How much lighter than in its scan an object is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Of a side that faces nowhere, and more along x, y and z of the object.
    pub by_side: [f64; 4],
    /// Added to it by colour.
    pub tint: [f64; 3],
}

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

impl Light {
    /// How much lighter by colour what faces some way, of at most 1, is seen.
    #[inline(always)]
    fn gains(&self, facing: [f64; 3], range: [f32; 2]) -> [f32; 3] {
        let [even, x, y, z] = self.by_side;
        let gain = even + facing[0] * x + facing[1] * y + facing[2] * z;
        self.tint
            .map(|tint| ((gain + tint) as f32).clamp(range[0], range[1]))
    }
}

impl Drawn<'_> {
    /// Where what a pixel shows faces.
    #[inline(always)]
    fn facing(&self, pixel: usize) -> [f64; 3] {
        let covered = self.alpha[pixel].max(LEAST_ALPHA);
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
    fitted(&samples, model)
}

/// A pixel that the light is estimated from.
struct Sample {
    rgb: [f64; 3],
    /// 1, and where it faces.
    sides: [f64; 4],
    seen: [f64; 3],
    weight: f64,
}

impl Sample {
    /// Square of how far its colours are from what some light would make them.
    #[inline(always)]
    fn apart2(&self, light: &Row) -> f64 {
        let gain: f64 = (0..4).map(|k| light[k] * self.sides[k]).sum();
        let apart = (0..3).map(|k| self.rgb[k] * (gain + light[4 + k]) - self.seen[k]);
        apart.map(|apart| apart * apart).sum()
    }

    /// Adds it to the normal equations.
    #[inline(always)]
    fn add(&self, trusted: f64, power: &mut [Row; UNKNOWNS], both: &mut Row) {
        let squares = self.rgb.map(|colour| trusted * colour * colour);
        let shares: [f64; 3] = std::array::from_fn(|k| trusted * self.rgb[k] * self.seen[k]);
        let (square, share): (f64, f64) = (squares.iter().sum(), shares.iter().sum());
        for (i, side) in self.sides.iter().enumerate() {
            both[i] += share * side;
            for (j, other) in self.sides.iter().enumerate() {
                power[i][j] += square * side * other;
            }
            for (k, square) in squares.iter().enumerate() {
                power[i][4 + k] += square * side;
                power[4 + k][i] += square * side;
            }
        }
        for k in 0..3 {
            power[4 + k][4 + k] += squares[k];
            both[4 + k] += shares[k];
        }
    }
}

/// Reweighted least squares (Geman-McClure) of `seen = rgb · gains(facing)`.
#[inline(always)]
fn fitted(samples: &[Sample], model: &LightModel) -> Light {
    let mut light = [0.0; UNKNOWNS];
    let scale2 = model.strange * model.strange;
    for round in 0..model.fits {
        let (mut power, mut both) = ([[0.0; UNKNOWNS]; UNKNOWNS], [0.0; UNKNOWNS]);
        for sample in samples {
            let familiar = match round {
                0 => 1.0,
                _ => scale2 / (scale2 + sample.apart2(&light)),
            };
            sample.add(sample.weight * familiar * familiar, &mut power, &mut both);
        }
        let whole = power[0][0];
        for (i, row) in power.iter_mut().enumerate() {
            let firm = [0.0, model.even, model.white][i.div_ceil(3)];
            row[i] += firm * whole + model.least_power;
        }
        light = solved(&power, &both);
    }
    let [even, x, y, z, red, green, blue] = light;
    Light {
        by_side: [even, x, y, z],
        tint: [red, green, blue],
    }
}

/// x of a · x = b for a symmetric, positive a (Cholesky).
fn solved(a: &[Row; UNKNOWNS], b: &Row) -> Row {
    let mut lower = [[0.0; UNKNOWNS]; UNKNOWNS];
    let mut x = *b;
    for i in 0..UNKNOWNS {
        for j in 0..=i {
            let shared: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let left: f64 = a[i][j] - shared;
            lower[i][j] = match i == j {
                true => left.max(f64::MIN_POSITIVE).sqrt(),
                false => left / lower[j][j],
            };
        }
        let shared: f64 = (0..i).map(|k| lower[i][k] * x[k]).sum();
        x[i] = (x[i] - shared) / lower[i][i];
    }
    for i in (0..UNKNOWNS).rev() {
        let shared: f64 = (i + 1..UNKNOWNS).map(|k| lower[k][i] * x[k]).sum();
        x[i] = (x[i] - shared) / lower[i][i];
    }
    x
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

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: LightModel = LightModel {
        strange: 0.15,
        even: 1e-6,
        white: 1e-6,
        fits: 3,
        range: [0.3, 3.5],
        enough_px: 400,
        seen: 0.05,
        least_power: 1e-9,
    };

    #[test]
    fn light_is_told_in_spite_of_a_spot_that_is_printed_on() {
        let wanted = [1.2, 0.3, -0.2, 0.1, 0.05, 0.0, -0.05];
        let samples: Vec<Sample> = (0..300)
            .map(|k| {
                let (turn, height) = (f64::from(k) * 2.4, f64::from(k % 7) / 7.0 - 0.4);
                let across = (1.0 - height * height).sqrt();
                let rgb = [0.3, 0.4, 0.5].map(|colour| colour + 0.1 * f64::from(k % 3));
                let sides = [1.0, across * turn.cos(), across * turn.sin(), height];
                let gain: f64 = (0..4).map(|k| wanted[k] * sides[k]).sum();
                let lit = std::array::from_fn(|k| rgb[k] * (gain + wanted[4 + k]));
                Sample {
                    rgb,
                    sides,
                    seen: if k % 10 == 0 { [0.9, 0.0, 0.9] } else { lit },
                    weight: 1.0,
                }
            })
            .collect();
        let light = fitted(&samples, &MODEL);
        let found = light.by_side.iter().chain(&light.tint);
        for (found, wanted) in found.zip(wanted) {
            assert!((found - wanted).abs() < 0.05, "{found} {wanted}");
        }
    }

    #[test]
    fn where_nothing_is_seen_light_is_nothing() {
        let light = fitted(&[], &MODEL);
        assert_eq!(light.by_side, [0.0; 4]);
        assert_eq!(light.gains([0.0, 0.0, 1.0], MODEL.range), [0.3; 3]);
    }
}
