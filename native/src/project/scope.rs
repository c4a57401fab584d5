//! Which part of a picture is drawn: a window of pixels, and the tiles chosen within it.

use crate::camera::window::Window;
use crate::project::tile_box::{TileBox, TILE};

/// The pixels that are drawn; all others show the background.
#[derive(Clone, Debug)]
pub struct Scope {
    pub window: Window,
    tiles: Option<TileMask>,
}

impl Scope {
    pub fn whole(width: usize, height: usize) -> Scope {
        Scope {
            window: Window::whole(width, height),
            tiles: None,
        }
    }

    /// `region` is left, top, width and height within the picture; `tiles` has one flag per tile,
    /// row by row.
    pub fn new(
        [width, height]: [usize; 2],
        region: Option<[usize; 4]>,
        tiles: Option<&[bool]>,
    ) -> Scope {
        let mut window = Window::whole(width, height);
        if let Some([left, top, wide, high]) = region {
            window.left = left;
            window.top = top;
            window.right = left + wide;
            window.bottom = top + high;
        }
        let tiles = tiles.map(|open| TileMask::new(open, width.div_ceil(TILE)));
        if let Some(mask) = &tiles {
            mask.shrink(&mut window);
        }
        window.is_part =
            window.left > 0 || window.top > 0 || window.right < width || window.bottom < height;
        Scope { window, tiles }
    }

    /// Whether some pixel of the tile is drawn.
    #[inline(always)]
    pub fn is_open(&self, row: usize, column: usize) -> bool {
        let window = &self.window;
        column * TILE < window.right
            && (column + 1) * TILE > window.left
            && self.row_is_open(row)
            && self
                .tiles
                .as_ref()
                .is_none_or(|mask| mask.open[row * mask.columns + column])
    }

    /// Whether the window holds some of the row of tiles.
    #[inline(always)]
    pub fn row_is_open(&self, row: usize) -> bool {
        let window = &self.window;
        row * TILE < window.bottom && (row + 1) * TILE > window.top && window.left < window.right
    }

    /// Whether a box of tiles within the window holds one that is drawn.
    #[inline(always)]
    pub fn touches(&self, tiles: &TileBox) -> bool {
        self.tiles.as_ref().is_none_or(|mask| mask.touches(tiles))
    }
}

/// The tiles with drawn pixels whose centres lie in a box; None if there are none.
#[inline(always)]
pub fn tiles_within(x: [f64; 2], y: [f64; 2], scope: &Scope) -> Option<TileBox> {
    let window = &scope.window;
    let span = |[low, high]: [f64; 2], start: usize, end: usize| {
        let first = (low - 0.5).ceil().max(start as f64);
        let last = (high - 0.5).floor().min(end as f64 - 1.0);
        let tile_of = |pixel: f64| (pixel as usize / TILE) as u16;
        // Written so that a NaN gives None.
        (first <= last).then(|| [tile_of(first), tile_of(last)])
    };
    let tiles = TileBox {
        columns: span(x, window.left, window.right)?,
        rows: span(y, window.top, window.bottom)?,
    };
    scope.touches(&tiles).then_some(tiles)
}

/// A choice of tiles.
#[derive(Clone, Debug)]
struct TileMask {
    columns: usize,
    open: Vec<bool>,
    /// Open tiles above and to the left of each corner: (rows + 1) × (columns + 1).
    sums: Vec<u32>,
}

impl TileMask {
    fn new(open: &[bool], columns: usize) -> TileMask {
        let across = columns + 1;
        let mut sums = vec![0; across * (open.len() / columns + 1)];
        for (row, flags) in open.chunks(columns).enumerate() {
            let mut along = 0;
            for (column, &is_open) in flags.iter().enumerate() {
                along += u32::from(is_open);
                sums[(row + 1) * across + column + 1] = sums[row * across + column + 1] + along;
            }
        }
        TileMask {
            columns,
            open: open.to_vec(),
            sums,
        }
    }

    fn touches(&self, tiles: &TileBox) -> bool {
        let at = |row: u16, column: u16| {
            self.sums[usize::from(row) * (self.columns + 1) + usize::from(column)]
        };
        let [left, right] = [tiles.columns[0], tiles.columns[1] + 1];
        let [top, bottom] = [tiles.rows[0], tiles.rows[1] + 1];
        at(bottom, right) + at(top, left) > at(top, right) + at(bottom, left)
    }

    /// Cuts the window to the tiles that are open.
    fn shrink(&self, window: &mut Window) {
        let open = || {
            let tiles = self.open.iter().enumerate().filter(|(_, &is_open)| is_open);
            tiles.map(|(tile, _)| (tile / self.columns * TILE, tile % self.columns * TILE))
        };
        let first_row = open().map(|(top, _)| top).min();
        let (Some(first_row), Some(last_row), Some(first_column), Some(last_column)) = (
            first_row,
            open().map(|(top, _)| top).max(),
            open().map(|(_, left)| left).min(),
            open().map(|(_, left)| left).max(),
        ) else {
            window.right = window.left;
            window.bottom = window.top;
            return;
        };
        window.left = window.left.max(first_column);
        window.top = window.top.max(first_row);
        window.right = window.right.min(last_column + TILE).max(window.left);
        window.bottom = window.bottom.min(last_row + TILE).max(window.top);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_knows_which_boxes_it_touches() {
        const COLUMNS: usize = 5;
        let open: Vec<bool> = (0..20).map(|tile| tile == 7 || tile == 18).collect();
        let scope = Scope::new([75, 60], None, Some(&open));
        for rows in [[0, 0], [1, 1], [0, 3], [2, 2], [2, 3], [3, 3]] {
            for columns in [[0, 0], [2, 2], [0, 4], [3, 4], [3, 3], [4, 4]] {
                let wanted = (rows[0]..=rows[1]).any(|row| {
                    (columns[0]..=columns[1])
                        .any(|column| open[usize::from(row) * COLUMNS + usize::from(column)])
                });
                assert_eq!(scope.touches(&TileBox { columns, rows }), wanted);
            }
        }
        let window = scope.window;
        assert_eq!((window.left, window.right), (32, 64));
        assert_eq!((window.top, window.bottom), (16, 60));
        assert!(scope.is_open(1, 2) && scope.is_open(3, 3) && !scope.is_open(1, 3));
    }

    #[test]
    fn a_region_opens_the_tiles_it_overlaps() {
        let scope = Scope::new([100, 80], Some([17, 31, 2, 2]), None);
        let open: Vec<(usize, usize)> = (0..5)
            .flat_map(|row| (0..7).map(move |column| (row, column)))
            .filter(|&(row, column)| scope.is_open(row, column))
            .collect();
        assert_eq!(open, [(1, 1), (2, 1)]);
        assert!(scope.window.is_part);
    }

    #[test]
    fn nothing_open_is_an_empty_window() {
        let scope = Scope::new([40, 40], Some([3, 4, 20, 20]), Some(&[false; 9]));
        assert!((0..3).all(|row| !scope.row_is_open(row)));
        assert!(!Scope::new([40, 40], None, None).window.is_part);
    }
}
