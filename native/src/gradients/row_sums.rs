//! Sums per splat over a picture, from the sums that each row of tiles gave.

use std::ops::AddAssign;

use rayon::prelude::*;

/// `N` sums per (splat, tile) of one row of tiles, from left to right.
pub(crate) struct RowSums<const N: usize> {
    /// The splat of each entry, by its record.
    pub(crate) slots: Vec<u32>,
    pub(crate) sums: Vec<[f32; N]>,
}

impl<const N: usize> Default for RowSums<N> {
    fn default() -> Self {
        RowSums {
            slots: Vec::new(),
            sums: Vec::new(),
        }
    }
}

/// Adds up each splat's tiles, row by row and from left to right: the same to the bit for any number
/// of threads. `totals` has one entry per record.
pub(crate) fn add_rows<T, const N: usize>(rows: &[RowSums<N>], totals: &mut [[T; N]])
where
    T: AddAssign + From<f32> + Send,
{
    let share = totals.len().div_ceil(rayon::current_num_threads()).max(1);
    totals
        .par_chunks_mut(share)
        .enumerate()
        .for_each(|(index, totals)| {
            let first = index * share;
            for row in rows {
                for (&slot, sums) in row.slots.iter().zip(&row.sums) {
                    // A slot before `first` wraps around and is out of range too.
                    let place = (slot as usize).wrapping_sub(first);
                    if let Some(total) = totals.get_mut(place) {
                        for (total, &sum) in total.iter_mut().zip(sums) {
                            *total += T::from(sum);
                        }
                    }
                }
            }
        });
}
