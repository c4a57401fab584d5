//! The depth of every pixel that is likeliest together with its neighbours' (semi-global matching,
//! Hirschmüller 2008): along eight ways across the picture small changes of depth cost little, jumps
//! much, less where the picture has an edge.

use rayon::prelude::*;

use crate::machine::simd::Simd;
use crate::stereo::sweep::Costs;

/// Prices of neighbours at other depths, in the costs' unit.
#[derive(Clone, Copy)]
pub struct Prices {
    /// Of the next plane.
    pub small: u16,
    /// Of any other plane, where the picture is plain.
    pub jump: u16,
    /// Difference of grey levels at which a jump costs half.
    pub edge: u16,
    /// Share by which all other depths have to cost more than the best.
    pub margin: f32,
}

impl Prices {
    #[inline(always)]
    fn jump_over(&self, one: u8, other: u8) -> u16 {
        let (jump, edge) = (u32::from(self.jump), u32::from(self.edge));
        let price = jump * edge / (edge + u32::from(one.abs_diff(other)));
        (price as u16).max(self.small)
    }
}

/// More than any path costs.
const FAR: u16 = u16::MAX / 4;

/// Plane of every pixel, with a fraction; negative where none is clearly the best.
pub fn planes(costs: &Costs, grey: &[u8], prices: Prices, simd: Simd) -> Vec<f32> {
    let mut sums = vec![0; costs.values.len()];
    add_ways::<false>(costs, grey, prices, simd, &mut sums);
    add_ways::<true>(costs, grey, prices, simd, &mut sums);
    let mut found = vec![0.0; grey.len()];
    found
        .par_chunks_mut(costs.size[0])
        .zip(sums.par_chunks_mut(costs.size[0] * costs.planes))
        .for_each(|(out, sums)| fill_row(sums, costs.planes, prices.margin, simd, out));
    found
}

/// A path's costs at one pixel, with one more at each end, and the least of them.
#[derive(Clone)]
struct Path {
    padded: Vec<u16>,
    least: u16,
}

impl Path {
    fn new(planes: usize) -> Path {
        let mut padded = vec![0; planes + 2];
        (padded[0], padded[planes + 1]) = (FAR, FAR);
        Path { padded, least: 0 }
    }

    /// Goes one pixel on from `before`, and adds what it costs to `sum`.
    #[inline(always)]
    fn go_on(&mut self, before: &Path, cost: &[u8], [small, jump]: [u16; 2], sum: &mut [u16]) {
        let count = cost.len();
        let (here, next) = (&before.padded[1..=count], &before.padded[2..count + 2]);
        let last = &before.padded[..count];
        let out = &mut self.padded[1..=count];
        let jumped = before.least + jump;
        let mut least = FAR;
        for k in 0..count {
            let beside = last[k].min(next[k]) + small;
            let path = here[k].min(beside).min(jumped) - before.least + u16::from(cost[k]);
            out[k] = path;
            sum[k] += path;
            least = least.min(path);
        }
        self.least = least;
    }
}

/// Adds the four ways that come from the left and from above, or their opposites.
fn add_ways<const IS_BACK: bool>(
    costs: &Costs,
    grey: &[u8],
    prices: Prices,
    simd: Simd,
    sums: &mut [u16],
) {
    simd.run(
        #[inline(always)]
        || go_ways::<IS_BACK>(costs, grey, prices, sums),
    );
}

