//! Tiles full of splats that kernels are compared on.

use crate::machine::noise::Noise;
use crate::project::judge::Judge;
use crate::project::record::{Needle, Record};
use crate::tile::splat::TileWork;

/// Any judge will do, as long as both kernels ask the same one.
struct Coin;

impl Judge for Coin {
    fn is_drawn(&self, _: &Record, x: i32, y: i32) -> bool {
        (x + y) % 2 == 0
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
