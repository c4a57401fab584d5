//! One chunk of splats through one camera: EWA projection, visibility, colour, compact records.

use crate::bin::TILE;
use crate::camera::Lens;
use crate::ewa;
use crate::scene::{Block, Cloud, BLOCKS_PER_CHUNK, LANES, LOG2_255};
use crate::scope::Scope;
use crate::sh;
use crate::wide::WideSplat;

/// log2(e) / 2: turns half a squared Mahalanobis distance into a power of two.
const HALF_LOG2_E: f64 = std::f64::consts::LOG2_E / 2.0;

/// Splats further away (metres) are not drawn: sums of their depths would overflow.
const MAX_DEPTH: f64 = 1e15;
/// Added to every reach, so that rounding never hides a pixel from the blend, which decides.
const SLACK_PX: f64 = 0.01;
/// Samples whose log2(255 · alpha) is this near to 0 are decided in double precision.
pub const STEP_DOUBT: f32 = 1e-4;

/// Everything the tile stages need of a splat; one cache line.
///
/// With (dx, dy) = pixel centre - splat centre: `log2(alpha) = log2_opacity - u² - v²`,
/// `u = a·dx + b·dy`, `v = c·dy`.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub struct Record {
    /// Centre = base + offset, split so that a tile-relative position keeps its last bits.
    pub base: [i32; 2],
    pub offset: [f32; 2],
    pub a: f32,
    pub b: f32,
    pub c: f32,
    pub log2_opacity: f32,
    pub colour: [f32; 3],
    pub depth: f32,
    pub inverse_a: f32,
    /// Height above the centre of the rightmost point of the 1/255 ellipse; the leftmost mirrors it.
    pub right_dy: f32,
    pub object: u32,
    pub index: u32,
}

/// What a needle's record cannot hold: at 1000 pixels from its centre single precision would put it
/// a hundredth of its width aside.
#[derive(Clone, Copy, Debug, Default)]
pub struct Needle {
    pub centre: [f64; 2],
    pub a: f64,
    pub b: f64,
}

impl Record {
    /// Whether the splat is so thin and slanted that its tiles take their terms from a `Needle`.
    #[inline(always)]
    pub fn is_needle(&self) -> bool {
        // b / c is the slant of the ellipse in units of its own thickness.
        self.b.abs() > 32.0 * self.c
    }

    /// Whether the splat is one of those that `wide` draws, and the record holds no ellipse.
    #[inline(always)]
    pub fn is_wide(&self) -> bool {
        self.c == 0.0
    }
}

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

/// One posed object as the projection sees it.
pub struct PosedCloud<'a> {
    pub cloud: &'a Cloud,
    pub rotation: [[f64; 3]; 3],
    pub translation: [f64; 3],
    pub object: u32,
}

impl<'a> PosedCloud<'a> {
    /// `pose`: camera from object, row-major 3×4.
    pub fn new(cloud: &'a Cloud, pose: &[f64; 12], object: usize) -> PosedCloud<'a> {
        PosedCloud {
            cloud,
            rotation: std::array::from_fn(|row| std::array::from_fn(|k| pose[4 * row + k])),
            translation: std::array::from_fn(|row| pose[4 * row + 3]),
            object: object as u32,
        }
    }

    #[inline(always)]
    pub fn to_camera(&self, p: [f64; 3]) -> [f64; 3] {
        let r = &self.rotation;
        std::array::from_fn(|row| {
            r[row][0] * p[0] + r[row][1] * p[1] + r[row][2] * p[2] + self.translation[row]
        })
    }

    /// Camera centre in the object's frame.
    pub fn eye(&self) -> [f64; 3] {
        std::array::from_fn(|axis| {
            -(0..3)
                .map(|row| self.rotation[row][axis] * self.translation[row])
                .sum::<f64>()
        })
    }
}

/// What is the same for all splats of one picture.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub width: usize,
    pub height: usize,
    pub near: f64,
    pub antialias: bool,
    pub sh_degree: usize,
    /// Splats whose largest standard deviation is seen under more than this are drawn by `wide`;
    /// radians.
    pub exact_above: f64,
}

impl View {
    /// Whether splats so deep are drawn.
    #[inline(always)]
    fn reaches(&self, depth: f64) -> bool {
        (depth >= self.near) & (depth <= MAX_DEPTH)
    }
}

/// Where a chunk's visible splats go; all slices hold a chunk.
pub struct Slots<'a> {
    pub records: &'a mut [Record],
    pub keys: &'a mut [u32],
    pub boxes: &'a mut [TileBox],
    pub needles: &'a mut [Needle],
}

