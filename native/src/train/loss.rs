//! The distance of a drawn picture from a photo, L1 + D-SSIM, and its gradient.
//!
//! Everything works on rows of planes, one plane a channel, so that the compiler can vectorise.

use rayon::prelude::*;

use crate::machine::simd::Simd;
use crate::train::exposure::Exposure;
use crate::train::ssim_row::{dot, RowScratch};
use crate::train::ssim_window::{blur_column, blur_row, REACH};
use crate::train::target::{unit, Target, CHANNELS};

/// Rows that one task takes.
const ROWS_PER_TASK: usize = 8;

/// Mean over pixels and channels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Distance {
    pub l1: f64,
    /// 1 - SSIM.
    pub dssim: f64,
    pub d_gain: [f64; CHANNELS],
    pub d_bias: [f64; CHANNELS],
    pub d_falloff: [f64; 2],
}

/// Buffers and results, kept between pictures.
#[derive(Default)]
pub struct Loss {
    /// The picture as the photo would show it.
    seen: Vec<f32>,
    /// Windowed along rows: seen, seen², seen · photo; then what their gradients are.
    along: [Vec<f32>; 3],
    gradients: [Vec<f32>; 3],
    /// d loss / d(drawn colour), planes.
    pub d_colour: Vec<f32>,
    /// Sum over channels of drawn colour · its gradient.
    pub contribution: Vec<f32>,
    /// Mean over channels of |seen - photo|.
    pub error: Vec<f32>,
}

impl Loss {
    /// Distance of `rgb` (row-major pixels), (1 - share)·L1 + share·(1 - SSIM), and its gradients.
    /// The same to the bit for any number of threads.
    pub fn evaluate(
        &mut self,
        rgb: &[f32],
        target: &Target,
        exposure: &Exposure,
        ssim_share: f32,
        simd: Simd,
    ) -> Distance {
        let plane = target.width * target.height;
        self.resize(plane);
        self.blur_along(rgb, target, exposure, simd);
        let dssim = self.differentiate(target, simd);
        let sums = self.gather(target, exposure, ssim_share, simd);
        let count = (CHANNELS * plane) as f64;
        let mut distance = Distance {
            dssim: dssim / count,
            ..Distance::default()
        };
        for row in sums {
            distance.l1 += row.l1 / count;
            for channel in 0..CHANNELS {
                distance.d_gain[channel] += row.d_gain[channel];
                distance.d_bias[channel] += row.d_bias[channel];
            }
            for power in 0..2 {
                distance.d_falloff[power] += row.d_falloff[power];
            }
        }
        distance
    }

    fn resize(&mut self, plane: usize) {
        let all = [&mut self.seen, &mut self.d_colour];
        let three = self.along.iter_mut().chain(&mut self.gradients);
        for planes in all.into_iter().chain(three) {
            planes.resize(CHANNELS * plane, 0.0);
        }
        self.contribution.resize(plane, 0.0);
        self.error.resize(plane, 0.0);
    }

    /// Fills `seen` and what is windowed along its rows.
    fn blur_along(&mut self, rgb: &[f32], target: &Target, exposure: &Exposure, simd: Simd) {
        let (width, height) = (target.width, target.height);
        let [first, second, third] = &mut self.along;
        (
            self.seen.par_chunks_mut(width),
            first.par_chunks_mut(width),
            second.par_chunks_mut(width),
            third.par_chunks_mut(width),
            target.colour.par_chunks(width),
        )
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .enumerate()
            .for_each_init(
                || RowScratch::new(width),
                |scratch, (row, (seen, mean, square, product, photo))| {
                    let [padded, ..] = &mut scratch.padded;
                    let [squares, falloff, _] = &mut scratch.values;
                    let (channel, y) = (row / height, row % height);
                    let drawn = &rgb[CHANNELS * y * width..][..CHANNELS * width];
                    let (gain, bias) = (exposure.gain[channel], exposure.bias[channel]);
                    simd.run(
                        #[inline(always)]
                        || {
                            exposure.fill_row(y, height, squares, falloff);
                            let pixels = drawn.chunks_exact(CHANNELS);
                            for ((to, pixel), &fall) in seen.iter_mut().zip(pixels).zip(&*falloff) {
                                *to = gain * fall * pixel[channel] + bias;
                            }
                            padded[REACH..REACH + width].copy_from_slice(seen);
                            blur_row(padded, mean);
                            for (to, &value) in padded[REACH..].iter_mut().zip(&*seen) {
                                *to = value * value;
                            }
                            blur_row(padded, square);
                            for ((to, &value), &colour) in
                                padded[REACH..].iter_mut().zip(&*seen).zip(photo)
                            {
                                *to = value * unit(colour);
                            }
                            blur_row(padded, product);
                        },
                    );
                },
            );
    }

