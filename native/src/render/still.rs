//! A picture from a camera that stands still: only the tiles that a change touches are drawn again.
//!
//! Every object keeps its own projected splats and its own list per tile, each in depth order. The
//! list that a full render would make for a tile is the merge of its objects' lists, so a tile
//! drawn from that merge has the same bits; a tile that no changed object touches, before or
//! after, keeps its list and therefore its pixels.

use std::sync::Arc;

use rayon::prelude::*;

use crate::camera::lens::Lens;
use crate::order::bin::TileRow;
use crate::project::judge::ExactJudge;
use crate::project::posed::PosedCloud;
use crate::project::record::{Needle, Record};
use crate::project::tile_box::TILE;
use crate::project::wide::WideSplats;
use crate::render::engine::draw_tile;
use crate::render::job::{Job, Picture};
use crate::render::scratch::Scratch;
use crate::render::tile::leave_tile;
use crate::scene::cloud::Cloud;
use crate::tile::splat::TileWork;

/// A cloud and where it is: camera from object, row-major 3×4.
#[derive(Clone)]
pub struct Placed {
    pub cloud: Arc<Cloud>,
    pub pose: [f64; 12],
}

impl Placed {
    fn posed(&self, object: usize) -> PosedCloud<'_> {
        PosedCloud::new(&self.cloud, &self.pose, object)
    }

    /// Whether both give the same splats to the bit.
    fn is_same(&self, other: &Placed) -> bool {
        let bits = |placed: &Placed| placed.pose.map(f64::to_bits);
        Arc::ptr_eq(&self.cloud, &other.cloud) && bits(self) == bits(other)
    }
}

/// One object's projected splats and its list for every tile.
struct Layer {
    placed: Placed,
    splats: Scratch,
    rows: Vec<TileRow>,
}

impl Layer {
    fn new(placed: Placed) -> Layer {
        Layer {
            placed,
            splats: Scratch::default(),
            rows: Vec::new(),
        }
    }

    fn project<L: Lens>(&mut self, object: usize, lens: &L, job: &Job) {
        let posed = self.placed.posed(object);
        self.splats.list_splats(&[posed], lens, job);
        let rows_of_tiles = job.view.height.div_ceil(TILE);
        self.rows.resize_with(rows_of_tiles, TileRow::default);
        let splats = &self.splats;
        let rows = self.rows.par_iter_mut().enumerate();
        rows.for_each(|(row, lists)| splats.fill_row(row, job, lists));
    }

    /// Sets the tiles where this object has splats.
    fn mark(&self, touched: &mut [bool], columns: usize) {
        for (lists, marks) in self.rows.iter().zip(touched.chunks_mut(columns)) {
            for (column, mark) in marks.iter_mut().enumerate() {
                *mark |= !lists.tile(column).is_empty();
            }
        }
    }
}

/// What a picture from a still camera was last drawn from.
#[derive(Default)]
pub struct Still {
    layers: Vec<Layer>,
    /// Whether the picture shows the layers; false before the first and after a broken update.
    is_drawn: bool,
}

impl Still {
    /// Brings `picture` from the objects of the last call to `objects`; returns one flag per tile,
    /// row by row: whether it was drawn again.
    ///
    /// Lens, view, scope and background must be those of every earlier call, and `picture` what the last
    /// one left.
    pub fn update<L: Lens>(
        &mut self,
        objects: Vec<Placed>,
        lens: &L,
        job: &Job,
        picture: &mut Picture,
    ) -> Vec<bool> {
        let (width, height) = (job.view.width, job.view.height);
        let columns = width.div_ceil(TILE);
        let was_drawn = std::mem::replace(&mut self.is_drawn, false);
        let mut touched = vec![!was_drawn; columns * height.div_ceil(TILE)];
        job.pool.install(|| {
            for gone in self.layers.drain(objects.len().min(self.layers.len())..) {
                gone.mark(&mut touched, columns);
            }
            for (index, placed) in objects.into_iter().enumerate() {
                match self.layers.get_mut(index) {
                    Some(layer) if was_drawn && layer.placed.is_same(&placed) => continue,
                    Some(layer) => {
                        layer.mark(&mut touched, columns);
                        layer.placed = placed;
                    }
                    None => self.layers.push(Layer::new(placed)),
                }
                let layer = &mut self.layers[index];
                layer.project(index, lens, job);
                layer.mark(&mut touched, columns);
            }
            for (tile, is_touched) in touched.iter_mut().enumerate().filter(|_| was_drawn) {
                *is_touched &= job.scope.is_open(tile / columns, tile % columns);
            }
            if self.layers.len() > 1 {
                self.draw::<L, true>(lens, job, &touched, picture);
            } else {
                self.draw::<L, false>(lens, job, &touched, picture);
            }
        });
        self.is_drawn = true;
        touched
    }

