//! The same check without a fuzzer: random bytes, on any toolchain.

use gaussiannexus_native_fuzz::check;

/// Random numbers, the same in every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn bytes(&mut self, count: u64) -> Vec<u8> {
        (0..count).map(|_| (self.next() >> 24) as u8).collect()
    }
}

#[test]
fn random_scenes_hold() {
    let mut noise = Noise(20_260_101);
    for _ in 0..20_000 {
        let length = noise.next() % 6000;
        check(&noise.bytes(length));
    }
}

/// Before focal lengths and principal points had limits, half of these scenes did not.
#[test]
fn cameras_at_their_limits_hold() {
    // As `scene` reads them: a picture of 40 by 40, its near limit and options.
    const VIEW: [u8; 7] = [39, 39, 128, 0, 1, 0, 3];
    // One byte that stands for an odd value, or three for a plausible one.
    let (longest, shortest) = (&[9u8][..], &[5u8][..]);
    let (plausible, far, far_back) = (&[128u8, 0, 128][..], &[9u8][..], &[10u8][..]);
    let mut noise = Noise(77);
    for is_round in [0, 1] {
        for focal in [
            [longest, plausible],
            [shortest, longest],
            [plausible, shortest],
        ] {
            for centre in [
                [plausible, plausible],
                [far, plausible],
                [plausible, far_back],
            ] {
                for _ in 0..20 {
                    let camera = [focal.concat(), centre.concat()].concat();
                    let scene = noise.bytes(1500);
                    check(&[&VIEW[..], &[is_round], &camera, &scene].concat());
                }
            }
        }
    }
}

#[test]
fn nothing_is_a_scene_too() {
    check(&[]);
    check(&[0; 4000]);
    check(&[255; 4000]);
}
