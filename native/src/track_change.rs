//! What a window of a lens picture shows that the empty room does not: `tracking.reference_change`
//! says the same in numpy.

use crate::track_picture::{filtered, gaussian, slopes};

/// Bins per channel of a colour table.
pub const BINS: usize = 24;

/// A window of a lens picture: its pixels are the means of `shrink` × `shrink` of the lens.
#[derive(Clone, Copy)]
pub struct Window {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
    pub shrink: usize,
    /// Width and height of the lens picture.
    pub lens: [usize; 2],
}

/// How a live picture follows from its plate: `plate · (gain + falloff · r²) + offset`.
#[derive(Clone, Copy)]
pub struct Exposure {
    pub gain: [f32; 3],
    pub falloff: [f32; 3],
    pub offset: [f32; 3],
}

/// What a window is cut from, at the lens's pixels.
#[derive(Clone, Copy)]
pub struct Cut<'a> {
    /// RGB.
    pub live: &'a [u8],
    /// RGB, 0..1: the empty room.
    pub plate: &'a [f32],
    /// Standard deviation of a channel.
    pub noise: &'a [f32],
}

/// Another object as it is drawn into a rectangle of the lens picture.
#[derive(Clone, Copy)]
pub struct Layer<'a> {
    pub left: isize,
    pub top: isize,
    pub width: usize,
    pub height: usize,
    /// RGB over black.
    pub rgb: &'a [f32],
    pub alpha: &'a [f32],
    /// Whether it hides what the window is about, 0 or 1.
    pub nearer: &'a [f32],
}

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

/// What a window shows; every picture has the window's size.
pub struct Change {
    pub live: Vec<f32>,
    pub foreground: Vec<f32>,
    pub own: Vec<f32>,
    pub hidden: Vec<f32>,
}

/// What the window's pixels are compared with.
struct Expected {
    live: Vec<f32>,
    room: Vec<f32>,
    noise: Vec<f32>,
    hidden: Vec<f32>,
}

