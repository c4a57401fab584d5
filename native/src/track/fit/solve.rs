//! Robust Gauss-Newton on an object's contour, texture and prior: `tracking.solve.numpy_twin` says
//! the same in numpy.

use crate::camera::lens::Lens;
use crate::track::fit::edges::{edge_at, Edge, EdgeModel, Path, Place, CHANNELS};
use crate::track::fit::light::{gain_and_level, median};
use crate::track::picture::Picture;
use crate::track::rigid::{
    cross, dot, in_frame, product, rotation_vector, times, transposed, turn, Rigid,
};

/// Shift (3), turn about the world's axes through the object's origin (3), silhouette bias, m.
pub const UNKNOWNS: usize = 7;

pub type Matrix = [[f64; UNKNOWNS]; UNKNOWNS];

/// Contour points in the object's frame.
#[derive(Clone, Copy)]
pub struct Outline<'a> {
    pub points: &'a [f64],
    pub normals: &'a [f64],
    pub inner: &'a [f64],
    pub outer: &'a [f64],
    pub colours: &'a [f32],
}

/// Surface points in the object's frame, their smoothed colours and the colours' slopes per pixel.
#[derive(Clone, Copy)]
pub struct Texture<'a> {
    pub points: &'a [f64],
    pub values: &'a [f32],
    pub slopes: &'a [f32],
}

/// The prior: mean, and standard deviations of the unknowns (m, rad, m).
#[derive(Clone, Copy)]
pub struct Prior {
    pub mean: Rigid,
    pub sigma: [f64; UNKNOWNS],
    /// How far the drawn silhouette reaches beyond the seen one, m.
    pub silhouette_bias: f64,
}

/// Constants of `tracking.kernels.options`, under their names there.
#[derive(Clone, Copy)]
pub struct SolveModel {
    pub edges: EdgeModel,
    pub low_pass_px: f64,
    pub contour_correlation: f64,
    pub texture_sigma: f64,
    pub texture_cutoff: f64,
    /// So many neighbouring texture points count as one.
    pub texture_correlation: f64,
    /// Pixels per radian over the distance of the object's centre give pixels per metre.
    pub focal: f64,
    pub is_round: bool,
}

/// Where a solve stands.
#[derive(Clone, Copy)]
pub struct Estimate {
    pub world_from_object: Rigid,
    /// How far the drawn silhouette reaches beyond the seen one, m.
    pub silhouette_bias: f64,
    pub information: Matrix,
}

/// One object in one window.
pub struct Problem<'a, L: Lens> {
    pub lens: &'a L,
    pub camera_from_world: Rigid,
    pub window: Picture<'a, CHANNELS>,
    /// The live colours, smoothed like the texture's values.
    pub smooth: Picture<'a, 3>,
    pub outline: Outline<'a>,
    pub texture: Option<Texture<'a>>,
    /// The object's centre in its own frame.
    pub centre: [f64; 3],
    pub prior: Prior,
    pub model: SolveModel,
}

/// Sums of a step: information and information · step.
struct Sums {
    information: Matrix,
    right: [f64; UNKNOWNS],
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, jacobian: &[f64; UNKNOWNS], residual: f64, weight: f64) {
        for (i, row) in self.information.iter_mut().enumerate() {
            let weighed = weight * jacobian[i];
            for (entry, other) in row.iter_mut().zip(jacobian) {
                *entry += weighed * other;
            }
            self.right[i] += weighed * residual;
        }
    }
}

