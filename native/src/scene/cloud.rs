//! A splat cloud prepared for drawing: damaged splats dropped, Morton order, blocks of eight.
//!
//! Everything here depends on the cloud alone, so it is done once and drawn from any camera.

/// Splats handled together by the projection; also the width of an AVX2 register of `f32`.
pub const LANES: usize = 8;
/// Blocks that share one bounding sphere.
pub const BLOCKS_PER_CHUNK: usize = 32;
/// Splats that share one bounding sphere.
pub const CHUNK: usize = LANES * BLOCKS_PER_CHUNK;
/// Means further out than this (metres) count as damaged; keeps every later product finite.
pub const MAX_MEAN: f32 = 1e6;
/// Scales larger than this (metres) count as damaged: a rounded factor cannot hold thin ones.
pub const MAX_SCALE: f32 = 1e4;
/// Coefficients larger than this count as damaged: products of two colours would overflow.
pub const MAX_SH: f32 = 1e15;
/// log2(255): a splat is visible where `log2(alpha) >= -LOG2_255`.
pub const LOG2_255: f32 = 7.994_353_4;

/// The plain arrays a cloud is made of, as Python holds them.
#[derive(Clone, Copy)]
pub struct SplatArrays<'a> {
    /// (N, 3) metres.
    pub means: &'a [f32],
    /// (N, 3) metres, standard deviations.
    pub scales: &'a [f32],
    /// (N, 4) quaternions (w, x, y, z), any norm but zero.
    pub rotations: &'a [f32],
    /// (N,) 0..1; more counts as 1.
    pub opacities: &'a [f32],
    /// (N, K, 3).
    pub sh: &'a [f32],
    /// K: 1, 4, 9 or 16.
    pub sh_count: usize,
}

/// A splat as given, for the few samples that need it exactly.
#[derive(Clone, Copy, PartialEq)]
pub struct Original {
    pub mean: [f32; 3],
    pub scale: [f32; 3],
    pub rotation: [f32; 4],
    pub opacity: f32,
}

impl Original {
    fn new(arrays: &SplatArrays, i: usize) -> Original {
        Original {
            mean: std::array::from_fn(|k| arrays.means[3 * i + k]),
            scale: std::array::from_fn(|k| arrays.scales[3 * i + k]),
            rotation: std::array::from_fn(|k| arrays.rotations[4 * i + k]),
            opacity: arrays.opacities[i],
        }
    }

    /// R row by row: its columns are the directions of the scales.
    pub fn axes(&self) -> [f64; 9] {
        rotation_from_quaternion(&self.rotation)
    }

    /// R·S row by row: the covariance is `factor · factorᵀ`.
    pub fn factor(&self) -> [f64; 9] {
        let rotation = self.axes();
        std::array::from_fn(|entry| rotation[entry] * f64::from(self.scale[entry % 3]))
    }
}

/// Eight splats, one per lane. Unused lanes have `log2_opacity` = -inf and are never visible.
#[derive(Clone)]
pub struct Block {
    pub mean: [[f32; LANES]; 3],
    /// R·S row by row: the covariance is `factor · factorᵀ`.
    pub factor: [[f32; LANES]; 9],
    pub log2_opacity: [f32; LANES],
    /// Largest standard deviation.
    pub max_scale: [f32; LANES],
    /// Position in the cloud as given; decides ties of depth.
    pub index: [u32; LANES],
}

/// Bounding sphere of the means of `BLOCKS_PER_CHUNK` consecutive blocks.
#[derive(Clone, Copy)]
pub struct Chunk {
    pub centre: [f64; 3],
    pub radius: f64,
    /// Largest standard deviation of any splat in the chunk.
    pub max_scale: f64,
}

/// A cloud ready to draw.
#[derive(Clone)]
pub struct Cloud {
    pub blocks: Vec<Block>,
    /// `sh_count * 3` rows of eight lanes per block.
    pub sh: Vec<[f32; LANES]>,
    pub sh_count: usize,
    pub chunks: Vec<Chunk>,
    /// In the order given; `Block::index` points here.
    pub originals: Vec<Original>,
    /// Where each splat given went among the blocks; `u32::MAX` for those left out.
    pub places: Vec<u32>,
    /// Splats kept.
    pub count: usize,
    /// Splats dropped because a value was not finite, a scale not positive or a quaternion zero.
    pub dropped: usize,
}

