//! Adam (Kingma and Ba 2015) on one row of numbers.

/// Share of the first and of the second moment that a step keeps: the paper's values.
pub const BETA_FIRST: f32 = 0.9;
pub const BETA_SECOND: f32 = 0.999;
/// As in 3D Gaussian splatting: gradients of a mean over pixels are tiny.
pub const EPSILON: f32 = 1e-15;

/// Factors that undo the moments' start at zero after `steps` steps.
#[derive(Clone, Copy, Debug)]
pub struct Correction {
    first: f32,
    root_second: f32,
}

impl Correction {
    pub fn after(steps: u32) -> Correction {
        // Beyond this both are 1 to the last bit.
        let steps = steps.clamp(1, 100_000) as i32;
        Correction {
            first: 1.0 / (1.0 - BETA_FIRST.powi(steps)),
            root_second: 1.0 / (1.0 - f64::from(BETA_SECOND).powi(steps)).sqrt() as f32,
        }
    }
}

/// Moves `values` against `gradient`, each by its own rate.
#[inline(always)]
pub fn step(
    values: &mut [f32],
    first: &mut [f32],
    second: &mut [f32],
    gradient: &[f32],
    rates: &[f32],
    correction: Correction,
) {
    let count = values.len();
    let (first, second) = (&mut first[..count], &mut second[..count]);
    let (gradient, rates) = (&gradient[..count], &rates[..count]);
    for k in 0..count {
        let slope = gradient[k];
        first[k] = BETA_FIRST * first[k] + (1.0 - BETA_FIRST) * slope;
        second[k] = BETA_SECOND * second[k] + (1.0 - BETA_SECOND) * slope * slope;
        let root = second[k].sqrt() * correction.root_second;
        values[k] -= rates[k] * correction.first * first[k] / (root + EPSILON);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_is_as_long_as_the_rate() {
        let mut values = [1.0, 2.0, 3.0];
        let (mut first, mut second) = ([0.0; 3], [0.0; 3]);
        let gradient = [1e-7, -3.0, 0.0];
        let rates = [0.1, 0.2, 0.3];
        step(
            &mut values,
            &mut first,
            &mut second,
            &gradient,
            &rates,
            Correction::after(1),
        );
        for (value, wanted) in values.iter().zip([0.9, 2.2, 3.0]) {
            assert!((value - wanted).abs() < 1e-5, "{value} {wanted}");
        }
    }
}
