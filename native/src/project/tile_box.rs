//! Boxes of tiles.

/// Pixels along a tile's side.
pub const TILE: usize = 16;

/// First and last tile that a splat's bounding box touches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TileBox {
    pub columns: [u16; 2],
    pub rows: [u16; 2],
}

impl TileBox {
    /// The box around both.
    pub fn with(&self, other: &TileBox) -> TileBox {
        let around = |a: [u16; 2], b: [u16; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        TileBox {
            columns: around(self.columns, other.columns),
            rows: around(self.rows, other.rows),
        }
    }
}