impl Cloud {
    /// Prepares a cloud; the caller has checked that the slices have matching lengths.
    pub fn new(arrays: SplatArrays) -> Cloud {
        let total = arrays.opacities.len();
        let mut kept: Vec<u32> = (0..total as u32)
            .filter(|&i| is_sound(&arrays, i as usize))
            .collect();
        let dropped = total - kept.len();
        kept.retain(|&i| arrays.opacities[i as usize] * 255.0 >= 1.0);
        sort_by_morton_code(&mut kept, arrays.means);

        let blocks: Vec<Block> = kept
            .chunks(LANES)
            .map(|ids| block_of(&arrays, ids))
            .collect();
        let rows = arrays.sh_count * 3;
        let mut sh = vec![[0.0; LANES]; blocks.len() * rows];
        let mut places = vec![u32::MAX; total];
        for (position, &id) in kept.iter().enumerate() {
            places[id as usize] = position as u32;
            let (block, lane) = (position / LANES, position % LANES);
            let source = &arrays.sh[id as usize * rows..][..rows];
            for (row, &value) in source.iter().enumerate() {
                sh[block * rows + row][lane] = value;
            }
        }
        let chunks = kept
            .chunks(CHUNK)
            .map(|ids| chunk_of(&arrays, ids))
            .collect();
        Cloud {
            blocks,
            sh,
            sh_count: arrays.sh_count,
            chunks,
            originals: (0..total).map(|i| Original::new(&arrays, i)).collect(),
            places,
            count: kept.len(),
            dropped,
        }
    }

    /// Red, green and blue of each coefficient of a splat, by its index in the cloud as given.
    pub fn sh_of_splat(&self, index: usize) -> impl Iterator<Item = [f32; 3]> + '_ {
        let place = self.places[index] as usize;
        let rows = self.sh_of(place / LANES).chunks_exact(3);
        rows.map(move |row| std::array::from_fn(|channel| row[channel][place % LANES]))
    }

    /// The same splats in other colours; `change` gets a splat's index in the cloud as given, its
    /// mean, and its coefficients: red, green and blue each.
    pub fn recoloured(&self, change: impl Fn(usize, [f32; 3], &mut [[f32; 3]])) -> Cloud {
        let mut sh = self.sh.clone();
        let mut coefficients = vec![[0.0; 3]; self.sh_count];
        let rows = sh.chunks_exact_mut((3 * self.sh_count).max(1));
        for (block, rows) in self.blocks.iter().zip(rows) {
            for lane in (0..LANES).filter(|&lane| block.index[lane] != u32::MAX) {
                for (to, from) in coefficients.iter_mut().zip(rows.chunks_exact(3)) {
                    *to = std::array::from_fn(|channel| from[channel][lane]);
                }
                let mean = std::array::from_fn(|axis| block.mean[axis][lane]);
                change(block.index[lane] as usize, mean, &mut coefficients);
                for (from, to) in coefficients.iter().zip(rows.chunks_exact_mut(3)) {
                    for (to, from) in to.iter_mut().zip(from) {
                        to[lane] = *from;
                    }
                }
            }
        }
        Cloud { sh, ..self.clone() }
    }

    /// Spherical-harmonic rows of one block.
    pub fn sh_of(&self, block: usize) -> &[[f32; LANES]] {
        let rows = self.sh_count * 3;
        &self.sh[block * rows..][..rows]
    }
}

fn is_sound(arrays: &SplatArrays, i: usize) -> bool {
    let mean = &arrays.means[3 * i..][..3];
    let scale = &arrays.scales[3 * i..][..3];
    let quaternion = &arrays.rotations[4 * i..][..4];
    let sh = &arrays.sh[3 * arrays.sh_count * i..][..3 * arrays.sh_count];
    mean.iter().all(|v| v.abs() <= MAX_MEAN)
        && scale.iter().all(|&v| v > 0.0 && v <= MAX_SCALE)
        && quaternion.iter().all(|v| v.is_finite())
        && quaternion.iter().any(|&v| v != 0.0)
        && arrays.opacities[i].is_finite()
        && sh.iter().all(|v| v.abs() <= MAX_SH)
}

fn block_of(arrays: &SplatArrays, ids: &[u32]) -> Block {
    let mut block = Block {
        mean: [[0.0; LANES]; 3],
        factor: [[0.0; LANES]; 9],
        log2_opacity: [f32::NEG_INFINITY; LANES],
        max_scale: [0.0; LANES],
        index: [u32::MAX; LANES],
    };
    for (lane, &id) in ids.iter().enumerate() {
        let i = id as usize;
        let original = Original::new(arrays, i);
        for (row, value) in block.mean.iter_mut().zip(original.mean) {
            row[lane] = value;
        }
        for (row, value) in block.factor.iter_mut().zip(original.factor()) {
            row[lane] = value as f32;
        }
        block.log2_opacity[lane] = f64::from(original.opacity.min(1.0)).log2() as f32;
        block.max_scale[lane] = original.scale.into_iter().fold(0.0, f32::max);
        block.index[lane] = id;
    }
    block
}

fn rotation_from_quaternion(wxyz: &[f32]) -> [f64; 9] {
    let q: [f64; 4] = std::array::from_fn(|k| f64::from(wxyz[k]));
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    let rotation = rotation_of(q.map(|v| v / norm));
    std::array::from_fn(|entry| rotation[entry / 3][entry % 3])
}

