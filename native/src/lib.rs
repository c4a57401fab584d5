//! Splat rendering kernels behind `scenes._native`; `benchmarks/raster/reference/` is their oracle.
//!
//! The modules are listed in order of dependency: each imports only from those listed before it;
//! `tests/module_order.rs` checks that.

pub mod machine;

pub mod camera;

pub mod scene;

pub mod project;

pub mod order;

pub mod tile;

pub mod lanes;

pub mod blend;

pub mod render;

pub mod gradients;

pub mod train;

pub mod stereo;

pub mod track;

mod python;

/// The Python module.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::python::alone::Alone;
    #[pymodule_export]
    use crate::python::cloud::PreparedCloud;
    #[pymodule_export]
    use crate::python::engine::Engine;
    #[pymodule_export]
    use crate::python::gradients::{Differentiator, Tape};
    #[pymodule_export]
    use crate::python::probe::Probe;
    #[pymodule_export]
    use crate::python::stereo::swept_depth;
    #[pymodule_export]
    use crate::python::still::StillPicture;
    #[pymodule_export]
    use crate::python::track::cut::cut_out;
    #[pymodule_export]
    use crate::python::track::kernels::TrackKernels;
    #[pymodule_export]
    use crate::python::track::learn::RoomLearner;
    #[pymodule_export]
    use crate::python::track::light::{exposure, patch_means};
    #[pymodule_export]
    use crate::python::track::memory::laid_on;
    #[pymodule_export]
    use crate::python::track::reduction::{contour, looks, outlined};
    #[pymodule_export]
    use crate::python::track::relight::{Relighter, Shell};
    #[pymodule_export]
    use crate::python::track::seen_window::SeenWindow;
    #[pymodule_export]
    use crate::python::track::setting::Setting;
    #[pymodule_export]
    use crate::python::track::support::PoseLikelihood;
    #[pymodule_export]
    use crate::python::train::{Trainee, TrainingTarget};
}
