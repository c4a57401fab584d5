//! Which instructions to use: chosen at run time, never at build time.

use crate::backward::BackwardTile;
use crate::batch;
use crate::blend::{self, Tile, TileWork};
#[cfg(target_arch = "aarch64")]
use crate::blend_neon;
use crate::lanes::{LaneWork, PatchWork, Portable};
#[cfg(target_arch = "x86_64")]
use crate::{backward_avx512, blend_avx2, blend_avx512, lanes_avx2, lanes_avx512, square_avx512};

/// An instruction set that this machine has; only `Simd::available` makes other ones than `SCALAR`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Simd(Level);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "aarch64")]
    Neon,
}

impl Simd {
    /// Portable code only.
    pub const SCALAR: Simd = Simd(Level::Scalar);

    /// All sets this machine has, the narrowest first.
    pub fn available() -> Vec<Simd> {
        #[allow(unused_mut)] // no other set on other machines
        let mut sets = vec![Simd::SCALAR];
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("popcnt")
        {
            sets.push(Simd(Level::Avx2));
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512vbmi2")
            {
                sets.push(Simd(Level::Avx512));
            }
        }
        #[cfg(target_arch = "aarch64")]
        if std::arch::is_aarch64_feature_detected!("neon") {
            sets.push(Simd(Level::Neon));
        }
        sets
    }

    /// The widest set this machine has.
    pub fn detect() -> Simd {
        Simd::available().pop().unwrap_or(Simd::SCALAR)
    }

    /// The set of that name, if this machine has it.
    pub fn named(name: &str) -> Option<Simd> {
        Simd::available().into_iter().find(|set| set.name() == name)
    }

