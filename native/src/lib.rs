//! Splat rendering kernels behind `scenes._native`; `scenes/render/reference.py` is their oracle.

pub mod bin;
pub mod blend;
#[cfg(target_arch = "x86_64")]
mod blend_avx2;
#[cfg(target_arch = "x86_64")]
mod blend_avx512;
pub mod camera;
pub mod ewa;
pub mod pool;
pub mod project;
mod python;
mod python_still;
pub mod render;
pub mod scene;
pub mod sh;
pub mod simd;
pub mod sort;
pub mod still;

/// The Python module.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::python::{Engine, PreparedCloud};
    #[pymodule_export]
    use crate::python_still::StillPicture;
}