impl<L: Lens> Problem<'_, L> {
    /// A few steps with edges looked for within `reach_px`.
    #[inline(always)]
    pub fn refine(&self, start: Estimate, reach_px: f64, steps: usize) -> Estimate {
        let mut at = start;
        let mut path = Path::default();
        for _ in 0..steps {
            let (mut step, information) = self.step(&at, reach_px, &mut path);
            if self.model.is_round {
                step[5] = 0.0;
            }
            at.information = information;
            at.silhouette_bias += step[6];
            let pose = &mut at.world_from_object;
            for (place, shift) in pose.translation.iter_mut().zip(&step) {
                *place += shift;
            }
            pose.rotation = product(&turn([step[3], step[4], step[5]]), &pose.rotation);
            let shift = step[..3].iter().fold(0.0, |m: f64, s| m.max(s.abs()));
            let turned = step[3..6].iter().fold(0.0, |m: f64, s| m.max(s.abs()));
            if shift < 2e-4 && turned < 5e-4 {
                break;
            }
        }
        at
    }

    /// What is seen at every contour point of a pose.
    #[inline(always)]
    pub fn edges(&self, at: &Rigid, silhouette_bias: f64, reach_px: f64) -> Vec<Edge> {
        let (offset_px, mut path) = (self.offset_px(at, silhouette_bias), Path::default());
        (0..self.outline.inner.len())
            .map(|k| self.edge(at, k, reach_px, offset_px, &mut path).0)
            .collect()
    }

    #[inline(always)]
    fn px_per_m(&self, at: &Rigid) -> f64 {
        let centre = in_frame(&self.camera_from_world, in_frame(at, self.centre));
        let depth = match self.lens.circle() {
            Some(_) => dot(centre, centre).sqrt(),
            None => centre[2],
        };
        self.model.focal / depth.max(0.1)
    }

    #[inline(always)]
    fn offset_px(&self, at: &Rigid, silhouette_bias: f64) -> f64 {
        self.model.low_pass_px + silhouette_bias * self.px_per_m(at)
    }

    /// The pixel of an object point and its derivative by the first six unknowns.
    #[inline(always)]
    fn projection(&self, at: &Rigid, point: [f64; 3]) -> ([f64; 2], [[f64; 6]; 2]) {
        let turned = times(&at.rotation, point);
        let mut in_world = turned;
        for (place, shift) in in_world.iter_mut().zip(&at.translation) {
            *place += shift;
        }
        let seen = self
            .lens
            .project(in_frame(&self.camera_from_world, in_world));
        let mut derivative = [[0.0; 6]; 2];
        for (row, to) in seen.jacobian.iter().zip(&mut derivative) {
            let mut by_world = [0.0; 3];
            for (part, from) in row.iter().zip(&self.camera_from_world.rotation) {
                for (sum, turned) in by_world.iter_mut().zip(from) {
                    *sum += part * turned;
                }
            }
            to[..3].copy_from_slice(&by_world);
            to[3..].copy_from_slice(&cross(turned, by_world));
        }
        ([seen.u, seen.v], derivative)
    }

    #[inline(always)]
    fn edge(
        &self,
        at: &Rigid,
        k: usize,
        reach_px: f64,
        offset_px: f64,
        path: &mut Path,
    ) -> (Edge, [f64; 6]) {
        let outline = &self.outline;
        let (pixel, by_pose) = self.projection(at, triple(outline.points, k));
        let normal = [outline.normals[2 * k], outline.normals[2 * k + 1]];
        let place = Place {
            pixel,
            normal,
            inner: outline.inner[k],
            outer: outline.outer[k],
            colour: triple(outline.colours, k),
        };
        let mut edge = edge_at(&self.window, &place, reach_px, &self.model.edges, path);
        edge.offset += offset_px;
        let mut along = [0.0; 6];
        for (i, along) in along.iter_mut().enumerate() {
            *along = normal[0] * by_pose[0][i] + normal[1] * by_pose[1][i];
        }
        (edge, along)
    }

    #[inline(always)]
    fn step(&self, at: &Estimate, reach_px: f64, path: &mut Path) -> ([f64; UNKNOWNS], Matrix) {
        let mut sums = self.known(at);
        let pose = &at.world_from_object;
        let px_per_m = self.px_per_m(pose);
        let offset_px = self.model.low_pass_px + at.silhouette_bias * px_per_m;
        // Tukey's cut-off shrinks with the reach, from half of it down to about 2.5 σ.
        let cutoff = (1.3 * reach_px).max(2.5);
        for k in 0..self.outline.inner.len() {
            let (edge, along) = self.edge(pose, k, reach_px, offset_px, path);
            if !edge.found || edge.covered || edge.foreign {
                continue;
            }
            let residual = edge.offset / edge.sigma;
            let weight = tukey(residual / cutoff) / self.model.contour_correlation;
            // A larger bias puts the drawn edge closer to the seen one.
            let mut jacobian = [-px_per_m / edge.sigma; UNKNOWNS];
            for (entry, along) in jacobian.iter_mut().zip(&along) {
                *entry = along / edge.sigma;
            }
            sums.add(&jacobian, residual, weight);
        }
        if let Some(texture) = &self.texture {
            self.add_texture(texture, pose, &mut sums);
        }
        let mut step = solved(&sums.information, &sums.right);
        let shift = step[..3].iter().fold(0.0, |m: f64, s| m.max(s.abs()));
        let turned = step[3..6].iter().fold(0.0, |m: f64, s| m.max(s.abs()));
        let longest = (shift / 0.15).max(turned / 0.35).max(1.0);
        step.iter_mut().for_each(|part| *part /= longest);
        (step, sums.information)
    }

    /// The prior's part of the sums.
    #[inline(always)]
    fn known(&self, at: &Estimate) -> Sums {
        let prior = &self.prior;
        let pose = &at.world_from_object;
        let turn = rotation_vector(&product(&prior.mean.rotation, &transposed(&pose.rotation)));
        let mut sums = Sums {
            information: [[0.0; UNKNOWNS]; UNKNOWNS],
            right: [0.0; UNKNOWNS],
        };
        for k in 0..UNKNOWNS {
            let apart = match k {
                0..3 => prior.mean.translation[k] - pose.translation[k],
                3..6 => turn[k - 3],
                _ => prior.silhouette_bias - at.silhouette_bias,
            };
            let information = 1.0 / (prior.sigma[k] * prior.sigma[k]);
            sums.information[k][k] = information;
            sums.right[k] = information * apart;
        }
        sums
    }

    #[inline(always)]
    fn add_texture(&self, texture: &Texture<'_>, pose: &Rigid, sums: &mut Sums) {
        let mut used = Vec::new();
        let (mut drawn, mut seen) = (Vec::new(), Vec::new());
        for k in 0..texture.points.len() / 3 {
            let (pixel, by_pose) = self.projection(pose, triple(texture.points, k));
            let window = self.window.sample(pixel);
            if window[4] * (1.0 - window[5]) > 0.25 {
                used.push((k, by_pose));
                drawn.push(triple(texture.values, k).map(f64::from));
                seen.push(self.smooth.sample(pixel).map(f64::from));
            }
        }
        if used.len() < 12 {
            return;
        }
        let (gain, level) = gain_and_level(&drawn, &seen);
        let apart: Vec<[f64; 3]> = drawn
            .iter()
            .zip(&seen)
            .map(|(d, s)| std::array::from_fn(|k| gain * d[k] + level[k] - s[k]))
            .collect();
        let sizes: Vec<f64> = apart.iter().flatten().map(|apart| apart.abs()).collect();
        // Light and blur that no gain explains: what matches badly counts for little.
        let sigma = self.model.texture_sigma.max(1.5 * median(&sizes));
        let share = 1.0 / (3.0 * self.model.texture_correlation);
        for (row, (k, by_pose)) in used.iter().enumerate() {
            for (channel, apart) in apart[row].iter().enumerate() {
                let slope = &texture.slopes[6 * k + 2 * channel..][..2];
                let (sx, sy) = (gain * f64::from(slope[0]), gain * f64::from(slope[1]));
                let residual = apart / sigma;
                let mut jacobian = [0.0; UNKNOWNS];
                for (i, entry) in jacobian[..6].iter_mut().enumerate() {
                    *entry = (sx * by_pose[0][i] + sy * by_pose[1][i]) / sigma;
                }
                sums.add(
                    &jacobian,
                    residual,
                    share * tukey(residual / self.model.texture_cutoff),
                );
            }
        }
    }
}

