//! What the machine offers: instruction sets, found when the program runs, and worker threads.

#[cfg(test)]
pub(crate) mod noise;
pub mod pool;
pub mod simd;
