//! Which instructions to use: chosen at run time, never at build time.

/// An instruction set that this machine has; only `Simd::available` makes other ones than `SCALAR`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Simd(Level);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
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

    /// Which set it is, for those who choose a kernel by it.
    #[inline(always)]
    pub(crate) fn level(self) -> Level {
        self.0
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
#[target_feature(enable = "avx2,fma,popcnt")]
fn run_avx2<R>(work: impl FnOnce() -> R) -> R {
    work()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi2,popcnt")]
fn run_avx512<R>(work: impl FnOnce() -> R) -> R {
    work()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_found_by_name() {
        for simd in Simd::available() {
            assert_eq!(Simd::named(simd.name()), Some(simd));
        }
        assert_eq!(Simd::named("abacus"), None);
    }
}
