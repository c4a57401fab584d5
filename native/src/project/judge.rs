//! Who decides where single precision cannot.

use crate::camera::lens::Lens;
use crate::project::ewa::footprint;
use crate::project::posed::PosedCloud;
use crate::project::record::Record;
use crate::scene::cloud::Original;

/// Decides on which side of the 1/255 step a splat lies where single precision cannot.
///
/// A sample on the wrong side changes a colour by up to 0.004, and which samples those are would
/// differ from machine to machine.
pub trait Judge: Sync {
    /// Whether the splat's alpha in column `x`, row `y` of the picture is at least 1/255.
    fn is_drawn(&self, record: &Record, x: i32, y: i32) -> bool;
}

/// The judge of a picture: projects the splat once more, from its values as given.
pub struct ExactJudge<'a, L> {
    pub objects: &'a [PosedCloud<'a>],
    pub lens: &'a L,
    pub antialias: bool,
}

impl<L: Lens> Judge for ExactJudge<'_, L> {
    #[cold]
    fn is_drawn(&self, record: &Record, x: i32, y: i32) -> bool {
        let posed = &self.objects[record.object as usize];
        let original: &Original = &posed.cloud.originals[record.index as usize];
        let seen = footprint(
            posed,
            self.lens,
            original.mean.map(f64::from),
            original.factor(),
        );
        let dx = f64::from(x) + 0.5 - seen.centre[0];
        let dy = f64::from(y) + 0.5 - seen.centre[1];
        let square = seen.yy * dx * dx - 2.0 * seen.xy * dx * dy + seen.xx * dy * dy;
        let gain = if self.antialias {
            (seen.sharp / seen.soft).sqrt()
        } else {
            1.0
        };
        let opacity = f64::from(original.opacity.min(1.0)) * gain;
        opacity * (-0.5 * square / seen.soft).exp() >= 1.0 / 255.0
    }
}
