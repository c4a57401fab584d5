//! Splat rendering kernels behind `scenes._native`; `scenes/render/reference.py` is their oracle.

pub mod adam;
pub mod alone;
pub mod angles;
pub mod backward;
#[cfg(target_arch = "x86_64")]
mod backward_avx512;
pub mod batch;
pub mod bin;
pub mod blend;
#[cfg(target_arch = "x86_64")]
mod blend_avx2;
#[cfg(target_arch = "x86_64")]
mod blend_avx512;
#[cfg(target_arch = "aarch64")]
mod blend_neon;
pub mod camera;
pub mod cone;
pub mod curvature;
pub mod depth_bounds;
pub mod ewa;
pub mod exponential;
pub mod exposure;
pub mod gradient_projection;
pub mod kannala_brandt;
pub mod lanes;
#[cfg(target_arch = "x86_64")]
mod lanes_avx2;
#[cfg(target_arch = "x86_64")]
mod lanes_avx512;
pub mod loss;
pub mod pool;
pub mod pose_frame;
pub mod pose_gn;
pub mod pose_grey;
pub mod pose_motion;
pub mod pose_sums;
pub mod pose_tile;
pub mod probe;
pub mod project;
mod python;
mod python_alone;
mod python_gradients;
mod python_probe;
mod python_request;
mod python_seen_window;
mod python_setting;
mod python_still;
mod python_track;
mod python_track_cut;
mod python_track_learn;
mod python_track_light;
mod python_track_portrait;
mod python_track_reduction;
mod python_track_relight;
mod python_track_request;
mod python_track_templates;
mod python_train;
pub mod render;
mod round_lens;
pub mod scene;
pub mod scope;
pub mod sh;
pub mod sh_slope;
pub mod simd;
pub mod slab;
pub mod sort;
#[cfg(target_arch = "x86_64")]
mod square_avx512;
mod ssim_row;
mod ssim_window;
pub mod still;
pub mod tape;
pub mod target;
pub mod tile_picture;
pub mod track_change;
pub mod track_contour;
pub mod track_cut;
pub mod track_edges;
pub mod track_expected;
pub mod track_judge;
pub mod track_learn;
pub mod track_light;
pub mod track_picture;
pub mod track_portrait;
pub mod track_reduction;
pub mod track_relight;
pub mod track_resemblance;
pub mod track_rigid;
pub mod track_solve;
pub mod track_templates;
pub mod train_backward;
pub mod train_splats;
pub mod train_step;
mod train_sums;
pub mod wide;
pub mod wide_tile;

/// The Python module.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::python::{Engine, PreparedCloud};
    #[pymodule_export]
    use crate::python_alone::Alone;
    #[pymodule_export]
    use crate::python_gradients::{Differentiator, Tape};
    #[pymodule_export]
    use crate::python_probe::Probe;
    #[pymodule_export]
    use crate::python_seen_window::SeenWindow;
    #[pymodule_export]
    use crate::python_setting::Setting;
    #[pymodule_export]
    use crate::python_still::StillPicture;
    #[pymodule_export]
    use crate::python_track::TrackKernels;
    #[pymodule_export]
    use crate::python_track_cut::cut_out;
    #[pymodule_export]
    use crate::python_track_learn::RoomLearner;
    #[pymodule_export]
    use crate::python_track_light::{exposure, patch_means};
    #[pymodule_export]
    use crate::python_track_portrait::laid_on;
    #[pymodule_export]
    use crate::python_track_reduction::{contour, looks, outlined};
    #[pymodule_export]
    use crate::python_track_relight::{Relighter, Shell};
    #[pymodule_export]
    use crate::python_track_templates::compare_templates;
    #[pymodule_export]
    use crate::python_train::{Trainee, TrainingTarget};
}
