//! Splats between two depths, sorted and listed for every row of tiles.
//!
//! A picture's splats are cut by depth into a few slabs, each of which is one task. Slabs follow one
//! another in depth, so that their lists, read one after the other, are in the order of all splats,
//! however many slabs there are.

use std::ops::Range;

use crate::order::bin::{Entry, RowLists};
use crate::order::sort;
use crate::order::sort::RadixSort;
use crate::project::record::Record;
use crate::project::tile_box::TileBox;
use crate::scene::cloud::CHUNK;

/// Fewer splats than this get no slab of their own.
const MIN_SPLATS: usize = 4096;
/// Slabs for each thread, to even out the load: those near the camera touch more tiles.
const PER_THREAD: usize = 2;

/// What one chunk's projection left: so many records at the start of its slots, of such depths.
#[derive(Clone, Copy, Debug, Default)]
pub struct Group {
    pub count: usize,
    /// Smallest and largest depth key.
    keys: [u32; 2],
}

impl Group {
    /// Of the depth keys of a chunk's records.
    #[inline(always)]
    pub fn new(keys: &[u32]) -> Group {
        let bounds = keys.iter().fold([u32::MAX, 0], |[low, high], &key| {
            [low.min(key), high.max(key)]
        });
        Group {
            count: keys.len(),
            keys: bounds,
        }
    }

    fn middle(&self) -> u32 {
        self.keys[0].midpoint(self.keys[1])
    }
}

/// What a picture's splats are, chunk by chunk in scene order.
#[derive(Clone, Copy)]
pub struct Projected<'a> {
    pub groups: &'a [Group],
    pub records: &'a [Record],
    pub keys: &'a [u32],
    pub boxes: &'a [TileBox],
}

/// Cuts the depths of all splats into ranges of keys with about as many splats each.
pub fn cut(groups: &[Group], threads: usize) -> Vec<Range<u32>> {
    let total: usize = groups.iter().map(|group| group.count).sum();
    let slabs = match threads {
        1 => 1,
        threads => (PER_THREAD * threads).min(total / MIN_SPLATS + 1),
    };
    let mut ends = Vec::with_capacity(slabs);
    if slabs > 1 {
        let mut middles: Vec<(u32, usize)> = groups
            .iter()
            .filter(|group| group.count > 0)
            .map(|group| (group.middle(), group.count))
            .collect();
        middles.sort_unstable();
        let mut before = 0;
        for (key, count) in middles {
            if before * slabs >= total * (ends.len() + 1) {
                ends.push(key);
            }
            before += count;
        }
    }
    // Depths are finite, so that no key is the largest number.
    ends.push(u32::MAX);
    let starts = std::iter::once(0).chain(ends.iter().copied());
    starts.zip(&ends).map(|(start, &end)| start..end).collect()
}

/// The splats of one range of depths; see the module.
#[derive(Default)]
pub struct Slab {
    /// Depth key in the high half, slot in the low half.
    pairs: Vec<u64>,
    radix: RadixSort,
    boxes: Vec<TileBox>,
    rows: RowLists,
}

impl Slab {
    /// Takes the splats in a range of depth keys and orders them by depth; ties by object, then by
    /// place in the cloud.
    #[inline(always)]
    pub fn sort(&mut self, range: &Range<u32>, splats: &Projected) {
        self.collect(range, splats);
        self.radix.sort_by_key(&mut self.pairs);
        sort::break_ties(&mut self.pairs, |slot| {
            let record = &splats.records[slot as usize];
            (record.object, record.index)
        });
    }

    /// Lists the sorted splats for every row of tiles.
    #[inline(always)]
    pub fn bin(&mut self, rows_of_tiles: usize, splats: &Projected) {
        let slots = self.pairs.iter().map(|&pair| pair as u32);
        self.boxes.clear();
        let boxes = slots.clone().map(|slot| splats.boxes[slot as usize]);
        self.boxes.extend(boxes);
        self.rows.fill(rows_of_tiles, slots, &self.boxes);
    }

    /// Splats that touch a row of tiles, in depth order.
    pub fn row(&self, row_of_tiles: usize) -> &[Entry] {
        self.rows.row(row_of_tiles)
    }

