//! What a pixel looks like: by which of its neighbours are brighter and which are darker.
//!
//! A census (Zabih and Woodfill 1994) does not change with exposure. A neighbour that is as bright, but
//! for noise, is neither: on a plain surface two pixels differ by nothing, not by chance.

use rayon::prelude::*;

use crate::machine::simd::Simd;

/// Half the side of the window, px: of 5 × 5 pixels the 24 around the middle.
const REACH: usize = 2;
/// The same in half pixels: nearer to the photo's border there is no window, and all looks plain.
const BORDER: usize = 2 * REACH;
/// Pixels around the middle, each of which is brighter, darker or neither.
const AROUND: u32 = 24;
/// Brightness is counted in quarters of a grey level: a mean of four keeps its fraction.
const PER_LEVEL: f32 = 4.0;

/// Two bits a neighbour: brighter in the low half, darker in the high one.
pub type Census = u64;

/// The census of a photo at every half pixel, so that one that is looked up is off by a quarter at most.
pub struct HalfPixels {
    /// Half pixels in a row: one less than twice the photo's.
    pub width: usize,
    pub height: usize,
    /// Row by row.
    pub values: Vec<Census>,
}

impl HalfPixels {
    /// Of a photo of `width` by `height` grey levels, at least one of each; `noise` in grey levels.
    pub fn of(grey: &[u8], [width, height]: [usize; 2], noise: f32, simd: Simd) -> HalfPixels {
        let (fine, noise) = (between(grey, [width, height]), (noise * PER_LEVEL) as i16);
        let (columns, rows) = (2 * width - 1, 2 * height - 1);
        let mut values = vec![0; columns * rows];
        let is_whole = columns > 2 * BORDER && rows > 2 * BORDER;
        let inside = BORDER..if is_whole { rows - BORDER } else { BORDER };
        let out = values.par_chunks_mut(columns).enumerate();
        out.filter(|(row, _)| inside.contains(row))
            .for_each(|(row, out)| fill_row(&fine, row, noise, simd, out));
        HalfPixels {
            width: columns,
            height: rows,
            values,
        }
    }

    /// At half pixels from the middle of the first pixel.
    #[inline(always)]
    pub fn at(&self, column: usize, row: usize) -> Census {
        self.values[row * self.width + column]
    }
}

/// The census of a row of half pixels, but for those at its ends.
fn fill_row(fine: &[i16], row: usize, noise: i16, simd: Simd, out: &mut [Census]) {
    simd.run(
        #[inline(always)]
        || look_around(fine, row, noise, out),
    );
}

#[inline(always)]
fn look_around(fine: &[i16], row: usize, noise: i16, out: &mut [Census]) {
    let columns = out.len();
    let length = columns - 2 * BORDER;
    let middle = &fine[row * columns + BORDER..][..length];
    let (mut brighter, mut darker) = (vec![0u32; length], vec![0u32; length]);
    for down in 0..=BORDER {
        for across in 0..=BORDER {
            if down == REACH && across == REACH {
                continue;
            }
            let start = (row + 2 * down - BORDER) * columns + 2 * across;
            let beside = &fine[start..start + length];
            for k in 0..length {
                let more = beside[k] - middle[k];
                brighter[k] = brighter[k] << 1 | u32::from(more > noise);
                darker[k] = darker[k] << 1 | u32::from(more < -noise);
            }
        }
    }
    for (out, (brighter, darker)) in out[BORDER..].iter_mut().zip(brighter.iter().zip(&darker)) {
        *out = u64::from(*darker) << AROUND | u64::from(*brighter);
    }
}

/// By how many of 48 bits two pixels look unlike.
#[inline(always)]
pub fn unlike(one: Census, other: Census) -> u8 {
    (one ^ other).count_ones() as u8
}

/// A photo at every half pixel, in quarters of a grey level: means of the pixels around.
fn between(grey: &[u8], [width, height]: [usize; 2]) -> Vec<i16> {
    let (columns, rows) = (2 * width - 1, 2 * height - 1);
    let at = |column: usize, row: usize| i16::from(grey[row * width + column]);
    let mut fine = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        let (above, below) = (row / 2, row.div_ceil(2));
        for column in 0..columns {
            let (left, right) = (column / 2, column.div_ceil(2));
            let sum = at(left, above) + at(right, above) + at(left, below) + at(right, below);
            fine.push(sum);
        }
    }
    fine
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Brighter to the right by 10 a pixel, and a little downwards.
    fn slope(size: [usize; 2]) -> Vec<u8> {
        let pixels = (0..size[0] * size[1]).map(|k| (10 * (k % size[0]) + k / size[0]) as u8);
        pixels.collect()
    }

    #[test]
    fn neighbours_are_brighter_darker_or_as_bright() {
        let census = HalfPixels::of(&slope([9, 7]), [9, 7], 2.0, Simd::detect());
        assert_eq!((census.width, census.height), (17, 13));
        let middle = census.at(8, 6);
        // Two columns are brighter and two darker; the four above and below differ by 1 and 2.
        assert_eq!((middle & 0xFF_FFFF).count_ones(), 10);
        assert_eq!((middle >> AROUND).count_ones(), 10);
        assert_eq!(middle & (middle >> AROUND), 0);
    }

    #[test]
    fn exposure_changes_nothing_and_the_border_is_plain() {
        let (dark, size) = (slope([9, 7]), [9, 7]);
        let light: Vec<u8> = dark.iter().map(|v| v + 50).collect();
        let (one, other) = (
            HalfPixels::of(&dark, size, 2.0, Simd::SCALAR),
            HalfPixels::of(&light, size, 2.0, Simd::SCALAR),
        );
        assert_eq!(one.values, other.values);
        assert_eq!(one.at(3, 6), 0);
        assert_eq!(unlike(one.at(8, 6), 0), 20);
    }
}
