//! The same check without a fuzzer: random bytes, on any toolchain.

use gaussiannexus_native_fuzz::check;

#[test]
fn random_scenes_hold() {
    let mut state = 20_260_101u64;
    for _ in 0..20_000 {
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        let length = next() % 6000;
        let bytes: Vec<u8> = (0..length).map(|_| (next() >> 24) as u8).collect();
        check(&bytes);
    }
}

#[test]
fn nothing_is_a_scene_too() {
    check(&[]);
    check(&[0; 4000]);
    check(&[255; 4000]);
}