    #[inline(always)]
    fn collect(&mut self, range: &Range<u32>, splats: &Projected) {
        self.pairs.clear();
        for (index, group) in splats.groups.iter().enumerate() {
            let [low, high] = group.keys;
            if group.count == 0 || high < range.start || low >= range.end {
                continue;
            }
            let first = index * CHUNK;
            let slots = (first..first + group.count).zip(&splats.keys[first..]);
            let pair = |(slot, &key): (usize, &u32)| u64::from(key) << 32 | slot as u64;
            if range.contains(&low) && range.contains(&high) {
                self.pairs.extend(slots.map(pair));
            } else {
                let inside = slots.filter(|(_, key)| range.contains(key));
                self.pairs.extend(inside.map(pair));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chunks of splats of noisy depths, some at the very same one.
    fn projected(chunks: usize) -> (Vec<Group>, Vec<Record>, Vec<u32>, Vec<TileBox>) {
        let mut noise = crate::machine::noise::Noise::new(3);
        let size = chunks * CHUNK;
        let records: Vec<Record> = (0..size)
            .map(|slot| Record {
                depth: ((noise.next() * 2000.0).floor() + 1.0) * 0.01,
                object: (slot % 3) as u32,
                index: (size - slot) as u32,
                ..Record::default()
            })
            .collect();
        let keys: Vec<u32> = records
            .iter()
            .map(|record| record.depth.to_bits())
            .collect();
        let boxes = (0..size).map(|slot| TileBox {
            columns: [0, 1],
            rows: [(slot % 5) as u16, (slot % 5 + slot % 2) as u16],
        });
        let groups = (0..chunks)
            .map(|chunk| Group::new(&keys[chunk * CHUNK..][..chunk % 7 * 40]))
            .collect();
        (groups, records, keys, boxes.collect())
    }

    fn rows_of(threads: usize, splats: &Projected) -> Vec<Vec<Entry>> {
        let slabs: Vec<Slab> = cut(splats.groups, threads)
            .iter()
            .map(|range| {
                let mut slab = Slab::default();
                slab.sort(range, splats);
                slab.bin(6, splats);
                slab
            })
            .collect();
        (0..6)
            .map(|row| {
                slabs
                    .iter()
                    .flat_map(|slab| slab.row(row))
                    .copied()
                    .collect()
            })
            .collect()
    }

    #[test]
    fn any_number_of_slabs_gives_the_same_order() {
        let (groups, records, keys, boxes) = projected(300);
        let splats = Projected {
            groups: &groups,
            records: &records,
            keys: &keys,
            boxes: &boxes,
        };
        let mut wanted: Vec<usize> = groups
            .iter()
            .enumerate()
            .flat_map(|(index, group)| (0..group.count).map(move |k| index * CHUNK + k))
            .collect();
        wanted.sort_by_key(|&slot| (keys[slot], records[slot].object, records[slot].index));
        assert!(cut(&groups, 8).len() > 4);
        for threads in [1, 2, 3, 8] {
            for (row, entries) in rows_of(threads, &splats).iter().enumerate() {
                let touches = |slot: &&usize| {
                    let [first, last] = boxes[**slot].rows;
                    (usize::from(first)..=usize::from(last)).contains(&row)
                };
                let wanted: Vec<u32> = wanted.iter().filter(touches).map(|&s| s as u32).collect();
                let got: Vec<u32> = entries.iter().map(|entry| entry.slot).collect();
                assert_eq!(got, wanted, "{threads} threads, row {row}");
            }
        }
    }

    #[test]
    fn nothing_is_one_empty_slab() {
        for groups in [&[][..], &[Group::new(&[])]] {
            assert!(cut(groups, 4).into_iter().eq(std::iter::once(0..u32::MAX)));
        }
    }

    #[test]
    fn one_depth_is_never_cut() {
        let (groups, records, _, boxes) = projected(100);
        let keys = vec![2.5f32.to_bits(); records.len()];
        let groups: Vec<Group> = groups
            .iter()
            .map(|group| Group::new(&keys[..group.count]))
            .collect();
        let splats = Projected {
            groups: &groups,
            records: &records,
            keys: &keys,
            boxes: &boxes,
        };
        assert_eq!(rows_of(1, &splats), rows_of(4, &splats));
    }
}
