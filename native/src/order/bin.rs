//! Which splats touch which tile, in depth order: first by row of tiles, then along each row.

use crate::machine::simd::prefetch;
use crate::project::record::{power_of, Record};
use crate::project::tile_box::{TileBox, TILE};

/// A splat in a row of tiles: its slot and the first and last column of its bounding box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Entry {
    pub slot: u32,
    pub columns: [u16; 2],
}

/// The splats that touch each row of tiles, in depth order.
#[derive(Default)]
pub struct RowLists {
    /// One entry per row of tiles, plus the end.
    starts: Vec<u32>,
    entries: Vec<Entry>,
    cursors: Vec<u32>,
}

impl RowLists {
    /// Fills the lists from splats in depth order: their slots and boxes.
    #[inline(always)]
    pub fn fill(
        &mut self,
        rows_of_tiles: usize,
        slots: impl Iterator<Item = u32>,
        boxes: &[TileBox],
    ) {
        let rows_of = |tiles: &TileBox| usize::from(tiles.rows[0])..usize::from(tiles.rows[1]) + 1;
        self.starts.clear();
        self.starts.resize(rows_of_tiles + 1, 0);
        for tiles in boxes {
            for count in &mut self.starts[1..][rows_of(tiles)] {
                *count += 1;
            }
        }
        accumulate(&mut self.starts);
        self.cursors.clear();
        self.cursors
            .extend_from_slice(&self.starts[..rows_of_tiles]);
        self.entries
            .resize(self.starts[rows_of_tiles] as usize, Entry::default());
        for (tiles, slot) in boxes.iter().zip(slots) {
            let columns = tiles.columns;
            for cursor in &mut self.cursors[rows_of(tiles)] {
                self.entries[*cursor as usize] = Entry { slot, columns };
                *cursor += 1;
            }
        }
    }

    /// Splats that touch a row of tiles.
    pub fn row(&self, row_of_tiles: usize) -> &[Entry] {
        &self.entries[self.starts[row_of_tiles] as usize..self.starts[row_of_tiles + 1] as usize]
    }
}

/// One row of tiles and the splats that touch each tile, in depth order.
#[derive(Default)]
pub struct TileRow {
    spans: Vec<[u16; 2]>,
    starts: Vec<u32>,
    slots: Vec<u32>,
    cursors: Vec<u32>,
}

impl TileRow {
    /// Fills the row from lists of its splats that follow one another in depth; `columns` is the
    /// number of tiles along it.
    #[inline(always)]
    pub fn fill<'a>(
        &mut self,
        row: usize,
        columns: usize,
        lists: impl Iterator<Item = &'a [Entry]> + Clone,
        records: &[Record],
    ) {
        self.spans.clear();
        self.starts.clear();
        self.starts.resize(columns + 1, 0);
        for entries in lists.clone() {
            self.count(row, columns, entries, records);
        }
        accumulate(&mut self.starts);
        self.cursors.clear();
        self.cursors.extend_from_slice(&self.starts[..columns]);
        self.slots.resize(self.starts[columns] as usize, 0);
        for (entry, &[first, end]) in lists.flatten().zip(&self.spans) {
            for cursor in &mut self.cursors[usize::from(first)..usize::from(end)] {
                self.slots[*cursor as usize] = entry.slot;
                *cursor += 1;
            }
        }
    }

    /// Finds which tiles each splat of a list touches, and counts them one place late in `starts`.
    #[inline(always)]
    fn count(&mut self, row: usize, columns: usize, entries: &[Entry], records: &[Record]) {
        // Narrower boxes are taken as they are: the exact border costs more than it saves.
        const EXACT_FROM_COLUMNS: u16 = 3;
        const FETCH_AHEAD: usize = 16;
        let top = (row * TILE) as i32;
        let is_wide = |[first, last]: [u16; 2]| last - first + 1 >= EXACT_FROM_COLUMNS;
        for (place, entry) in entries.iter().enumerate() {
            let [first, last] = entry.columns;
            let soon = entries.get(place + FETCH_AHEAD);
            if let Some(soon) = soon.filter(|soon| is_wide(soon.columns)) {
                prefetch(&records[soon.slot as usize]);
            }
            let span = if !is_wide(entry.columns) {
                [first, last + 1]
            } else {
                tiles_touched(&records[entry.slot as usize], top, columns)
            };
            self.spans.push(span);
            for count in &mut self.starts[usize::from(span[0]) + 1..=usize::from(span[1])] {
                *count += 1;
            }
        }
    }

    /// Splats that touch one tile.
    pub fn tile(&self, column: usize) -> &[u32] {
        &self.slots[self.starts[column] as usize..self.starts[column + 1] as usize]
    }
}