    /// From windowed values to the gradients of SSIM's sum with respect to them, windowed along
    /// rows again. Returns the sum of 1 - SSIM.
    fn differentiate(&mut self, target: &Target, simd: Simd) -> f64 {
        let (width, height) = (target.width, target.height);
        let along = &self.along;
        let [first, second, third] = &mut self.gradients;
        let sums: Vec<f64> = (
            first.par_chunks_mut(width),
            second.par_chunks_mut(width),
            third.par_chunks_mut(width),
            target.mean.par_chunks(width),
            target.variance.par_chunks(width),
        )
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .enumerate()
            .map_init(
                || RowScratch::new(width),
                |scratch, (row, (d_mean, d_square, d_product, target_mean, target_variance))| {
                    simd.run(
                        #[inline(always)]
                        || {
                            for (values, along) in scratch.values.iter_mut().zip(along) {
                                blur_column(along, row, height, &scratch.nothing, values);
                            }
                            scratch.slopes(target_mean, target_variance);
                            let [mean, square, product] = &scratch.padded;
                            blur_row(mean, d_mean);
                            blur_row(square, d_square);
                            blur_row(product, d_product);
                            width as f64 - f64::from(dot(&scratch.similarity, &scratch.ones))
                        },
                    )
                },
            )
            .collect();
        sums.iter().sum()
    }

