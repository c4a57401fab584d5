//! The light that fits how an object is seen: least squares over its pixels.
//! `tracking/model/relighting.py` says the same.

/// What is even, what comes from x, y and z, what is added to red, green and blue.
const UNKNOWNS: usize = 7;

type Row = [f64; UNKNOWNS];

/// The constants of relighting in `tracking.kernels.photometry`.
#[derive(Clone, Copy)]
pub struct LightModel {
    pub residual_scale: f64,
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

impl Light {
    /// How much lighter by colour what faces some way, of at most 1, is seen.
    #[inline(always)]
    pub fn gains(&self, facing: [f64; 3], range: [f32; 2]) -> [f32; 3] {
        let [even, x, y, z] = self.by_side;
        let gain = even + facing[0] * x + facing[1] * y + facing[2] * z;
        self.tint
            .map(|tint| ((gain + tint) as f32).clamp(range[0], range[1]))
    }
}

/// Gain, sides and tints of an object in the light that it was scanned in.
const AS_SCANNED: Row = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Gaussian prior of an object's light relative to its scan, against what pixels are worth.
#[derive(Clone, Copy)]
pub struct LightPrior {
    /// Standard deviations of the overall gain, of a side over the opposite one, of a tint.
    pub sigma: [f64; 3],
    /// Inverse variance that one pixel's channel contributes.
    pub pixel_information: f64,
}

impl LightPrior {
    /// Inverse variances of gain, three sides, three tints.
    fn information(&self) -> Row {
        std::array::from_fn(|k| self.sigma[k.div_ceil(3)].powi(-2))
    }

    /// Log of the prior density, relative to its peak.
    pub fn nats(&self, light: &Light) -> f64 {
        let row = light.by_side.iter().chain(&light.tint);
        let apart = row.zip(AS_SCANNED).map(|(value, mean)| value - mean);
        let weighed = apart.zip(self.information());
        -0.5 * weighed
            .map(|(apart, information)| information * apart * apart)
            .sum::<f64>()
    }
}

/// A pixel that the light is estimated from.
pub struct Sample {
    pub rgb: [f64; 3],
    /// 1, and where it faces.
    pub sides: [f64; 4],
    pub seen: [f64; 3],
    pub weight: f64,
}

impl Sample {
    /// Square of how far its colours are from what some light would make them.
    #[inline(always)]
    fn apart2(&self, light: &Row) -> f64 {
        let gain: f64 = (0..4).map(|k| light[k] * self.sides[k]).sum();
        let apart = (0..3).map(|k| self.rgb[k] * (gain + light[4 + k]) - self.seen[k]);
        apart.map(|apart| apart * apart).sum()
    }

    /// Adds it to the normal equations, of which those below the diagonal say all.
    #[inline(always)]
    fn add(&self, trusted: f64, power: &mut [Row; UNKNOWNS], both: &mut Row) {
        let squares = self.rgb.map(|colour| trusted * colour * colour);
        let shares: [f64; 3] = std::array::from_fn(|k| trusted * self.rgb[k] * self.seen[k]);
        let (square, share): (f64, f64) = (squares.iter().sum(), shares.iter().sum());
        for (i, side) in self.sides.iter().enumerate() {
            both[i] += share * side;
            for (j, other) in self.sides[..=i].iter().enumerate() {
                power[i][j] += square * side * other;
            }
            for (k, square) in squares.iter().enumerate() {
                power[4 + k][i] += square * side;
            }
        }
        for k in 0..3 {
            power[4 + k][4 + k] += squares[k];
            both[4 + k] += shares[k];
        }
    }
}

/// Reweighted least squares (Geman-McClure) of `seen = rgb · gains(facing)`; without a prior, light
/// is weakly held to be the same on all sides and without colour.
#[inline(always)]
pub fn fitted(samples: &[Sample], model: &LightModel, prior: Option<&LightPrior>) -> Light {
    let mut light = [0.0; UNKNOWNS];
    let scale2 = model.residual_scale * model.residual_scale;
    for round in 0..model.fits {
        let (mut power, mut both) = ([[0.0; UNKNOWNS]; UNKNOWNS], [0.0; UNKNOWNS]);
        for sample in samples {
            let familiar = match round {
                0 => 1.0,
                _ => scale2 / (scale2 + sample.apart2(&light)),
            };
            sample.add(sample.weight * familiar * familiar, &mut power, &mut both);
        }
        match prior {
            None => {
                let whole = power[0][0];
                for (i, row) in power.iter_mut().enumerate() {
                    let firm = [0.0, model.even, model.white][i.div_ceil(3)];
                    row[i] += firm * whole + model.least_power;
                }
            }
            Some(prior) => {
                for (i, information) in prior.information().into_iter().enumerate() {
                    power[i][i] += information / prior.pixel_information;
                    both[i] += information / prior.pixel_information * AS_SCANNED[i];
                }
            }
        }
        light = solved(&power, &both);
    }
    let [even, x, y, z, red, green, blue] = light;
    Light {
        by_side: [even, x, y, z],
        tint: [red, green, blue],
    }
}

/// x of a · x = b for a symmetric, positive a, read up to its diagonal (Cholesky).
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

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: LightModel = LightModel {
        residual_scale: 0.15,
        even: 1e-6,
        white: 1e-6,
        fits: 3,
        range: [0.3, 3.5],
        enough_px: 400,
        seen: 0.05,
        least_power: 1e-9,
    };

    #[test]
    fn light_is_fitted_in_spite_of_a_spot_that_is_printed_on() {
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
        let light = fitted(&samples, &MODEL, None);
        let found = light.by_side.iter().chain(&light.tint);
        for (found, wanted) in found.zip(wanted) {
            assert!((found - wanted).abs() < 0.05, "{found} {wanted}");
        }
    }

    #[test]
    fn where_nothing_is_seen_light_is_nothing() {
        let light = fitted(&[], &MODEL, None);
        assert_eq!(light.by_side, [0.0; 4]);
        assert_eq!(light.gains([0.0, 0.0, 1.0], MODEL.range), [0.3; 3]);
    }

    #[test]
    fn where_nothing_is_seen_light_is_as_the_prior_has_it() {
        let prior = LightPrior {
            sigma: [0.35, 0.3, 0.1],
            pixel_information: 1.0,
        };
        let light = fitted(&[], &MODEL, Some(&prior));
        assert!(prior.nats(&light).abs() < 1e-12);
        assert!((light.by_side[0] - 1.0).abs() < 1e-12);
    }
}
