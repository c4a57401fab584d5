//! SSIM's Gaussian window of 11 pixels, σ = 1.5, over rows and columns of planes; zero beyond them.

/// Pixels across the window.
const TAPS: usize = 11;
/// Pixels from its centre to its border.
pub const REACH: usize = TAPS / 2;
/// Centre first, then outwards: exp(-k² / (2·1.5²)), normalised to a sum of 1 over all taps.
pub const WINDOW: [f32; REACH + 1] = [
    0.266_011_72,
    0.213_005_54,
    0.109_360_69,
    0.036_000_773,
    0.007_598_758,
    0.001_028_380_1,
];

/// `out[x]` = window over `padded[x..x + TAPS]`.
#[inline(always)]
pub fn blur_row(padded: &[f32], out: &mut [f32]) {
    let width = out.len();
    let taps: [&[f32]; TAPS] = std::array::from_fn(|k| &padded[k..k + width]);
    blur(&taps, out);
}

/// The window over rows around `row` of planes of `height` rows, stacked.
#[inline(always)]
pub fn blur_column(planes: &[f32], row: usize, height: usize, nothing: &[f32], out: &mut [f32]) {
    let width = out.len();
    let y = row % height;
    let taps: [&[f32]; TAPS] = std::array::from_fn(|k| {
        if y + k < REACH || y + k >= height + REACH {
            nothing
        } else {
            &planes[(row + k - REACH) * width..][..width]
        }
    });
    blur(&taps, out);
}

#[inline(always)]
fn blur(taps: &[&[f32]; TAPS], out: &mut [f32]) {
    let width = out.len();
    let [a, b, c, d, e, f, g, h, i, j, k] = taps.map(|tap| &tap[..width]);
    for x in 0..width {
        out[x] = WINDOW[0] * f[x]
            + WINDOW[1] * (e[x] + g[x])
            + WINDOW[2] * (d[x] + h[x])
            + WINDOW[3] * (c[x] + i[x])
            + WINDOW[4] * (b[x] + j[x])
            + WINDOW[5] * (a[x] + k[x]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_sums_to_one() {
        let sum = WINDOW[0] + 2.0 * WINDOW[1..].iter().sum::<f32>();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }
}
