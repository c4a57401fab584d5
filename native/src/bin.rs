//! Which splats touch which tile, in depth order: first by row of tiles, then along each row.

use crate::project::{power_of, Record, Rows};

/// Pixels along a tile's side.
pub const TILE: usize = 16;

/// Consecutive rows of tiles and the splats that touch each, in depth order.
#[derive(Default)]
pub struct Band {
    first_row: usize,
    /// One entry per row of tiles, plus the end.
    starts: Vec<u32>,
    slots: Vec<u32>,
    cursors: Vec<u32>,
}

impl Band {
    /// Fills the band from all splats in depth order.
    pub fn fill(&mut self, rows_of_tiles: std::ops::Range<usize>, order: &[u32], rows: &[Rows]) {
        let count = rows_of_tiles.len();
        self.first_row = rows_of_tiles.start;
        let (first, last) = (rows_of_tiles.start, rows_of_tiles.end - 1);
        let clip = |r: &Rows| {
            let top = (r.first as usize / TILE).max(first);
            let bottom = (r.last as usize / TILE).min(last);
            (top - first, (bottom + 1).saturating_sub(first))
        };
        self.starts.clear();
        self.starts.resize(count + 1, 0);
        for r in rows {
            let (top, end) = clip(r);
            for row in top..end {
                self.starts[row + 1] += 1;
            }
        }
        for row in 0..count {
            self.starts[row + 1] += self.starts[row];
        }
        self.cursors.clear();
        self.cursors.extend_from_slice(&self.starts[..count]);
        self.slots.clear();
        self.slots.resize(self.starts[count] as usize, 0);
        for (r, &slot) in rows.iter().zip(order) {
            let (top, end) = clip(r);
            for row in top..end {
                let cursor = &mut self.cursors[row];
                self.slots[*cursor as usize] = slot;
                *cursor += 1;
            }
        }
    }

    /// Splats that touch one of the band's rows of tiles.
    pub fn row(&self, row_of_tiles: usize) -> &[u32] {
        let row = row_of_tiles - self.first_row;
        &self.slots[self.starts[row] as usize..self.starts[row + 1] as usize]
    }
}

/// One row of tiles and the splats that touch each tile, in depth order.
#[derive(Default)]
pub struct TileRow {
    spans: Vec<(u16, u16)>,
    starts: Vec<u32>,
    slots: Vec<u32>,
    cursors: Vec<u32>,
}

impl TileRow {
    /// Fills the row; `columns` is the number of tiles along it.
    pub fn fill(&mut self, row_of_tiles: usize, columns: usize, slots: &[u32], records: &[Record]) {
        let top = (row_of_tiles * TILE) as i32;
        self.spans.clear();
        self.starts.clear();
        self.starts.resize(columns + 1, 0);
        for &slot in slots {
            let (first, end) = tiles_touched(&records[slot as usize], top, columns);
            self.spans.push((first as u16, end as u16));
            for column in first..end {
                self.starts[column + 1] += 1;
            }
        }
        for column in 0..columns {
            self.starts[column + 1] += self.starts[column];
        }
        self.cursors.clear();
        self.cursors.extend_from_slice(&self.starts[..columns]);
        self.slots.clear();
        self.slots.resize(self.starts[columns] as usize, 0);
        for (&slot, &(first, end)) in slots.iter().zip(&self.spans) {
            for cursor in &mut self.cursors[first as usize..end as usize] {
                self.slots[*cursor as usize] = slot;
                *cursor += 1;
            }
        }
    }

    /// Splats that touch one tile.
    pub fn tile(&self, column: usize) -> &[u32] {
        &self.slots[self.starts[column] as usize..self.starts[column + 1] as usize]
    }
}

/// Tiles [first, end) of a row that the alpha = 1/255 ellipse reaches, a hair generously.
#[inline(always)]
fn tiles_touched(record: &Record, top: i32, columns: usize) -> (usize, usize) {
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
    let right = border(record.right_dy.clamp(first_dy, last_dy), 1.0);
    let left = border((-record.right_dy).clamp(first_dy, last_dy), -1.0);
    let centre = record.base[0] as f32 + record.offset[0];
    let first = ((centre + left - 0.5 - SLACK_PX) / TILE as f32).floor();
    let last = ((centre + right - 0.5 + SLACK_PX) / TILE as f32).floor();
    let first = first.max(0.0) as usize;
    let end = (last.min(columns as f32 - 1.0) + 1.0).max(0.0) as usize;
    (first.min(end), end)
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
        assert_eq!(tiles_touched(&circle, 16, 8), (0, 3));
        assert_eq!(tiles_touched(&circle, 0, 8), (0, 3));
        let small = round_record(24.0, 24.0, 3.0);
        assert_eq!(tiles_touched(&small, 16, 8), (1, 2));
        assert_eq!(tiles_touched(&round_record(-90.0, 8.0, 20.0), 0, 8), (0, 0));
        assert_eq!(tiles_touched(&round_record(500.0, 8.0, 20.0), 0, 8), (8, 8));
    }

    #[test]
    fn bands_keep_depth_order() {
        let rows = [(0, 40), (20, 25), (0, 3)].map(|(first, last)| Rows { first, last });
        let mut band = Band::default();
        band.fill(1..3, &[5, 6, 7], &rows);
        assert_eq!(band.row(1), [5, 6]);
        assert_eq!(band.row(2), [5]);
    }
}
