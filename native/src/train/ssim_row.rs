//! SSIM of one row from windowed values, and its slopes.
//!
//! As Wang et al. 2004 define it: a Gaussian window of 11 pixels, σ = 1.5, zero beyond the border.

use crate::train::ssim_window::REACH;

/// What keeps SSIM's quotients finite, for colours 0..1 (Wang et al. 2004).
const C1: f32 = 0.01 * 0.01;
const C2: f32 = 0.03 * 0.03;

/// One row of everything between two blurs.
pub struct RowScratch {
    pub values: [Vec<f32>; 3],
    pub padded: [Vec<f32>; 3],
    pub similarity: Vec<f32>,
    pub nothing: Vec<f32>,
    pub ones: Vec<f32>,
}

impl RowScratch {
    pub fn new(width: usize) -> RowScratch {
        RowScratch {
            values: std::array::from_fn(|_| vec![0.0; width]),
            padded: std::array::from_fn(|_| vec![0.0; width + 2 * REACH]),
            similarity: vec![0.0; width],
            nothing: vec![0.0; width],
            ones: vec![1.0; width],
        }
    }

    /// SSIM = (2μν + C1)(2σ_xy + C2) / ((μ² + ν² + C1)(σ_xx + σ_yy + C2)) of the windowed mean,
    /// square and product in `values`, and its derivatives by those three, into `padded`.
    #[inline(always)]
    pub fn slopes(&mut self, target_mean: &[f32], target_variance: &[f32]) {
        let [mean, square, product] = &self.values;
        let [d_mean, d_square, d_product] = &mut self.padded;
        let width = self.similarity.len();
        let similarity = &mut self.similarity[..width];
        let (mean, square, product) = (&mean[..width], &square[..width], &product[..width]);
        let (target_mean, target_variance) = (&target_mean[..width], &target_variance[..width]);
        let d_mean = &mut d_mean[REACH..REACH + width];
        let d_square = &mut d_square[REACH..REACH + width];
        let d_product = &mut d_product[REACH..REACH + width];
        for x in 0..width {
            let (mu, nu) = (mean[x], target_mean[x]);
            let variance = square[x] - mu * mu;
            let covariance = product[x] - mu * nu;
            let light_top = 2.0 * mu * nu + C1;
            let shape_top = 2.0 * covariance + C2;
            let light_under = 1.0 / (mu * mu + nu * nu + C1);
            let shape_under = 1.0 / (variance + target_variance[x] + C2);
            let light = light_top * light_under;
            let shape = shape_top * shape_under;
            let by_variance = -light * shape * shape_under;
            let by_covariance = 2.0 * light * shape_under;
            let by_mean = 2.0 * (nu - mu * light) * light_under * shape;
            similarity[x] = light * shape;
            d_mean[x] = by_mean - 2.0 * mu * by_variance - nu * by_covariance;
            d_square[x] = by_variance;
            d_product[x] = by_covariance;
        }
    }
}

/// Σ a · b in sixteen partial sums, so that the compiler can vectorise it.
#[inline(always)]
pub fn dot(a: &[f32], b: &[f32]) -> f32 {
    const PARTS: usize = 16;
    let mut parts = [0.0f32; PARTS];
    let (a, b) = (a.chunks_exact(PARTS), b.chunks_exact(PARTS));
    let rest: f32 = a
        .remainder()
        .iter()
        .zip(b.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a.zip(b) {
        for k in 0..PARTS {
            parts[k] += a[k] * b[k];
        }
    }
    parts.iter().sum::<f32>() + rest
}