    /// Fills `d_colour`, `contribution` and `error`; returns sums per row.
    fn gather(
        &mut self,
        target: &Target,
        exposure: &Exposure,
        ssim_share: f32,
        simd: Simd,
    ) -> Vec<Distance> {
        let (width, height) = (target.width, target.height);
        let plane = width * height;
        let per_value = 1.0 / (CHANNELS * plane) as f32;
        let (seen, gradients) = (&self.seen, &self.gradients);
        let (red, rest) = self.d_colour.split_at_mut(plane);
        let (green, blue) = rest.split_at_mut(plane);
        (
            red.par_chunks_mut(width),
            green.par_chunks_mut(width),
            blue.par_chunks_mut(width),
            self.contribution.par_chunks_mut(width),
            self.error.par_chunks_mut(width),
        )
            .into_par_iter()
            .with_min_len(ROWS_PER_TASK)
            .enumerate()
            .map_init(
                || RowScratch::new(width),
                |scratch, (y, (red, green, blue, contribution, error))| {
                    let mut sums = Distance::default();
                    contribution.fill(0.0);
                    error.fill(0.0);
                    for (channel, d_colour) in [red, green, blue].into_iter().enumerate() {
                        let row = channel * height + y;
                        let span = row * width..(row + 1) * width;
                        let (gain, bias) = (exposure.gain[channel], exposure.bias[channel]);
                        let by_l1 = per_value * (1.0 - ssim_share);
                        let by_ssim = per_value * ssim_share;
                        let per_gain = 1.0 / gain;
                        simd.run(
                            #[inline(always)]
                            || {
                                for (values, along) in scratch.values.iter_mut().zip(gradients) {
                                    blur_column(along, row, height, &scratch.nothing, values);
                                }
                                let [squares, falloff, slopes] = &mut scratch.padded;
                                let (squares, falloff) =
                                    (&mut squares[..width], &mut falloff[..width]);
                                let slopes = &mut slopes[..width];
                                exposure.fill_row(y, height, squares, falloff);
                                let [d_mean, d_square, d_product] = &scratch.values;
                                let photo = &target.colour[span.clone()];
                                let seen = &seen[span.clone()];
                                let (d_mean, d_square) = (&d_mean[..width], &d_square[..width]);
                                let d_product = &d_product[..width];
                                let (d_colour, contribution) =
                                    (&mut d_colour[..width], &mut contribution[..width]);
                                let error = &mut error[..width];
                                for x in 0..width {
                                    let colour = unit(photo[x]);
                                    let off = seen[x] - colour;
                                    let sign = f32::from(off > 0.0) - f32::from(off < 0.0);
                                    let of_ssim = d_mean[x]
                                        + 2.0 * seen[x] * d_square[x]
                                        + colour * d_product[x];
                                    let d_seen = by_l1 * sign - by_ssim * of_ssim;
                                    let slope = (seen[x] - bias) * d_seen;
                                    d_colour[x] = gain * falloff[x] * d_seen;
                                    contribution[x] += slope;
                                    error[x] += off.abs() * (1.0 / CHANNELS as f32);
                                    slopes[x] = slope;
                                    falloff[x] = d_seen;
                                }
                                sums.d_bias[channel] = f64::from(dot(falloff, &scratch.ones));
                                sums.d_gain[channel] =
                                    f64::from(dot(slopes, &scratch.ones) * per_gain);
                                exposure.fill_row(y, height, squares, falloff);
                                for (slope, (square, fall)) in
                                    slopes.iter_mut().zip(squares.iter().zip(&*falloff))
                                {
                                    *slope *= square / fall;
                                }
                                sums.d_falloff[0] += f64::from(dot(slopes, &scratch.ones));
                                sums.d_falloff[1] += f64::from(dot(slopes, squares));
                            },
                        );
                    }
                    let error = simd.run(
                        #[inline(always)]
                        || dot(error, &scratch.ones),
                    );
                    sums.l1 = f64::from(error) * CHANNELS as f64;
                    sums
                },
            )
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 23;
    const HEIGHT: usize = 17;
    const PLAIN: Exposure = Exposure {
        gain: [1.0; 3],
        bias: [0.0; 3],
        falloff: [0.0; 2],
    };

    fn noise(count: usize, seed: u64) -> Vec<u8> {
        let mut state = seed;
        (0..count)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 40) as u8
            })
            .collect()
    }

    fn as_drawn(photo: &[u8]) -> Vec<f32> {
        photo.iter().map(|&v| unit(v)).collect()
    }

    #[test]
    fn a_picture_is_not_far_from_itself() {
        let photo = noise(3 * WIDTH * HEIGHT, 1);
        let target = Target::new(&photo, WIDTH, HEIGHT, Simd::detect());
        let mut loss = Loss::default();
        let distance = loss.evaluate(&as_drawn(&photo), &target, &PLAIN, 0.2, Simd::detect());
        assert!(
            distance.l1 < 1e-7 && distance.dssim.abs() < 1e-5,
            "{distance:?}"
        );
        assert!(loss.error.iter().all(|&v| v < 1e-6));
    }

    #[test]
    fn gradients_agree_with_differences() {
        let count = 3 * WIDTH * HEIGHT;
        let target = Target::new(&noise(count, 1), WIDTH, HEIGHT, Simd::SCALAR);
        let exposure = Exposure {
            gain: [1.1, 0.9, 1.0],
            bias: [0.02, -0.01, 0.0],
            falloff: [-0.2, 0.05],
        };
        let drawn = as_drawn(&noise(count, 2));
        let mut loss = Loss::default();
        let value = |loss: &mut Loss, drawn: &[f32]| {
            let d = loss.evaluate(drawn, &target, &exposure, 0.2, Simd::SCALAR);
            0.8 * d.l1 + 0.2 * d.dssim
        };
        value(&mut loss, &drawn);
        let d_colour = loss.d_colour.clone();
        for place in [0, 7, 100, 300, count / 3 - 1] {
            for channel in 0..3 {
                let step = 2e-3;
                let mut moved = drawn.clone();
                moved[3 * place + channel] += step;
                let above = value(&mut loss, &moved);
                moved[3 * place + channel] -= 2.0 * step;
                let below = value(&mut loss, &moved);
                let wanted = (above - below) / f64::from(2.0 * step);
                let got = f64::from(d_colour[channel * WIDTH * HEIGHT + place]);
                assert!(
                    (got - wanted).abs() < 2e-5,
                    "{place} {channel}: {got} {wanted}"
                );
            }
        }
    }

    #[test]
    fn threads_and_instructions_change_nothing_that_matters() {
        let count = 3 * WIDTH * HEIGHT;
        let target = Target::new(&noise(count, 1), WIDTH, HEIGHT, Simd::SCALAR);
        let drawn = as_drawn(&noise(count, 2));
        let gradients = |simd, threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let mut loss = Loss::default();
            pool.unwrap()
                .install(|| loss.evaluate(&drawn, &target, &PLAIN, 0.2, simd));
            loss.d_colour
        };
        let plain = gradients(Simd::SCALAR, 1);
        assert_eq!(plain, gradients(Simd::SCALAR, 2));
        for simd in Simd::available() {
            for (a, b) in plain.iter().zip(gradients(simd, 2)) {
                assert!((a - b).abs() <= 1e-6, "{}: {a} {b}", simd.name());
            }
        }
    }
}
