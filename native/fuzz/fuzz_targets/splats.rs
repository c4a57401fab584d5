//! What cargo-fuzz runs: any bytes are a scene; drawing it must hold what `check` says.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| gaussiannexus_native_fuzz::check(bytes));