/// The rotation of a unit quaternion (w, x, y, z), row by row.
pub(crate) fn rotation_of([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
        ],
        [
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        ],
        [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

fn chunk_of(arrays: &SplatArrays, ids: &[u32]) -> Chunk {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    let mut max_scale = 0.0f64;
    for &id in ids {
        for axis in 0..3 {
            let v = f64::from(arrays.means[3 * id as usize + axis]);
            low[axis] = low[axis].min(v);
            high[axis] = high[axis].max(v);
            max_scale = max_scale.max(f64::from(arrays.scales[3 * id as usize + axis]));
        }
    }
    let centre: [f64; 3] = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    let radius = ids
        .iter()
        .map(|&id| {
            (0..3)
                .map(|axis| f64::from(arrays.means[3 * id as usize + axis]) - centre[axis])
                .map(|d| d * d)
                .sum::<f64>()
        })
        .fold(0.0, f64::max)
        .sqrt();
    Chunk {
        centre,
        radius: radius * (1.0 + 1e-9),
        max_scale,
    }
}

/// Orders splats along a Z curve, so that a chunk is a compact piece of space.
fn sort_by_morton_code(ids: &mut [u32], means: &[f32]) {
    const CELLS: f64 = (1u32 << 21) as f64 - 1.0;
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for &id in ids.iter() {
        for axis in 0..3 {
            let v = f64::from(means[3 * id as usize + axis]);
            low[axis] = low[axis].min(v);
            high[axis] = high[axis].max(v);
        }
    }
    let side = (0..3)
        .map(|axis| high[axis] - low[axis])
        .fold(f64::MIN_POSITIVE, f64::max);
    let code = |id: u32| {
        (0..3).fold(0u64, |code, axis| {
            let v = f64::from(means[3 * id as usize + axis]);
            let cell = ((v - low[axis]) / side * CELLS) as u64;
            code | (spread_bits(cell) << axis)
        })
    };
    ids.sort_by_cached_key(|&id| (code(id), id));
}

/// Puts two zero bits after each of the low 21 bits.
fn spread_bits(v: u64) -> u64 {
    let mut x = v & 0x1f_ffff;
    x = (x | (x << 32)) & 0x001f_0000_0000_ffff;
    x = (x | (x << 16)) & 0x001f_0000_ff00_00ff;
    x = (x | (x << 8)) & 0x100f_00f0_0f00_f00f;
    x = (x | (x << 4)) & 0x10c3_0c30_c30c_30c3;
    (x | (x << 2)) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrays<'a>(means: &'a [f32], scales: &'a [f32], quaternions: &'a [f32]) -> Cloud {
        let n = means.len() / 3;
        Cloud::new(SplatArrays {
            means,
            scales,
            rotations: quaternions,
            opacities: &vec![0.5; n],
            sh: &vec![0.1; 3 * n],
            sh_count: 1,
        })
    }

    #[test]
    fn damaged_splats_are_dropped() {
        let means = [
            0.0,
            0.0,
            1.0,
            f32::NAN,
            0.0,
            1.0,
            0.0,
            0.0,
            2.0,
            1.0,
            1.0,
            1.0,
        ];
        let scales = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.0, 0.1, 0.1, 0.1, 0.1];
        let quaternions = [
            1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        ];
        let cloud = arrays(&means, &scales, &quaternions);
        assert_eq!((cloud.count, cloud.dropped), (1, 3));
        assert_eq!(cloud.blocks[0].index[0], 0);
        assert_eq!(cloud.blocks[0].log2_opacity[1], f32::NEG_INFINITY);
    }

    #[test]
    fn chunk_spheres_hold_their_means() {
        let means: Vec<f32> = (0..3 * 1000)
            .map(|i| ((i * 7919) % 1000) as f32 * 0.01)
            .collect();
        let cloud = arrays(&means, &vec![0.1; 3000], &[1.0, 0.0, 0.0, 0.0].repeat(1000));
        for (b, block) in cloud.blocks.iter().enumerate() {
            let chunk = &cloud.chunks[b / BLOCKS_PER_CHUNK];
            for lane in (0..LANES).filter(|&lane| block.index[lane] != u32::MAX) {
                let square: f64 = (0..3)
                    .map(|axis| f64::from(block.mean[axis][lane]) - chunk.centre[axis])
                    .map(|d| d * d)
                    .sum();
                assert!(square.sqrt() <= chunk.radius);
            }
        }
    }

    #[test]
    fn bits_are_spread_three_apart() {
        assert_eq!(spread_bits(0b111), 0b1_001_001);
        assert_eq!(spread_bits(0x1f_ffff).count_ones(), 21);
    }
}