/// Eight splats on the picture plane, one per lane.
struct Footprints {
    u: [f64; LANES],
    v: [f64; LANES],
    /// Whitening (see `Record`).
    a: [f64; LANES],
    slope: [f64; LANES],
    c: [f64; LANES],
    sigma_x: [f64; LANES],
    sigma_y: [f64; LANES],
    /// Covariance over `sigma_x`: height of the rightmost point of the 1-sigma ellipse.
    right_dy: [f64; LANES],
    /// log2 of the Mip filter's opacity factor; 0 without it.
    log2_gain: [f64; LANES],
    depth: [f64; LANES],
    drawable: [bool; LANES],
    is_wide: [bool; LANES],
}

/// Projects chunk `chunk` and returns how many records were written.
#[inline(always)]
pub fn project_chunk<L: Lens>(
    posed: &PosedCloud,
    lens: &L,
    view: &View,
    scope: &Scope,
    chunk: usize,
    slots: &mut Slots,
) -> usize {
    let cloud = posed.cloud;
    let eye = posed.eye();
    let sh_count = cloud.sh_count.min((view.sh_degree + 1).pow(2));
    let first = chunk * BLOCKS_PER_CHUNK;
    let last = (first + BLOCKS_PER_CHUNK).min(cloud.blocks.len());
    let mut written = 0;
    for index in first..last {
        let block = &cloud.blocks[index];
        let prints = footprints(posed, lens, view, index);
        let mut visible = [None; LANES];
        // A loop: what an array is made from by a function is compiled without vector instructions.
        for (lane, seen) in visible.iter_mut().enumerate() {
            *seen = extent_of(&prints, lane, block.log2_opacity[lane], scope);
        }
        let mut wide = [None; LANES];
        if prints.is_wide.contains(&true) {
            wide = wide_records(posed, lens, scope, block, &prints.is_wide);
            for lane in (0..LANES).filter(|&lane| prints.is_wide[lane]) {
                visible[lane] = wide[lane].map(|(tiles, record)| (tiles, record.log2_opacity));
            }
        }
        if visible.iter().all(Option::is_none) {
            continue;
        }
        let colour = sh::colours(cloud.sh_of(index), sh_count, &directions(&block.mean, eye));
        for lane in 0..LANES {
            let Some((tiles, log2_opacity)) = visible[lane] else {
                continue;
            };
            let mut record = match wide[lane] {
                Some((_, record)) => record,
                None => record_of(&prints, lane),
            };
            record.depth = prints.depth[lane] as f32;
            record.log2_opacity = log2_opacity;
            record.right_dy *= (power_of(log2_opacity).max(0.0) / HALF_LOG2_E as f32).sqrt();
            record.colour = std::array::from_fn(|channel| colour[channel][lane]);
            record.object = posed.object;
            record.index = block.index[lane];
            if record.is_needle() {
                slots.needles[written] = needle_of(&prints, lane);
            }
            slots.records[written] = record;
            slots.keys[written] = record.depth.to_bits();
            slots.boxes[written] = tiles;
            written += 1;
        }
    }
    written
}

/// EWA projection of one block.
#[inline(always)]
fn footprints<L: Lens>(posed: &PosedCloud, lens: &L, view: &View, index: usize) -> Footprints {
    let block = &posed.cloud.blocks[index];
    let mut out = Footprints {
        u: [0.0; LANES],
        v: [0.0; LANES],
        a: [0.0; LANES],
        slope: [0.0; LANES],
        c: [0.0; LANES],
        sigma_x: [0.0; LANES],
        sigma_y: [0.0; LANES],
        right_dy: [0.0; LANES],
        log2_gain: [0.0; LANES],
        depth: [0.0; LANES],
        drawable: [false; LANES],
        is_wide: [false; LANES],
    };
    let limit_squared = view.exact_above * view.exact_above;
    let mut sharp = [0.0; LANES];
    let mut soft = [0.0; LANES];
    for lane in 0..LANES {
        let mean = std::array::from_fn(|axis| f64::from(block.mean[axis][lane]));
        let factor = std::array::from_fn(|entry| f64::from(block.factor[entry][lane]));
        let seen = ewa::footprint(posed, lens, mean, factor);
        out.u[lane] = seen.centre[0];
        out.v[lane] = seen.centre[1];
        out.a[lane] = (HALF_LOG2_E * seen.yy / seen.soft).sqrt();
        out.slope[lane] = seen.xy / seen.yy;
        out.c[lane] = (HALF_LOG2_E / seen.yy).sqrt();
        out.sigma_x[lane] = seen.xx.sqrt();
        out.sigma_y[lane] = seen.yy.sqrt();
        out.right_dy[lane] = seen.xy / seen.xx.sqrt();
        out.depth[lane] = seen.depth;
        let scale = f64::from(block.max_scale[lane]);
        out.is_wide[lane] =
            (scale * scale > limit_squared * seen.range_squared) & view.reaches(seen.depth);
        out.drawable[lane] = seen.drawable & view.reaches(seen.depth);
        sharp[lane] = seen.sharp;
        soft[lane] = seen.soft;
    }
    if view.antialias {
        for lane in 0..LANES {
            out.log2_gain[lane] = 0.5 * (sharp[lane] / soft[lane]).log2();
        }
    }
    out
}

