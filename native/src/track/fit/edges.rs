//! Where a live window puts the edges of an object's contour: `tracking.likelihood.edges` says the
//! same in numpy, and says why.

use crate::track::contour::along;
use crate::track::exponential::exp;
use crate::track::picture::Picture;

/// A pixel of a window: red, green, blue, foreground, own, hidden, and two that fill a register.
pub const CHANNELS: usize = 8;
/// Places of two of them.
const OWN: usize = 4;
const HIDDEN: usize = 5;

/// Constants of `tracking.kernels.options`, under their names there.
#[derive(Clone, Copy)]
pub struct EdgeModel {
    pub sample_step_px: f64,
    pub side_px: f64,
    pub least_step: f64,
    pub distance_penalty: f64,
    pub foreign: f64,
    pub light_range: [f32; 2],
    pub alike_sigma: f32,
    pub cut_px: f64,
    pub weak_reach_px: f64,
    pub weak_slope: f64,
    pub weak_sigma_px: f64,
    pub edge_sigma_px: f64,
    pub coarse_sigma_px: f64,
    pub faint_contrast: f64,
}

/// One contour point where the object is believed to be.
#[derive(Clone, Copy)]
pub struct Place {
    pub pixel: [f64; 2],
    pub normal: [f64; 2],
    pub inner: f64,
    pub outer: f64,
    pub colour: [f32; 3],
}

/// What was seen along one normal.
#[derive(Clone, Copy, Default)]
pub struct Edge {
    /// Outward distance from the place.
    pub offset: f64,
    pub sigma: f64,
    pub found: bool,
    pub foreign: bool,
    pub covered: bool,
}

/// What is along a normal, kept between contour points so that nothing is allocated for each.
#[derive(Default)]
pub struct Path {
    samples: Vec<[f32; CHANNELS]>,
    /// Red, green, blue, foreground and own of the samples, one after the other.
    planes: [Vec<f32>; OWN + 1],
    /// Own foreground of the object's colours, and foreground of others, of each sample.
    own: Vec<f64>,
    strange: Vec<f64>,
    /// Sums of those before each sample.
    own_before: Vec<f64>,
    strange_before: Vec<f64>,
    /// Contrast of an edge at each sample, and its score: contrast less the penalty of its distance.
    clear: Vec<f64>,
    value: Vec<f64>,
}

/// Looks for an edge within `reach_px` of a place.
#[inline(always)]
pub fn edge_at(
    window: &Picture<'_, CHANNELS>,
    place: &Place,
    reach_px: f64,
    model: &EdgeModel,
    path: &mut Path,
) -> Edge {
    let count = ((reach_px + model.side_px + model.sample_step_px) / model.sample_step_px).ceil();
    let count = count as isize;
    // Loops instead of iterators that fill: those would not be compiled for wider registers.
    path.samples
        .resize(2 * count as usize + 1, Default::default());
    for (k, sample) in path.samples.iter_mut().enumerate() {
        let distance = (k as i32 - count as i32) as f64 * model.sample_step_px;
        *sample = window.sample(along(place.pixel, place.normal, distance));
    }
    let (mut at, foreign, mut found) = coarse(place, reach_px, count, model, path);
    let mut is_weak = false;
    if reach_px <= model.weak_reach_px && !found && !foreign {
        let (steepest, slope) = steepest(reach_px, count, model, &path.samples);
        if slope > model.weak_slope {
            (at, is_weak, found) = (steepest, true, true);
        }
    }
    let (fine, contrast) = fine(window, place, at);
    let sharp = (contrast / model.faint_contrast - 0.5).clamp(0.0, 1.0);
    let sigma = match is_weak {
        true => model.weak_sigma_px,
        false => model.edge_sigma_px * sharp + model.coarse_sigma_px * (1.0 - sharp),
    };
    let within = window.sample(along(place.pixel, place.normal, -1.5));
    Edge {
        offset: sharp * fine + (1.0 - sharp) * at,
        sigma,
        found: found && !foreign,
        foreign,
        covered: within[HIDDEN] > 0.5,
    }
}

