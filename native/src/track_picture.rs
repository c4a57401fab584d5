//! Small pictures the tracker looks at: sampling between pixels, and filters that repeat the border.

/// A picture of `CHANNELS` interleaved values per pixel.
#[derive(Clone, Copy)]
pub struct Picture<'a, const CHANNELS: usize> {
    pub values: &'a [f32],
    pub width: usize,
    pub height: usize,
}

impl<const CHANNELS: usize> Picture<'_, CHANNELS> {
    /// The values of one pixel.
    #[inline(always)]
    fn at(&self, column: usize, row: usize) -> &[f32; CHANNELS] {
        let start = (row * self.width + column) * CHANNELS;
        self.values[start..start + CHANNELS]
            .try_into()
            .expect("a pixel has its channels")
    }

    /// Bilinear values at a point; the first pixel's centre is (0.5, 0.5), the border is repeated.
    #[inline(always)]
    pub fn sample(&self, [x, y]: [f64; 2]) -> [f32; CHANNELS] {
        let (left, right, across) = neighbours(x, self.width);
        let (above, below, down) = neighbours(y, self.height);
        let [a, b] = [self.at(left, above), self.at(right, above)];
        let [c, d] = [self.at(left, below), self.at(right, below)];
        let mut values = [0.0; CHANNELS];
        for k in 0..CHANNELS {
            let upper = a[k] + across * (b[k] - a[k]);
            let lower = c[k] + across * (d[k] - c[k]);
            values[k] = upper + down * (lower - upper);
        }
        values
    }
}

/// The two pixels that a place lies between, and its share of the second.
#[inline(always)]
fn neighbours(place: f64, size: usize) -> (usize, usize, f32) {
    let place = (place - 0.5).max(0.0).min((size - 1) as f64);
    // A signed whole number: a machine has an instruction for that.
    let first = place as i32;
    let share = (place - f64::from(first)) as f32;
    let first = first as usize;
    (first, (first + 1).min(size - 1), share)
}

/// Weights of a Gaussian at whole steps from -reach to reach, which sum to 1.
pub fn gaussian(sigma: f32, reach: usize) -> Vec<f32> {
    let weight = |step: usize| {
        let offset = step as f32 - reach as f32;
        (-0.5 * offset * offset / (sigma * sigma)).exp()
    };
    let total: f32 = (0..=2 * reach).map(weight).sum();
    (0..=2 * reach).map(|step| weight(step) / total).collect()
}

/// Rows, then columns, of interleaved pixels weighed by `kernel`; the border is repeated.
pub fn filtered(values: &[f32], size: [usize; 2], channels: usize, kernel: &[f32]) -> Vec<f32> {
    let [width, height] = size;
    let (line, reach) = (width * channels, kernel.len() / 2);
    let mut across = vec![0.0; values.len()];
    let mut padded = vec![0.0; line + 2 * reach * channels];
    for (from, to) in values.chunks_exact(line).zip(across.chunks_exact_mut(line)) {
        padded[reach * channels..][..line].copy_from_slice(from);
        for step in 0..reach {
            padded[step * channels..][..channels].copy_from_slice(&from[..channels]);
            let end = (reach + width + step) * channels;
            padded[end..][..channels].copy_from_slice(&from[line - channels..]);
        }
        for (tap, &weight) in kernel.iter().enumerate() {
            add_scaled(to, &padded[tap * channels..][..line], weight);
        }
    }
    let mut down = vec![0.0; values.len()];
    for (row, to) in down.chunks_exact_mut(line).enumerate() {
        for (tap, &weight) in kernel.iter().enumerate() {
            let from = (row + tap).saturating_sub(reach).min(height - 1);
            add_scaled(to, &across[from * line..][..line], weight);
        }
    }
    down
}

#[inline(always)]
fn add_scaled(to: &mut [f32], from: &[f32], weight: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}

/// Derivatives per pixel along x and y, smoothed across (Sobel), of one channel.
pub fn slopes(values: &[f32], [width, height]: [usize; 2]) -> [Vec<f32>; 2] {
    let mut along = [vec![0.0; values.len()], vec![0.0; values.len()]];
    for row in 0..height {
        let line = |row: usize| &values[row * width..][..width];
        let above = line(row.saturating_sub(1));
        let (here, below) = (line(row), line((row + 1).min(height - 1)));
        for column in 0..width {
            let (left, right) = (column.saturating_sub(1), (column + 1).min(width - 1));
            let summed = |c: usize| above[c] + 2.0 * here[c] + below[c];
            let change = |c: usize| below[c] - above[c];
            let place = row * width + column;
            along[0][place] = 0.125 * (summed(right) - summed(left));
            along[1][place] = 0.125 * (change(left) + 2.0 * change(column) + change(right));
        }
    }
    along
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_between_pixels_and_repeat_the_border() {
        let values = [0.0, 1.0, 2.0, 3.0];
        let picture = Picture::<1> {
            values: &values,
            width: 2,
            height: 2,
        };
        assert_eq!(picture.sample([1.0, 1.0]), [1.5]);
        assert_eq!(picture.sample([0.5, 0.5]), [0.0]);
        assert_eq!(picture.sample([-7.0, 9.0]), [2.0]);
    }

    #[test]
    fn a_filter_keeps_a_plain_picture() {
        let plain = vec![0.25; 5 * 4 * 3];
        let kernel = gaussian(1.2, 3);
        for value in filtered(&plain, [5, 4], 3, &kernel) {
            assert!((value - 0.25).abs() < 1e-6);
        }
    }

    #[test]
    fn slopes_of_a_ramp_are_its_slope_away_from_the_border() {
        let ramp: Vec<f32> = (0..20).map(|i| (i % 5) as f32 * 0.5).collect();
        let [x, y] = slopes(&ramp, [5, 4]);
        assert_eq!((x[7], y[7]), (0.5, 0.0));
    }
}