#[inline(always)]
fn go_ways<const IS_BACK: bool>(costs: &Costs, grey: &[u8], prices: Prices, sums: &mut [u16]) {
    let [width, height] = costs.size;
    let count = costs.planes;
    let start = Path::new(count);
    // Of each way from above: the row before, and this one.
    let mut above = vec![[start.clone(), start.clone(), start.clone()]; width];
    let mut here = above.clone();
    let mut beside = [start.clone(), start.clone()];
    let turned = |place: usize, size: usize| if IS_BACK { size - 1 - place } else { place };
    for row in 0..height {
        let y = turned(row, height);
        let y_before = turned(row.saturating_sub(1), height);
        for (column, paths) in here.iter_mut().enumerate() {
            let x = turned(column, width);
            let at = (y * width + x) * count;
            let sum = &mut sums[at..at + count];
            let cost = costs.of_pixel(x, y);
            let own = grey[y * width + x];
            let from = |row: usize, column: usize| {
                let jump = prices.jump_over(own, grey[row * width + turned(column, width)]);
                [prices.small, jump]
            };
            let [last, next] = &mut beside;
            let before = if column > 0 { &*last } else { &start };
            next.go_on(before, cost, from(y, column.saturating_sub(1)), sum);
            beside.swap(0, 1);
            for (way, path) in paths.iter_mut().enumerate() {
                let source = (column + way).checked_sub(1).filter(|c| *c < width);
                match source.filter(|_| row > 0) {
                    Some(c) => path.go_on(&above[c][way], cost, from(y_before, c), sum),
                    None => path.go_on(&start, cost, [prices.small, prices.jump], sum),
                }
            }
        }
        std::mem::swap(&mut above, &mut here);
    }
}

/// The best plane of each pixel of a row; takes sums out.
fn fill_row(sums: &mut [u16], planes: usize, margin: f32, simd: Simd, out: &mut [f32]) {
    simd.run(
        #[inline(always)]
        || {
            for (out, sum) in out.iter_mut().zip(sums.chunks_exact_mut(planes)) {
                *out = best_plane(sum, margin);
            }
        },
    );
}

/// The plane with the least sum, between its neighbours as a parabola has it.
#[inline(always)]
fn best_plane(sum: &mut [u16], margin: f32) -> f32 {
    let lowest = least(sum);
    let mut best = 0;
    while sum[best] != lowest {
        best += 1;
    }
    if best == 0 || best + 1 == sum.len() {
        return -1.0;
    }
    let [before, here, after] = [sum[best - 1], lowest, sum[best + 1]].map(f32::from);
    sum[best - 1..=best + 1].fill(u16::MAX);
    if f32::from(least(sum)) < here * (1.0 + margin) {
        return -1.0;
    }
    let bend = (before + after - 2.0 * here).max(1.0);
    best as f32 + (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
}

#[inline(always)]
fn least(sum: &[u16]) -> u16 {
    let mut least = u16::MAX;
    for cost in sum {
        least = least.min(*cost);
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRICES: Prices = Prices {
        small: 5,
        jump: 40,
        edge: 10,
        margin: 0.05,
    };

    /// Every pixel costs least at plane 4, but for one in the middle that says 12 a little louder.
    fn costs(size: [usize; 2], planes: usize) -> Costs {
        let mut values = vec![40; size[0] * size[1] * planes];
        for (pixel, of_pixel) in values.chunks_exact_mut(planes).enumerate() {
            let is_odd = pixel == size[0] * (size[1] / 2) + size[0] / 2;
            of_pixel[if is_odd { 12 } else { 4 }] = if is_odd { 15 } else { 20 };
        }
        Costs {
            values,
            planes,
            size,
        }
    }

    #[test]
    fn a_pixel_that_contradicts_all_its_neighbours_is_overruled() {
        let grey = vec![80; 9 * 7];
        for simd in Simd::available() {
            let found = planes(&costs([9, 7], 16), &grey, PRICES, simd);
            assert!(found.iter().all(|plane| *plane == 4.0), "{found:?}");
        }
    }

    #[test]
    fn what_costs_as_much_at_two_depths_has_none() {
        let mut two = costs([9, 7], 16);
        for of_pixel in two.values.chunks_exact_mut(16) {
            (of_pixel[4], of_pixel[12]) = (20, 20);
        }
        let grey = vec![80; 9 * 7];
        let found = planes(&two, &grey, PRICES, Simd::SCALAR);
        assert!(found.iter().all(|plane| *plane < 0.0));
    }
}
