//! A lens's exposure from scattered pixels, and mean colours of patches that are at rest.

use crate::track::rigid::dot;

/// Gain, falloff and offset of one channel: `seen ≈ background · (gain + falloff · r²) + offset`, robust
/// against pixels that show something else (Geman-McClure, its scale shrinking with the residuals).
pub fn exposure(background: &[f64], radius2: &[f64], seen: &[f64], rounds: usize) -> [f64; 3] {
    let rows: Vec<[f64; 3]> = background
        .iter()
        .zip(radius2)
        .map(|(p, r)| [*p, p * r, 1.0])
        .collect();
    let apart: Vec<f64> = seen.iter().zip(background).map(|(s, p)| s - p).collect();
    let mut x = [1.0, 0.0, median(&apart)];
    let mut residuals = vec![0.0; seen.len()];
    let mut sizes = vec![0.0; seen.len()];
    for _ in 0..rounds {
        for ((row, seen), (residual, size)) in rows
            .iter()
            .zip(seen)
            .zip(residuals.iter_mut().zip(&mut sizes))
        {
            *residual = seen - (row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
            *size = residual.abs();
        }
        let scale = (1.5 * median(&sizes)).max(0.01);
        let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
        for ((row, seen), residual) in rows.iter().zip(seen).zip(&residuals) {
            let relative = residual / scale;
            let falling = 1.0 / (1.0 + relative * relative);
            let weight = falling * falling;
            for i in 0..3 {
                for j in 0..3 {
                    a[i][j] += weight * row[i] * row[j];
                }
                b[i] += weight * row[i] * seen;
            }
        }
        for (i, row) in a.iter_mut().enumerate() {
            row[i] += 1e-9;
        }
        x = solved3(&a, &b);
    }
    x
}

/// x of a · x = b (Cramer).
fn solved3(a: &[[f64; 3]; 3], b: &[f64; 3]) -> [f64; 3] {
    let whole = determinant(a);
    std::array::from_fn(|column| {
        let mut replaced = *a;
        for (row, value) in replaced.iter_mut().zip(b) {
            row[column] = *value;
        }
        determinant(&replaced) / whole
    })
}

fn determinant(a: &[[f64; 3]; 3]) -> f64 {
    a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1])
        - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
        + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0])
}

/// Mean RGB, 0..1, of squares of `side` pixels that start at each corner (left, top); `at` gives a
/// row's values from a column on.
pub fn patch_means<'a>(
    corners: &[[usize; 2]],
    side: usize,
    at: impl Fn(usize, usize) -> &'a [u8],
) -> Vec<f32> {
    let share = 1.0 / (255.0 * (side * side) as f32);
    let mut means = Vec::with_capacity(3 * corners.len());
    for [left, top] in corners {
        let mut sums = [0u32; 3];
        for row in *top..top + side {
            for rgb in at(row, *left)[..3 * side].chunks_exact(3) {
                for (sum, value) in sums.iter_mut().zip(rgb) {
                    *sum += u32::from(*value);
                }
            }
        }
        means.extend(sums.map(|sum| sum as f32 * share));
    }
    means
}

/// Robust shared gain and per-channel level of seen ≈ gain · drawn + level.
#[inline(always)]
pub fn gain_and_level(drawn: &[[f64; 3]], seen: &[[f64; 3]]) -> (f64, [f64; 3]) {
    let mut weight = vec![1.0; drawn.len()];
    let mut off = vec![0.0; drawn.len()];
    let (mut gain, mut level) = (1.0, [0.0; 3]);
    for _ in 0..4 {
        let total = weight.iter().sum::<f64>().max(1e-9);
        let (mut mean_drawn, mut mean_seen) = ([0.0; 3], [0.0; 3]);
        for ((d, s), w) in drawn.iter().zip(seen).zip(&weight) {
            for channel in 0..3 {
                mean_drawn[channel] += w * d[channel] / total;
                mean_seen[channel] += w * s[channel] / total;
            }
        }
        let (mut spread, mut shared) = (0.0, 0.0);
        for ((d, s), w) in drawn.iter().zip(seen).zip(&weight) {
            for channel in 0..3 {
                let a = d[channel] - mean_drawn[channel];
                spread += w * a * a;
                shared += w * a * (s[channel] - mean_seen[channel]);
            }
        }
        gain = (shared / spread.max(1e-6)).clamp(0.3, 1.8);
        level = std::array::from_fn(|k| mean_seen[k] - gain * mean_drawn[k]);
        for ((d, s), off) in drawn.iter().zip(seen).zip(&mut off) {
            let apart: [f64; 3] = std::array::from_fn(|k| s[k] - gain * d[k] - level[k]);
            *off = dot(apart, apart).sqrt();
        }
        let scale = (1.5 * median(&off)).max(0.03);
        for (weight, off) in weight.iter_mut().zip(&off) {
            *weight = 1.0 / (1.0 + (off / scale) * (off / scale));
        }
    }
    (gain, level)
}

/// The middle value, or the mean of the two in the middle.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    let (below, &mut upper, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    match values.len() % 2 {
        1 => upper,
        _ => 0.5 * (upper + below.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_is_found_in_spite_of_a_fifth_of_strangers() {
        let background: Vec<f64> = (0..500).map(|k| (k * 37 % 100) as f64 / 100.0).collect();
        let radius2: Vec<f64> = (0..500).map(|k| (k * 53 % 97) as f64 / 97.0).collect();
        let seen: Vec<f64> = background
            .iter()
            .zip(&radius2)
            .enumerate()
            .map(|(k, (p, r))| match k % 5 {
                0 => 0.9,
                _ => p * (1.1 - 0.2 * r) + 0.03,
            })
            .collect();
        let found = exposure(&background, &radius2, &seen, 6);
        for (found, wanted) in found.iter().zip([1.1, -0.2, 0.03]) {
            assert!((found - wanted).abs() < 0.01, "{found} {wanted}");
        }
    }

    #[test]
    fn patches_are_averaged() {
        let live: Vec<u8> = (0..48).map(|k| (k / 3) as u8).collect();
        let means = patch_means(&[[1, 1]], 2, |row, column| &live[3 * (4 * row + column)..]);
        assert!((means[0] * 255.0 - 7.5).abs() < 1e-4);
    }
}