    /// As Python writes it.
    pub fn name(self) -> &'static str {
        match self.0 {
            Level::Scalar => "scalar",
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => "avx512",
            #[cfg(target_arch = "aarch64")]
            Level::Neon => "neon",
        }
    }

    /// Runs portable code compiled for wider registers: the compiler vectorises the loops of what
    /// is inlined into `work`. Results stay the same to the bit, since nothing is fused or
    /// reordered.
    #[inline(always)]
    pub fn run<R>(self, work: impl FnOnce() -> R) -> R {
        match self.0 {
            Level::Scalar => work(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe { run_avx2(work) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found these sets before it made this value.
            Level::Avx512 => unsafe { run_avx512(work) },
            // What the compiler may use on this machine has NEON already.
            #[cfg(target_arch = "aarch64")]
            Level::Neon => work(),
        }
    }

    /// Runs a kernel written for `Lanes` with these instructions.
    #[inline(always)]
    pub fn run_lanes<W: LaneWork>(self, work: W) -> W::Output {
        match self.0 {
            Level::Scalar => work.run::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found AVX2 and FMA before it made these values.
            Level::Avx2 | Level::Avx512 => unsafe { lanes_avx2::run(work) },
            #[cfg(target_arch = "aarch64")]
            Level::Neon => work.run::<Portable>(),
        }
    }

    /// Runs a kernel written for `Patch` with registers as wide as these instructions have.
    #[inline(always)]
    pub fn run_patches<W: PatchWork>(self, work: W) -> W::Output {
        match self.0 {
            Level::Scalar => work.run::<Portable>(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe { lanes_avx2::run_patches(work) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found these sets before it made this value.
            Level::Avx512 => unsafe { lanes_avx512::run_patches(work) },
            #[cfg(target_arch = "aarch64")]
            Level::Neon => work.run::<Portable>(),
        }
    }

    /// `blend::blend_tile` with these instructions.
    pub fn blend_tile<const TRACK_OBJECTS: bool>(self, tile: &mut Tile, work: &TileWork) {
        match self.0 {
            Level::Scalar => {
                blend::blend_tile::<TRACK_OBJECTS>(tile, work);
            }
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe {
                blend_avx2::blend_tile::<TRACK_OBJECTS>(tile, work);
            },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found these sets before it made this value.
            Level::Avx512 => unsafe {
                blend_avx512::blend_tile::<TRACK_OBJECTS>(tile, work);
            },
            #[cfg(target_arch = "aarch64")]
            // SAFETY: `available` found NEON before it made this value.
            Level::Neon => unsafe {
                blend_neon::blend_tile::<TRACK_OBJECTS>(tile, work);
            },
        }
    }

    /// Pixels of a patch: what the blend kernel has in a register; 1 for the portable kernel.
    pub fn lanes(self) -> usize {
        match self.0 {
            Level::Scalar => 1,
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => blend::BLOCK_PIXELS,
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => square_avx512::SQUARE_PIXELS,
            #[cfg(target_arch = "aarch64")]
            Level::Neon => blend::BLOCK_PIXELS,
        }
    }

    /// The inner loop of `blend_tile` alone, with every lane in use: blends a list of splats that
    /// reach everywhere into every patch of a tile. False for the portable kernel, which has no lists.
    pub fn blend_everywhere(self, tile: &mut Tile, everything: &batch::PatchList) -> bool {
        match self.0 {
            Level::Scalar => return false,
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found AVX2 and FMA before it made this value.
            Level::Avx2 => unsafe { blend_avx2::blend_everywhere(tile, everything) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found these sets before it made this value.
            Level::Avx512 => unsafe { blend_avx512::blend_everywhere(tile, everything) },
            #[cfg(target_arch = "aarch64")]
            // SAFETY: `available` found NEON before it made this value.
            Level::Neon => unsafe { blend_neon::blend_everywhere(tile, everything) },
        }
        true
    }

    /// One tile's backward pass with these instructions.
    pub fn run_backward(self, tile: BackwardTile) {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` found these sets before it made this value.
            Level::Avx512 => unsafe { backward_avx512::run(tile) },
            _ => self.run_lanes(tile),
        }
    }
}

/// Asks the memory for a value that is needed soon, where the machine cannot foresee it.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_mm_prefetch, _MM_HINT_T0};
        // SAFETY: a prefetch reads nothing that the program can see, and every x86-64 has it.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn run_avx2<R>(work: impl FnOnce() -> R) -> R {
    work()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn run_avx512<R>(work: impl FnOnce() -> R) -> R {
    work()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::ewa::Judge;
    use crate::project::{Needle, Record};

    /// Any judge will do, as long as both kernels ask the same one.
    struct Coin;

    impl Judge for Coin {
        fn is_drawn(&self, _: &Record, x: i32, y: i32) -> bool {
            (x + y) % 2 == 0
        }
    }

    /// Numbers in 0..1, the same in every run.
    pub(crate) struct Noise(u64);

    impl Noise {
        pub(crate) fn new(seed: u64) -> Noise {
            Noise(seed)
        }

        pub(crate) fn next(&mut self) -> f32 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1u64 << 24) as f32
        }
    }

    fn random_records(count: usize) -> Vec<Record> {
        let mut noise = Noise::new(7);
        let mut next = move || noise.next();
        (0..count)
            .map(|i| {
                let a = 0.02 + next();
                Record {
                    base: [(60.0 * next()) as i32, (60.0 * next()) as i32],
                    offset: [next(), next()],
                    a,
                    b: next() - 0.5,
                    c: 0.02 + next(),
                    log2_opacity: -7.9 * next(),
                    colour: [next(), next(), next()],
                    depth: 1.0 + next(),
                    inverse_a: 1.0 / a,
                    object: (i % 3) as u32,
                    ..Record::default()
                }
            })
            .collect()
    }

    fn needle_of(record: &Record) -> Needle {
        Needle {
            centre: std::array::from_fn(|axis| {
                f64::from(record.base[axis]) + f64::from(record.offset[axis])
            }),
            a: f64::from(record.a),
            b: f64::from(record.b),
        }
    }

    fn blended(simd: Simd, work: &TileWork) -> Tile {
        let mut tile = Tile::EMPTY;
        simd.blend_tile::<true>(&mut tile, work);
        tile
    }

    fn largest_difference(a: &Tile, b: &Tile, relative_depth: f32) -> f32 {
        let pairs = a.blocks.iter().zip(&b.blocks).flat_map(|(a, b)| {
            (0..a.depth.len()).flat_map(move |lane| {
                [
                    a.transmittance[lane] - b.transmittance[lane],
                    a.colour[0][lane] - b.colour[0][lane],
                    a.colour[1][lane] - b.colour[1][lane],
                    a.colour[2][lane] - b.colour[2][lane],
                    (a.depth[lane] - b.depth[lane]) * relative_depth,
                    a.weight[lane] - b.weight[lane],
                ]
            })
        });
        pairs.fold(0.0, |worst, difference| match difference.is_nan() {
            true => f32::INFINITY,
            false => worst.max(difference.abs()),
        })
    }

    /// Calls `check` with tiles at several places and lists of several lengths.
    pub(crate) fn for_every_work(check: impl Fn(&TileWork)) {
        for count in [0, 1, 31, 256, 257, 1000] {
            let records = random_records(count);
            let slots: Vec<u32> = (0..count as u32).collect();
            let needles: Vec<Needle> = records.iter().map(needle_of).collect();
            for (left, top) in [(0, 0), (16, 32), (48, 16)] {
                check(&TileWork {
                    records: &records,
                    needles: &needles,
                    slots: &slots,
                    left,
                    top,
                    judge: &Coin,
                });
            }
        }
    }

    #[test]
    fn every_set_agrees_with_the_portable_kernel() {
        for_every_work(|work| {
            let plain = blended(Simd::SCALAR, work);
            for simd in Simd::available() {
                let difference = largest_difference(&plain, &blended(simd, work), 0.5);
                assert!(difference < 1e-5, "{}: {difference}", simd.name());
            }
        });
    }

    #[test]
    fn wider_vectors_change_no_bit() {
        let vectors: Vec<Simd> = Simd::available().into_iter().skip(1).collect();
        for_every_work(|work| {
            for pair in vectors.windows(2) {
                let (narrow, wide) = (blended(pair[0], work), blended(pair[1], work));
                assert_eq!(largest_difference(&narrow, &wide, 1.0), 0.0);
                for (a, b) in narrow.blocks.iter().zip(&wide.blocks) {
                    assert_eq!(a.object, b.object);
                }
            }
        });
    }

    #[test]
    fn sets_are_found_by_name() {
        for simd in Simd::available() {
            assert_eq!(Simd::named(simd.name()), Some(simd));
        }
        assert_eq!(Simd::named("abacus"), None);
    }
}
