//! Kernels of the tracker: measurements in camera pictures, compared with drawn ones.

pub mod appearance;
pub mod background;
pub mod contour;
pub mod exponential;
pub mod fit;
pub mod picture;
pub mod rigid;
