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

/// Weights of a Gaussian at whole steps, the middle one at its top, which sum to 1.
pub fn gaussian<const TAPS: usize>(sigma: f32) -> [f32; TAPS] {
    let weights: [f32; TAPS] = std::array::from_fn(|step| {
        let offset = step as f32 - (TAPS / 2) as f32;
        (-0.5 * offset * offset / (sigma * sigma)).exp()
    });
    let total: f32 = weights.iter().sum();
    weights.map(|weight| weight / total)
}

/// Rows, then columns, of interleaved pixels weighed by `kernel`; the border is repeated.
#[inline(always)]
pub fn filtered<const TAPS: usize>(
    values: &[f32],
    [width, height]: [usize; 2],
    channels: usize,
    kernel: &[f32; TAPS],
) -> Vec<f32> {
    let (line, reach) = (width * channels, TAPS / 2);
    let mut padded = vec![0.0; line + 2 * reach * channels];
    // Only as many rows as a column's weights reach over are kept: they stay near the processor.
    let mut across = vec![0.0; TAPS * line];
    let mut ready = 0;
    let mut down = vec![0.0; values.len()];
    for (row, to) in down.chunks_exact_mut(line).enumerate() {
        while ready <= (row + reach).min(height - 1) {
            let from = &values[ready * line..][..line];
            padded[reach * channels..][..line].copy_from_slice(from);
            for step in 0..reach {
                padded[step * channels..][..channels].copy_from_slice(&from[..channels]);
                let end = (reach + width + step) * channels;
                padded[end..][..channels].copy_from_slice(&from[line - channels..]);
            }
            let taps = std::array::from_fn(|tap| &padded[tap * channels..][..line]);
            weigh(&mut across[ready % TAPS * line..][..line], taps, kernel);
            ready += 1;
        }
        let taps = std::array::from_fn(|tap| {
            let from = (row + tap).saturating_sub(reach).min(height - 1);
            &across[from % TAPS * line..][..line]
        });
        weigh(to, taps, kernel);
    }
    down
}

/// Sums of several lines, each times its weight.
#[inline(always)]
fn weigh<const TAPS: usize>(to: &mut [f32], from: [&[f32]; TAPS], weights: &[f32; TAPS]) {
    let from = from.map(|line| &line[..to.len()]);
    for (place, to) in to.iter_mut().enumerate() {
        let mut sum = 0.0;
        for tap in 0..TAPS {
            sum += weights[tap] * from[tap][place];
        }
        *to = sum;
    }
}

/// Derivatives per pixel along x and y, smoothed across (Sobel), of one channel.
#[inline(always)]
pub fn slopes(values: &[f32], [width, height]: [usize; 2]) -> [Vec<f32>; 2] {
    let [mut along_x, mut along_y] = [vec![0.0; values.len()], vec![0.0; values.len()]];
    // With the first and the last pixel twice, so that no pixel is a special case.
    let [mut summed, mut change] = [vec![0.0; width + 2], vec![0.0; width + 2]];
    let to = along_x
        .chunks_exact_mut(width)
        .zip(along_y.chunks_exact_mut(width));
    for (row, (along_x, along_y)) in to.enumerate() {
        let line = |row: usize| &values[row * width..][..width];
        let (above, here) = (line(row.saturating_sub(1)), line(row));
        let below = line((row + 1).min(height - 1));
        for column in 0..width {
            summed[column + 1] = above[column] + 2.0 * here[column] + below[column];
            change[column + 1] = below[column] - above[column];
        }
        for padded in [&mut summed, &mut change] {
            padded[0] = padded[1];
            padded[width + 1] = padded[width];
        }
        for (column, along) in along_x.iter_mut().enumerate() {
            *along = 0.125 * (summed[column + 2] - summed[column]);
        }
        for (column, along) in along_y.iter_mut().enumerate() {
            *along = 0.125 * (change[column] + 2.0 * change[column + 1] + change[column + 2]);
        }
    }
    [along_x, along_y]
}

/// Means over squares of `finer` pixels each way of interleaved values, `size` squares.
#[inline(always)]
pub fn shrunk<const CHANNELS: usize>(values: &[f32], size: [usize; 2], finer: usize) -> Vec<f32> {
    let [width, height] = size;
    let line = width * finer * CHANNELS;
    let mut summed = vec![0.0; line];
    let mut means = vec![0.0; width * height * CHANNELS];
    let share = 1.0 / (finer * finer) as f32;
    let to = means.chunks_exact_mut(width * CHANNELS);
    for (rows, to) in values.chunks_exact(line * finer).zip(to) {
        summed.copy_from_slice(&rows[..line]);
        for row in rows[line..].chunks_exact(line) {
            for (sum, value) in summed.iter_mut().zip(row) {
                *sum += value;
            }
        }
        let squares = summed.chunks_exact(finer * CHANNELS);
        for (square, to) in squares.zip(to.chunks_exact_mut(CHANNELS)) {
            let mut sums = [0.0; CHANNELS];
            for pixel in square.chunks_exact(CHANNELS) {
                for channel in 0..CHANNELS {
                    sums[channel] += pixel[channel];
                }
            }
            for (to, sum) in to.iter_mut().zip(sums) {
                *to = share * sum;
            }
        }
    }
    means
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
    fn squares_of_pixels_become_their_means() {
        let values: Vec<f32> = (0..16).map(|value| value as f32).collect();
        assert_eq!(shrunk::<1>(&values, [2, 2], 2), [2.5, 4.5, 10.5, 12.5]);
        assert_eq!(shrunk::<2>(&values, [2, 1], 2), [5.0, 6.0, 9.0, 10.0]);
        assert_eq!(shrunk::<1>(&values, [4, 4], 1), values);
    }

    #[test]
    fn a_filter_keeps_a_plain_picture() {
        let plain = vec![0.25; 5 * 4 * 3];
        let kernel: [f32; 7] = gaussian(1.2);
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
