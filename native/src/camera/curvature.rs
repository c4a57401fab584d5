//! How a camera's Jacobian changes from place to place.

use crate::camera::lens::Lens;

/// Second derivatives of a projection.
#[derive(Clone, Copy, Debug)]
pub struct Bend {
    /// d (u, v) / d p; a pinhole's frozen Jacobian is not that.
    pub centre: [[f64; 3]; 2],
    /// `jacobian[row][column][axis]` = d J[row][column] / d p[axis], px per m².
    pub jacobian: [[[f64; 3]; 3]; 2],
    /// d depth / d p.
    pub depth: [f64; 3],
}

/// A lens that can be differentiated twice; free of branches like `Lens::project`.
pub trait Curved: Lens {
    fn bend(&self, p: [f64; 3]) -> Bend;
}