    /// Draws the tiles that are set.
    fn draw<L: Lens, const TRACK_OBJECTS: bool>(
        &self,
        lens: &L,
        job: &Job,
        touched: &[bool],
        picture: &mut Picture,
    ) {
        let strip = job.view.width * TILE;
        let layers = self.layers.iter().enumerate();
        let objects: Vec<PosedCloud> = layers
            .map(|(index, layer)| layer.placed.posed(index))
            .collect();
        let judge = ExactJudge {
            objects: &objects,
            lens,
            antialias: job.view.antialias,
        };
        (
            picture.rgb.par_chunks_mut(3 * strip),
            picture.alpha.par_chunks_mut(strip),
            picture.depth.par_chunks_mut(strip),
            picture.ids.par_chunks_mut(strip),
            touched.par_chunks(job.view.width.div_ceil(TILE)),
        )
            .into_par_iter()
            .with_max_len(1)
            .enumerate()
            .for_each_init(
                Merge::default,
                |merge, (row, (rgb, alpha, depth, ids, touched))| {
                    let mut strip = Picture {
                        rgb,
                        alpha,
                        depth,
                        ids,
                    };
                    for (column, _) in touched.iter().enumerate().filter(|(_, &is_set)| is_set) {
                        if !job.scope.is_open(row, column) {
                            leave_tile(job, row, column, &mut strip);
                            continue;
                        }
                        merge.fill(&self.layers, row, column);
                        let slots = 0..merge.records.len();
                        let wides = match job.view.exact_above.is_finite() {
                            true => WideSplats::new(&objects, lens, &merge.records, slots),
                            false => WideSplats::default(),
                        };
                        let work = TileWork {
                            records: &merge.records,
                            needles: &merge.needles,
                            slots: &merge.slots,
                            left: (column * TILE) as i32,
                            top: (row * TILE) as i32,
                            judge: &judge,
                        };
                        draw_tile::<L, TRACK_OBJECTS>(&judge, &wides, job, &work, &mut strip);
                    }
                },
            );
    }
}

/// One tile's splats of all layers, nearest first, copied together.
#[derive(Default)]
struct Merge {
    records: Vec<Record>,
    /// As long as `records`; meaningful where the record is a needle.
    needles: Vec<Needle>,
    /// 0, 1, 2, …
    slots: Vec<u32>,
}

impl Merge {
    fn fill(&mut self, layers: &[Layer], row: usize, column: usize) {
        let mut sources: Vec<Source> = layers
            .iter()
            .map(|layer| Source::new(layer, layer.rows[row].tile(column)))
            .filter(|source| source.head.is_some())
            .collect();
        let count: usize = sources.iter().map(|source| source.slots.len()).sum();
        self.records.clear();
        self.needles.resize(count, Needle::default());
        // Ties go to the lower object, as in the sort of a full render: `min_by_key` keeps the
        // first of equals.
        while let Some(source) = sources
            .iter_mut()
            .filter(|source| source.head.is_some())
            .min_by_key(|source| source.head)
        {
            let slot = source.take();
            let record = &source.splats.records[slot];
            if record.is_needle() {
                self.needles[self.records.len()] = source.splats.needles[slot];
            }
            self.records.push(*record);
        }
        self.slots.clear();
        self.slots.extend(0..count as u32);
    }
}

/// One layer's list of a tile while it is merged.
struct Source<'a> {
    splats: &'a Scratch,
    slots: &'a [u32],
    next: usize,
    /// Depth key of the next splat; None at the end.
    head: Option<u32>,
}

impl<'a> Source<'a> {
    fn new(layer: &'a Layer, slots: &'a [u32]) -> Source<'a> {
        let mut source = Source {
            splats: &layer.splats,
            slots,
            next: 0,
            head: None,
        };
        source.look();
        source
    }

    fn look(&mut self) {
        // Depths are positive, so their bits are in the order of their values.
        let slot = self.slots.get(self.next);
        self.head = slot.map(|&slot| self.splats.records[slot as usize].depth.to_bits());
    }

    fn take(&mut self) -> usize {
        let slot = self.slots[self.next];
        self.next += 1;
        self.look();
        slot as usize
    }
}
