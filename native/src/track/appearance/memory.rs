//! The appearance memory: an earlier live picture of an object replaces colours of its rendering.
//! The NumPy reference is `tracking/evidence/appearance_memory.py`.

use crate::camera::lens::Lens;
use crate::track::contour::{lifted, Drawn};
use crate::track::picture::Picture;
use crate::track::rigid::{dot, in_frame, Rigid};

/// A live picture of an object, its depth, and the pose of the camera that took it.
pub struct AppearanceMemory<'a, L: Lens> {
    /// RGB, 0..1, and the probability that a pixel shows the object.
    pub shown: Picture<'a, 4>,
    /// Distance from that camera to the object, m, as rendered at the pose then estimated.
    pub depth: Picture<'a, 1>,
    pub lens: &'a L,
    /// From the axes of the rendering's camera to those of the memory's.
    pub there_from_here: Rigid,
    /// Points farther than the memory's distance by more than this, m, belong to another side.
    pub slack: f64,
    /// Blend weight of the memory, 0..1.
    pub weight: f32,
}

/// Colours of the rendering, RGB times alpha, blended with those that the memory has for the same
/// points.
///
/// Pixels with alpha up to `least_alpha` keep their colours.
#[inline(always)]
pub fn laid_on<D: Lens, P: Lens>(
    drawn: &Drawn<'_>,
    lens: &D,
    memory: &AppearanceMemory<'_, P>,
    least_alpha: f32,
) -> Vec<f32> {
    let width = drawn.alpha.width;
    let mut colours = drawn.rgb.values.to_vec();
    for (place, (to, &alpha)) in colours
        .as_chunks_mut::<3>()
        .0
        .iter_mut()
        .zip(drawn.alpha.values)
        .enumerate()
    {
        if alpha <= least_alpha {
            continue;
        }
        let pixel = [(place % width) as f64 + 0.5, (place / width) as f64 + 0.5];
        let point = lifted(lens, pixel, f64::from(drawn.depth[place]));
        let there = in_frame(&memory.there_from_here, point);
        let projected = memory.lens.project(there);
        let seen_at = [projected.u, projected.v];
        let [range] = memory.depth.sample(seen_at);
        if dot(there, there).sqrt() >= f64::from(range) + memory.slack {
            continue;
        }
        let [red, green, blue, sure] = memory.shown.sample(seen_at);
        let share = memory.weight * sure;
        for (to, seen) in to.iter_mut().zip([red, green, blue]) {
            *to += share * (alpha * seen - *to);
        }
    }
    colours
}