/// Turns counts, each one place late, into starts.
fn accumulate(counts: &mut [u32]) {
    let mut total = 0;
    for count in counts {
        total += *count;
        *count = total;
    }
}

/// Tiles [first, end) of a row that the alpha = 1/255 ellipse reaches, a hair generously.
#[inline(always)]
fn tiles_touched(record: &Record, top: i32, columns: usize) -> [u16; 2] {
    const SLACK_PX: f32 = 0.01;
    let power = power_of(record.log2_opacity);
    let first_dy = (top - record.base[1]) as f32 + 0.5 - record.offset[1];
    let last_dy = first_dy + (TILE - 1) as f32;
    let slope = -record.b * record.inverse_a;
    // The right border is concave in dy, the left one convex: the extreme lies at the ellipse's own
    // extreme or at the row of pixels nearest to it.
    let border = |dy: f32, sign: f32| {
        let v = record.c * dy;
        slope * dy + sign * (power - v * v).max(0.0).sqrt() * record.inverse_a
    };
    let right = border(record.right_dy.max(first_dy).min(last_dy), 1.0);
    let left = border((-record.right_dy).max(first_dy).min(last_dy), -1.0);
    let centre = record.base[0] as f32 + record.offset[0] - 0.5;
    let tiles = |pixels: f32| (pixels * (1.0 / TILE as f32)).clamp(0.0, columns as f32) as u16;
    let first = tiles(centre + left - SLACK_PX);
    // One tile is added before the cut at 0, so that a splat left of the picture ends at 0.
    let end = tiles(centre + right + SLACK_PX + TILE as f32);
    [first.min(end), end]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_record(x: f32, y: f32, reach: f32) -> Record {
        let a = power_of(0.0).sqrt() / reach;
        Record {
            offset: [x, y],
            a,
            c: a,
            inverse_a: 1.0 / a,
            ..Record::default()
        }
    }

    #[test]
    fn a_circle_touches_the_tiles_it_overlaps() {
        let circle = round_record(24.0, 24.0, 20.0);
        assert_eq!(tiles_touched(&circle, 16, 8), [0, 3]);
        assert_eq!(tiles_touched(&circle, 0, 8), [0, 3]);
        let small = round_record(24.0, 24.0, 3.0);
        assert_eq!(tiles_touched(&small, 16, 8), [1, 2]);
        assert_eq!(tiles_touched(&round_record(-90.0, 8.0, 20.0), 0, 8), [0, 0]);
        assert_eq!(tiles_touched(&round_record(500.0, 8.0, 20.0), 0, 8), [8, 8]);
    }

    #[test]
    fn rows_keep_depth_order() {
        let boxes = [[0, 2], [1, 1], [0, 0]].map(|rows| TileBox {
            columns: [3, 4],
            rows,
        });
        let mut lists = RowLists::default();
        lists.fill(3, [5, 6, 7].into_iter(), &boxes);
        let slots = |row| lists.row(row).iter().map(|e| e.slot).collect::<Vec<_>>();
        assert_eq!(slots(0), [5, 7]);
        assert_eq!(slots(1), [5, 6]);
        assert_eq!(slots(2), [5]);
    }
}
