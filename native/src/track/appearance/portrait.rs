//! How an object was seen lately, laid over what is drawn of it. `tracking/portrait.py` says the same.

use crate::camera::lens::Lens;
use crate::track::contour::{lifted, Drawn};
use crate::track::picture::Picture;
use crate::track::rigid::{dot, in_frame, Rigid};

/// A live picture of an object, and from where it was taken.
pub struct Portrait<'a, L: Lens> {
    /// Colours, and how surely they are the object's.
    pub shown: Picture<'a, 4>,
    /// Range of the object drawn there.
    pub depth: Picture<'a, 1>,
    pub lens: &'a L,
    /// From the camera of the drawing to that of the portrait.
    pub there_from_here: Rigid,
    /// What lies so much deeper is another side.
    pub slack: f64,
    /// How much the portrait counts, 0..1.
    pub worth: f32,
}

/// The drawing's colours where the portrait, in front of whose camera they lie, knows better.
#[inline(always)]
pub fn laid_on<D: Lens, P: Lens>(
    drawn: &Drawn<'_>,
    lens: &D,
    portrait: &Portrait<'_, P>,
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
        let there = in_frame(&portrait.there_from_here, point);
        let projected = portrait.lens.project(there);
        let seen_at = [projected.u, projected.v];
        let [range] = portrait.depth.sample(seen_at);
        if dot(there, there).sqrt() >= f64::from(range) + portrait.slack {
            continue;
        }
        let [red, green, blue, sure] = portrait.shown.sample(seen_at);
        let share = portrait.worth * sure;
        for (to, seen) in to.iter_mut().zip([red, green, blue]) {
            *to += share * (alpha * seen - *to);
        }
    }
    colours
}