/// Signed distance of the clearest end of the object's own foreground; whether somebody is in the
/// way there; whether it is clear enough.
#[inline(always)]
fn coarse(
    place: &Place,
    reach_px: f64,
    count: isize,
    model: &EdgeModel,
    path: &mut Path,
) -> (f64, bool, bool) {
    let steps = path.samples.len();
    separate_foreground(&place.colour, model, path);
    for (sums, parts) in [
        (&mut path.own_before, &path.own),
        (&mut path.strange_before, &path.strange),
    ] {
        sums.resize(steps + 1, 0.0);
        let mut sum = 0.0;
        for (to, part) in sums[1..].iter_mut().zip(parts) {
            sum += part;
            *to = sum;
        }
    }
    let (own, strange) = (&path.own_before[..], &path.strange_before[..]);
    let side = ((model.side_px + model.sample_step_px) / model.sample_step_px) as usize;
    let wide = |width: f64| {
        let whole = (width.min(model.side_px) / model.sample_step_px).round_ties_even();
        (whole as usize).max(2)
    };
    let (inner, outer) = (wide(place.inner), wide(place.outer));
    let distance = |k: usize| (k as isize - count) as f64 * model.sample_step_px;
    let candidates = steps - 2 * side;
    path.clear.resize(candidates, 0.0);
    path.value.resize(candidates, 0.0);
    // Sample k stands for the interval around it: an edge "at" k splits it, hence the mean.
    let [here, next] = [side, side + 1].map(|first| &own[first..][..candidates]);
    let [before, after] = [side - inner, side + 1 + outer].map(|k| &own[k..][..candidates]);
    let to = path.clear[..candidates]
        .iter_mut()
        .zip(&mut path.value[..candidates]);
    let (wide_inner, wide_outer) = (inner as f64 + 0.5, outer as f64 + 0.5);
    let widest = reach_px.max(1.0);
    for (k, (clear, value)) in to.enumerate() {
        let middle = 0.5 * (here[k] + next[k]);
        let inside = (middle - before[k]) / wide_inner;
        let outside = (after[k] - middle) / wide_outer;
        let off = (k as i32 + side as i32 - count as i32) as f64 * model.sample_step_px / widest;
        *clear = inside - outside;
        *value = *clear - model.distance_penalty * off * off;
    }
    let (mut best, mut best_value) = (0, f64::NEG_INFINITY);
    for (k, &value) in path.value[..candidates].iter().enumerate() {
        if value > best_value {
            (best, best_value) = (k, value);
        }
    }
    let is_clear = path.clear[best] > model.least_step;
    let best = side + best;
    let at = distance(best);
    let strange_out = strange[best + 1 + outer] - strange[best + 1];
    let strange_in = strange[best] - strange[best - inner];
    // Someone behind the object shows outside its contour; someone in front cuts into it.
    let cuts_in = strange_out / outer as f64 > model.foreign && at < -model.cut_px;
    let foreign = cuts_in || strange_in / inner as f64 > model.foreign;
    (at, foreign, is_clear)
}

/// How much of each sample is the object's own, of its colour there, and how much is foreign.
#[inline(always)]
fn separate_foreground(drawn: &[f32; 3], model: &EdgeModel, path: &mut Path) {
    let steps = path.samples.len();
    for (channel, plane) in path.planes.iter_mut().enumerate() {
        plane.resize(steps, 0.0);
        for (value, sample) in plane.iter_mut().zip(&path.samples) {
            *value = sample[channel];
        }
    }
    path.own.resize(steps, 0.0);
    path.strange.resize(steps, 0.0);
    let [red, green, blue, foreground, own] = path.planes.each_ref().map(|plane| &plane[..steps]);
    let to = path.own[..steps].iter_mut().zip(&mut path.strange[..steps]);
    for (k, (to_own, strange)) in to.enumerate() {
        let palette = f64::from(own[k]);
        *to_own = palette * f64::from(colour_similarity([red[k], green[k], blue[k]], drawn, model));
        *strange = (f64::from(foreground[k]) - palette).max(0.0);
    }
}