/// Tiles and records of a block's wide splats; None for the others and those that are not seen.
#[cold]
fn wide_records<L: Lens>(
    posed: &PosedCloud,
    lens: &L,
    scope: &Scope,
    block: &Block,
    is_wide: &[bool; LANES],
) -> [Option<(TileBox, Record)>; LANES] {
    std::array::from_fn(|lane| {
        if !is_wide[lane] {
            return None;
        }
        let original = &posed.cloud.originals[block.index[lane] as usize];
        let splat = WideSplat::new(posed, lens, original);
        let tiles = splat.tiles(lens, scope)?;
        Some((tiles, splat.record(&tiles)))
    })
}

/// Height of the log2-alpha paraboloid above the visible limit at the splat's centre.
#[inline(always)]
pub fn power_of(log2_opacity: f32) -> f32 {
    log2_opacity + LOG2_255
}

/// Tiles touched by the alpha = 1/255 ellipse and the splat's log2 opacity; None if it is not seen.
#[inline(always)]
fn extent_of(
    prints: &Footprints,
    lane: usize,
    log2_opacity: f32,
    scope: &Scope,
) -> Option<(TileBox, f32)> {
    let log2_opacity = log2_opacity + prints.log2_gain[lane] as f32;
    let power = power_of(log2_opacity);
    // Written so that a NaN anywhere also ends here.
    if !(prints.drawable[lane] && power >= -STEP_DOUBT) {
        return None;
    }
    let sigmas = (f64::from(power.max(0.0)) / HALF_LOG2_E).sqrt();
    let reach_x = sigmas * prints.sigma_x[lane] + SLACK_PX;
    let reach_y = sigmas * prints.sigma_y[lane] + SLACK_PX;
    let tiles = tiles_within(
        [prints.u[lane] - reach_x, prints.u[lane] + reach_x],
        [prints.v[lane] - reach_y, prints.v[lane] + reach_y],
        scope,
    )?;
    Some((tiles, log2_opacity))
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

#[inline(always)]
fn record_of(prints: &Footprints, lane: usize) -> Record {
    // Beyond this a splat is so wide that the lost fraction of a pixel does not show.
    const FAR: f64 = (1 << 24) as f64;
    let base = [
        prints.u[lane].floor().clamp(-FAR, FAR),
        prints.v[lane].floor().clamp(-FAR, FAR),
    ];
    Record {
        base: [base[0] as i32, base[1] as i32],
        offset: [
            (prints.u[lane] - base[0]) as f32,
            (prints.v[lane] - base[1]) as f32,
        ],
        a: prints.a[lane] as f32,
        b: (-prints.a[lane] * prints.slope[lane]) as f32,
        c: prints.c[lane] as f32,
        inverse_a: (1.0 / prints.a[lane]) as f32,
        right_dy: prints.right_dy[lane] as f32,
        ..Record::default()
    }
}

#[inline(always)]
fn needle_of(prints: &Footprints, lane: usize) -> Needle {
    Needle {
        centre: [prints.u[lane], prints.v[lane]],
        a: prints.a[lane],
        b: -prints.a[lane] * prints.slope[lane],
    }
}

/// Unit vectors from the eye to eight means.
#[inline(always)]
fn directions(mean: &[[f32; LANES]; 3], eye: [f64; 3]) -> [[f32; LANES]; 3] {
    let mut out = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        let d: [f64; 3] = std::array::from_fn(|axis| f64::from(mean[axis][lane]) - eye[axis]);
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let inverse = 1.0 / if length > 0.0 { length } else { 1.0 };
        for axis in 0..3 {
            out[axis][lane] = (d[axis] * inverse) as f32;
        }
    }
    out
}
