//! What a window of a lens picture shows that the empty room does not.
//! `tracking.solve.numpy_twin.change` says the same in numpy.

use std::ops::Range;

use crate::track::background::expected::{
    expected, lay, Cut, Expected, Exposure, Layer, Planes, Window,
};
use crate::track::exponential::{exp, ln};
use crate::track::picture::{filtered, gaussian, slopes};

/// Bins per channel of a colour table.
pub const BINS: usize = 24;

/// Constants of `tracking.background` and `tracking.evidence`.
#[derive(Clone, Copy)]
pub struct ChangeModel {
    pub neighbour_noise: f32,
    pub likeness_gain: f32,
    pub shadow_darkest: [f32; 2],
    pub shadow_gone: [f32; 2],
    pub shadow_discount: f32,
    pub shadow_hue: f32,
}

/// Rows of a window that are processed together: so few stay in the processor's cache.
const STRIP: usize = 48;

/// Rows above and below that count too: filters, one after the other, reach over so many.
const BESIDE: usize = 5;

/// Calls `process` with strips of a window, the rows beside them included, and with the rows of those
/// that the strip is about.
#[inline(always)]
fn for_every_strip(
    cut: &Cut<'_>,
    window: &Window,
    mut process: impl FnMut(&Cut<'_>, &Window, Range<usize>),
) {
    for first in (0..window.height).step_by(STRIP) {
        let last = (first + STRIP).min(window.height);
        let (top, bottom) = (
            first.saturating_sub(BESIDE),
            (last + BESIDE).min(window.height),
        );
        let lines = top * window.shrink..bottom * window.shrink;
        let part = Cut {
            live: cut.live[lines.clone()].to_vec(),
            background: cut.background[lines.clone()].to_vec(),
            noise: cut.noise[lines].to_vec(),
        };
        let strip = Window {
            top: window.top + top * window.shrink,
            height: bottom - top,
            ..*window
        };
        process(&part, &strip, first - top..last - top);
    }
}

/// Appends a part of a picture pixel by pixel.
#[inline(always)]
fn mix([red, green, blue]: &Planes, part: Range<usize>, to: &mut Vec<f32>) {
    let begin = to.len();
    to.resize(begin + 3 * part.len(), 0.0);
    let green_and_blue = green[part.clone()].iter().zip(&blue[part.clone()]);
    let colours = red[part].iter().zip(green_and_blue);
    for (to, (&red, (&green, &blue))) in to[begin..].chunks_exact_mut(3).zip(colours) {
        to.copy_from_slice(&[red, green, blue]);
    }
}

/// What a window shows; every picture has the window's size.
pub struct Change {
    pub live: Vec<f32>,
    pub foreground: Vec<f32>,
    pub own: Vec<f32>,
    pub hidden: Vec<f32>,
}

/// Live picture, foreground, own colours and what is hidden, of one window.
#[inline(always)]
pub fn change(
    cut: &Cut<'_>,
    window: &Window,
    exposure: &Exposure,
    layers: &[Layer<'_>],
    table: &[f32],
    model: &ChangeModel,
) -> Change {
    let count = window.width * window.height;
    let mut change = Change {
        live: Vec::with_capacity(3 * count),
        foreground: Vec::with_capacity(count),
        own: Vec::with_capacity(count),
        hidden: Vec::with_capacity(count),
    };
    for_every_strip(
        cut,
        window,
        #[inline(always)]
        |cut, strip, rows| {
            let here = rows.start * window.width..rows.end * window.width;
            let size = [strip.width, strip.height];
            let mut seen = expected(cut, strip, exposure);
            for layer in layers {
                lay(&mut seen, layer, strip, exposure, model.neighbour_noise);
            }
            let foreground = foreground(&seen, size, model);
            let own = own(&seen.live, &foreground, size, table, model);
            mix(&seen.live, here.clone(), &mut change.live);
            change
                .foreground
                .extend_from_slice(&foreground[here.clone()]);
            change.own.extend_from_slice(&own[here.clone()]);
            change.hidden.extend_from_slice(&seen.hidden[here]);
        },
    );
    change
}

/// Foreground of the object's colours.
#[inline(always)]
fn own(
    [red, green, blue]: &Planes,
    foreground: &[f32],
    size: [usize; 2],
    table: &[f32],
    model: &ChangeModel,
) -> Vec<f32> {
    let mut colour_score = vec![0.0; foreground.len()];
    let colours = red.iter().zip(green).zip(blue);
    for (colour_score, ((&red, &green), &blue)) in colour_score.iter_mut().zip(colours) {
        *colour_score = table[bin(red) * BINS * BINS + bin(green) * BINS + bin(blue)];
    }
    let mut own = filtered(&colour_score, size, 1, &gaussian::<3>(0.7));
    for (own, foreground) in own.iter_mut().zip(foreground) {
        *own = foreground * (*own * model.likeness_gain).clamp(0.0, 1.0);
    }
    own
}

#[inline(always)]
fn bin(value: f32) -> usize {
    ((value * BINS as f32) as usize).min(BINS - 1)
}

/// Probability that a pixel shows something that is not expected.
#[inline(always)]
fn foreground(seen: &Expected, size: [usize; 2], model: &ChangeModel) -> Vec<f32> {
    let kernel: [f32; 3] = gaussian(0.8);
    let apart = [apart(seen, 0), apart(seen, 1), apart(seen, 2)];
    let [red, green, blue] = smoothed(&apart, size, &kernel);
    let shadow = shadow(seen, size, model);
    let apart = red.iter().zip(&green).zip(&blue);
    apart
        .zip(&seen.noise)
        .zip(&shadow)
        .map(|((((r, g), b), noise), shadow)| {
            let distance2 = (r * r + g * g + b * b) / (noise * noise);
            let weighed = distance2 * (1.0 - model.shadow_discount * shadow);
            1.0 - exp(-weighed / 18.0)
        })
        .collect()
}

/// How far a channel is from what is expected.
#[inline(always)]
fn apart(seen: &Expected, channel: usize) -> Vec<f32> {
    let mut apart = seen.live[channel].clone();
    for (apart, room) in apart.iter_mut().zip(&seen.room[channel]) {
        *apart -= room;
    }
    apart
}

/// Every channel filtered. Spelt out: what `map` calls would not be compiled for wider registers.
#[inline(always)]
fn smoothed<const TAPS: usize>(planes: &Planes, size: [usize; 2], kernel: &[f32; TAPS]) -> Planes {
    [
        filtered(&planes[0], size, 1, kernel),
        filtered(&planes[1], size, 1, kernel),
        filtered(&planes[2], size, 1, kernel),
    ]
}

/// Likelihood that a pixel shows the expected surface in other light.
#[inline(always)]
fn shadow(seen: &Expected, size: [usize; 2], model: &ChangeModel) -> Vec<f32> {
    let kernel: [f32; 7] = gaussian(1.2);
    let (live, room) = (
        smoothed(&seen.live, size, &kernel),
        smoothed(&seen.room, size, &kernel),
    );
    let [darker, dark] = model.shadow_darkest;
    let [light, lighter] = model.shadow_gone;
    let count = seen.noise.len();
    let [mut detail, mut likely] = [vec![0.0; count], vec![0.0; count]];
    let [live, room] = [&live, &room].map(|planes| planes.each_ref().map(|plane| &plane[..count]));
    let to = detail.iter_mut().zip(&mut likely).zip(&seen.noise);
    for (place, ((detail, likely), noise)) in to.enumerate() {
        let l = [live[0][place], live[1][place], live[2][place]];
        let e = [room[0][place], room[1][place], room[2][place]];
        let power = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + 1e-4;
        let ratio = (l[0] * e[0] + l[1] * e[1] + l[2] * e[2]) / power;
        let hue = [
            l[0] - ratio * e[0],
            l[1] - ratio * e[1],
            l[2] - ratio * e[2],
        ];
        let sigma2 = model.shadow_hue * model.shadow_hue + 0.1 * noise * noise;
        let hue2 = (hue[0] * hue[0] + hue[1] * hue[1] + hue[2] * hue[2]) / sigma2;
        let plausible = ((ratio - darker) / (dark - darker)).clamp(0.0, 1.0)
            * ((lighter - ratio) / (lighter - light)).clamp(0.0, 1.0);
        *likely = plausible * exp(-0.5 * hue2);
        let third = 1.0 / 3.0;
        *detail =
            ln(((l[0] + l[1] + l[2]) * third).max(0.02) / ((e[0] + e[1] + e[2]) * third).max(0.02));
    }
    let [x, y] = slopes(&detail, size);
    let steep: Vec<f32> = x.iter().zip(&y).map(|(x, y)| x * x + y * y).collect();
    let steep = filtered(&steep, size, 1, &[1.0 / 3.0; 3]);
    for (likely, steep) in likely.iter_mut().zip(&steep) {
        *likely *= exp(-0.5 * steep / (0.05 * 0.05));
    }
    likely
}