/// 0..1: a seen colour is the drawn one in another light.
#[inline(always)]
fn colour_similarity(seen: [f32; 3], drawn: &[f32; 3], model: &EdgeModel) -> f32 {
    let power = drawn[0] * drawn[0] + drawn[1] * drawn[1] + drawn[2] * drawn[2] + 1e-4;
    let ratio = (seen[0] * drawn[0] + seen[1] * drawn[1] + seen[2] * drawn[2]) / power;
    let ratio = ratio.clamp(model.light_range[0], model.light_range[1]);
    let mut apart2 = 0.0;
    for channel in 0..3 {
        let apart = seen[channel] - ratio * drawn[channel];
        apart2 += apart * apart;
    }
    exp(-0.5 * apart2 / (model.alike_sigma * model.alike_sigma))
}

/// Where the live picture changes most along the normal, and how much.
#[inline(always)]
fn steepest(
    reach_px: f64,
    count: isize,
    model: &EdgeModel,
    samples: &[[f32; CHANNELS]],
) -> (f64, f64) {
    let apart = (1.0 / model.sample_step_px) as usize;
    let wanted = ((reach_px + 1.0) / model.sample_step_px).ceil() as isize;
    let (mut at, mut change, mut best) = (0.0, 0.0, f64::NEG_INFINITY);
    for step in -wanted + apart as isize..=wanted - apart as isize {
        let k = (step + count) as usize;
        let (before, after) = (&samples[k - apart], &samples[k + apart]);
        let mut sum = 0.0;
        for channel in 0..3 {
            let part = f64::from(after[channel] - before[channel]);
            sum += part * part;
        }
        let distance = step as f64 * model.sample_step_px;
        let off = distance / reach_px;
        let value = sum.sqrt() * (1.0 - 0.5 * off * off);
        if value > best {
            (at, change, best) = (distance, sum.sqrt(), value);
        }
    }
    (at, change)
}

/// Sub-pixel place of a step between two colours near `at`, and the contrast of the two.
#[inline(always)]
fn fine(window: &Picture<'_, CHANNELS>, place: &Place, at: f64) -> (f64, f64) {
    const TAPS: usize = 13;
    let half = (0.6 * place.inner.min(place.outer)).clamp(1.0, 2.5);
    let mut colours = [[0.0; CHANNELS]; TAPS];
    for (tap, colour) in colours.iter_mut().enumerate() {
        let relative = -1.5 + 0.25 * tap as f64;
        *colour = window.sample(along(place.pixel, place.normal, at + relative * half));
    }
    let (inside, outside) = (mean(&colours[..3]), mean(&colours[TAPS - 3..]));
    let mut step = [0.0; 3];
    for k in 0..3 {
        step[k] = inside[k] - outside[k];
    }
    let contrast2 = step.iter().map(|part| part * part).sum::<f64>();
    let share = |tap: usize| -> f64 {
        let along: f64 = (0..3)
            .map(|k| (f64::from(colours[tap][k]) - outside[k]) * step[k])
            .sum();
        (along / contrast2.max(1e-6)).clamp(0.0, 1.0)
    };
    let middle: f64 = (2..TAPS - 2).map(share).sum();
    let area = (middle + 0.5 * (share(1) + share(TAPS - 2))) * 0.25;
    (at + half * (area - 1.25), contrast2.sqrt())
}

/// The mean colour of a few samples.
#[inline(always)]
fn mean(samples: &[[f32; CHANNELS]]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for sample in samples {
        for k in 0..3 {
            sums[k] += f64::from(sample[k]);
        }
    }
    sums.map(|sum| sum / samples.len() as f64)
}