#[inline(always)]
fn tukey(relative: f64) -> f64 {
    let inside = (1.0 - relative * relative).max(0.0);
    inside * inside
}

/// x of a · x = b for a symmetric, positive a (Cholesky).
fn solved(a: &Matrix, b: &[f64; UNKNOWNS]) -> [f64; UNKNOWNS] {
    let mut lower = [[0.0; UNKNOWNS]; UNKNOWNS];
    let mut x = *b;
    for i in 0..UNKNOWNS {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let left = a[i][j] - dot;
            lower[i][j] = match i == j {
                true => (left + 1e-9).sqrt(),
                false => left / lower[j][j],
            };
        }
        let dot: f64 = (0..i).map(|k| lower[i][k] * x[k]).sum();
        x[i] = (x[i] - dot) / lower[i][i];
    }
    for i in (0..UNKNOWNS).rev() {
        let dot: f64 = (i + 1..UNKNOWNS).map(|k| lower[k][i] * x[k]).sum();
        x[i] = (x[i] - dot) / lower[i][i];
    }
    x
}

#[inline(always)]
pub(crate) fn triple<T: Copy>(values: &[T], k: usize) -> [T; 3] {
    [values[3 * k], values[3 * k + 1], values[3 * k + 2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solution_solves() {
        let mut a = [[0.0; UNKNOWNS]; UNKNOWNS];
        for (i, row) in a.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry = 1.0 / (1 + i + j) as f64 + f64::from(u8::from(i == j));
            }
        }
        let b = [1.0, -2.0, 3.0, 0.0, 0.5, 4.0, -1.0];
        let x = solved(&a, &b);
        for (row, wanted) in a.iter().zip(b) {
            let found: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((found - wanted).abs() < 1e-7);
        }
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), 2.5);
    }
}