/// Live picture, foreground, own colours and what is hidden, of one window.
pub fn change(
    cut: &Cut<'_>,
    window: &Window,
    exposure: &Exposure,
    layers: &[Layer<'_>],
    table: &[f32],
    model: &ChangeModel,
) -> Change {
    let size = [window.width, window.height];
    let mut seen = expected(cut, window, exposure);
    for layer in layers {
        lay(&mut seen, layer, window, exposure, model.neighbour_noise);
    }
    let foreground = foreground(&seen, size, model);
    let likeness: Vec<f32> = seen
        .live
        .chunks_exact(3)
        .map(|rgb| table[bin(rgb[0]) * BINS * BINS + bin(rgb[1]) * BINS + bin(rgb[2])])
        .collect();
    let likeness = filtered(&likeness, size, 1, &gaussian(0.7, 1));
    let own = foreground
        .iter()
        .zip(&likeness)
        .map(|(f, alike)| f * (alike * model.likeness_gain).clamp(0.0, 1.0))
        .collect();
    Change {
        live: seen.live,
        foreground,
        own,
        hidden: seen.hidden,
    }
}

#[inline(always)]
fn bin(value: f32) -> usize {
    ((value * BINS as f32) as usize).min(BINS - 1)
}

/// Live picture, room at its exposure and noise, averaged over the shrunk pixels.
fn expected(cut: &Cut<'_>, window: &Window, exposure: &Exposure) -> Expected {
    let pixels = window.width * window.height;
    let mut seen = Expected {
        live: vec![0.0; 3 * pixels],
        room: vec![0.0; 3 * pixels],
        noise: vec![0.0; pixels],
        hidden: vec![0.0; pixels],
    };
    let shrink = window.shrink;
    let line = window.width * shrink;
    for row in 0..window.height {
        let here = row * window.width..(row + 1) * window.width;
        let wide = 3 * here.start..3 * here.end;
        for y in row * shrink..(row + 1) * shrink {
            let from = y * line..(y + 1) * line;
            let from3 = 3 * from.start..3 * from.end;
            add_shrunk(
                &mut seen.live[wide.clone()],
                &cut.live[from3.clone()],
                shrink,
            );
            add_shrunk(&mut seen.room[wide.clone()], &cut.plate[from3], shrink);
            for (to, part) in seen.noise[here.clone()]
                .iter_mut()
                .zip(cut.noise[from].chunks_exact(shrink))
            {
                *to += part.iter().sum::<f32>();
            }
        }
    }
    let share = 1.0 / (shrink * shrink) as f32;
    seen.live
        .iter_mut()
        .for_each(|v| *v *= share * (1.0 / 255.0));
    seen.noise
        .iter_mut()
        .for_each(|v| *v = (*v * share).max(1e-3));
    let [across, down] = window.lens.map(|side| 2.0 / side as f32);
    let middle = |first: usize, k: usize| first as f32 + (k as f32 + 0.5) * shrink as f32;
    for (row, room) in seen.room.chunks_exact_mut(3 * window.width).enumerate() {
        let y = middle(window.top, row) * down - 1.0;
        for (column, rgb) in room.chunks_exact_mut(3).enumerate() {
            let x = middle(window.left, column) * across - 1.0;
            let radius2 = x * x + y * y;
            for (channel, value) in rgb.iter_mut().enumerate() {
                let gain = exposure.gain[channel] + radius2 * exposure.falloff[channel];
                *value = *value * share * gain + exposure.offset[channel];
            }
        }
    }
    seen
}

/// Adds RGB pixels to those that so many of them make one of.
#[inline(always)]
fn add_shrunk<T: Copy + Into<f32>>(to: &mut [f32], from: &[T], shrink: usize) {
    if shrink == 1 {
        for (to, &from) in to.iter_mut().zip(from) {
            *to += from.into();
        }
        return;
    }
    for (to, part) in to.chunks_exact_mut(3).zip(from.chunks_exact(3 * shrink)) {
        for rgb in part.chunks_exact(3) {
            for channel in 0..3 {
                to[channel] += rgb[channel].into();
            }
        }
    }
}

/// Draws another object into what is expected.
fn lay(
    seen: &mut Expected,
    layer: &Layer<'_>,
    window: &Window,
    exposure: &Exposure,
    neighbour_noise: f32,
) {
    let shrink = window.shrink as isize;
    let at = |x: isize, y: isize| {
        let inside = x >= 0 && y >= 0 && x < layer.width as isize && y < layer.height as isize;
        inside.then(|| y as usize * layer.width + x as usize)
    };
    let share = 1.0 / (shrink * shrink) as f32;
    let mut edge = vec![0.0f32; window.width * window.height];
    for row in 0..window.height {
        for column in 0..window.width {
            let left = window.left as isize + column as isize * shrink - layer.left;
            let top = window.top as isize + row as isize * shrink - layer.top;
            let (mut rgb, mut alpha, mut nearer) = ([0.0; 3], 0.0, 0.0);
            for y in top..top + shrink {
                for place in (left..left + shrink).filter_map(|x| at(x, y)) {
                    for (sum, value) in rgb.iter_mut().zip(&layer.rgb[3 * place..]) {
                        *sum += value;
                    }
                    alpha += layer.alpha[place];
                    nearer += layer.alpha[place] * layer.nearer[place];
                }
            }
            if alpha == 0.0 {
                continue;
            }
            let alpha = alpha * share;
            let place = row * window.width + column;
            let room = &mut seen.room[3 * place..3 * place + 3];
            for (channel, (room, drawn)) in room.iter_mut().zip(rgb).enumerate() {
                let lit = drawn * share * exposure.gain[channel];
                *room = *room * (1.0 - alpha) + lit + exposure.offset[channel] * alpha;
            }
            seen.hidden[place] = seen.hidden[place].max(nearer * share);
            for y in row.saturating_sub(1)..(row + 2).min(window.height) {
                for x in column.saturating_sub(1)..(column + 2).min(window.width) {
                    let widened = &mut edge[y * window.width + x];
                    *widened = widened.max(alpha);
                }
            }
        }
    }
    for (noise, alpha) in seen.noise.iter_mut().zip(&edge) {
        *noise = noise.max(neighbour_noise * alpha);
    }
}

/// Probability that a pixel shows something that is not expected.
fn foreground(seen: &Expected, size: [usize; 2], model: &ChangeModel) -> Vec<f32> {
    let apart: Vec<f32> = seen
        .live
        .iter()
        .zip(&seen.room)
        .map(|(live, room)| live - room)
        .collect();
    let apart = filtered(&apart, size, 3, &gaussian(0.8, 1));
    let shadow = shadow(seen, size, model);
    apart
        .chunks_exact(3)
        .zip(&seen.noise)
        .zip(&shadow)
        .map(|((d, noise), shadow)| {
            let distance2 = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / (noise * noise);
            let weighed = distance2 * (1.0 - model.shadow_discount * shadow);
            1.0 - exp(-weighed / 18.0)
        })
        .collect()
}

/// Likelihood that a pixel shows the expected surface in other light.
fn shadow(seen: &Expected, size: [usize; 2], model: &ChangeModel) -> Vec<f32> {
    let kernel = gaussian(1.2, 3);
    let live = filtered(&seen.live, size, 3, &kernel);
    let room = filtered(&seen.room, size, 3, &kernel);
    let [darker, dark] = model.shadow_darkest;
    let [light, lighter] = model.shadow_gone;
    let mut detail = vec![0.0; seen.noise.len()];
    let mut likely = vec![0.0; seen.noise.len()];
    for (place, (l, e)) in live.chunks_exact(3).zip(room.chunks_exact(3)).enumerate() {
        let power = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + 1e-4;
        let ratio = (l[0] * e[0] + l[1] * e[1] + l[2] * e[2]) / power;
        let hue: [f32; 3] = std::array::from_fn(|channel| l[channel] - ratio * e[channel]);
        let noise = seen.noise[place];
        let sigma2 = model.shadow_hue * model.shadow_hue + 0.1 * noise * noise;
        let hue2 = (hue[0] * hue[0] + hue[1] * hue[1] + hue[2] * hue[2]) / sigma2;
        let plausible = ((ratio - darker) / (dark - darker)).clamp(0.0, 1.0)
            * ((lighter - ratio) / (lighter - light)).clamp(0.0, 1.0);
        likely[place] = plausible * exp(-0.5 * hue2);
        let third = 1.0 / 3.0;
        detail[place] =
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

/// e^x for x <= 0 to 1e-5, without a branch, so that several are done at once.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    let power = (x * std::f32::consts::LOG2_E).max(-126.0);
    let shifted = power + 12_582_912.0;
    let part = power - (shifted - 12_582_912.0);
    let series = 1.0
        + part
            * (std::f32::consts::LN_2
                + part
                    * (0.240_226_5
                        + part * (0.055_504_1 + part * (0.009_618_1 + part * 0.001_333_4))));
    f32::from_bits(series.to_bits().wrapping_add(shifted.to_bits() << 23))
}

/// The natural logarithm of a positive number to 1e-5, without a branch.
#[inline(always)]
fn ln(x: f32) -> f32 {
    let bits = x.to_bits();
    // The mantissa is taken between 1/√2 and √2, where the series is short.
    let exponent = (bits.wrapping_sub(0x3f35_04f3) as i32) >> 23;
    let mantissa = f32::from_bits(bits.wrapping_sub((exponent << 23) as u32));
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s2 = s * s;
    let series = 2.0 * s * (1.0 + s2 * (1.0 / 3.0 + s2 * (0.2 + s2 * (1.0 / 7.0))));
    exponent as f32 * std::f32::consts::LN_2 + series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_and_logarithms_are_right_to_five_digits() {
        for k in 0..4000 {
            let x = k as f32 * 0.01;
            assert!((exp(-x) - (-x).exp()).abs() < 1e-5, "exp(-{x})");
            let x = 0.02 + x;
            assert!((ln(x) - x.ln()).abs() < 2e-5, "ln({x})");
        }
    }
}
