//! One chunk of splats through one camera: EWA projection, visibility, colour, compact records.

use crate::camera::lens::Lens;
use crate::project::ewa;
use crate::project::posed::{PosedCloud, View};
use crate::project::record::{power_of, Needle, Record, HALF_LOG2_E, STEP_DOUBT};
use crate::project::scope::{tiles_within, Scope};
use crate::project::tile_box::TileBox;
use crate::project::wide::WideSplat;
use crate::scene::cloud::{Block, BLOCKS_PER_CHUNK, LANES};
use crate::scene::sh;

/// Added to every reach, so that rounding never hides a pixel from the blend, which decides.
const SLACK_PX: f64 = 0.01;

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
