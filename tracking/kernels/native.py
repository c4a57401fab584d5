"""The tracker's door to the native crate; its measurements run with `OPTIONS`."""

from typing import TYPE_CHECKING

from scenes._native import (
    Alone,
    PoseLikelihood,
    Relighter,
    RoomLearner,
    SeenWindow,
    Setting,
    Shell,
    TrackKernels,
    contour,
    cut_out,
    exposure,
    laid_on,
    looks,
    outlined,
    patch_means,
)
from tracking.kernels.options import OPTIONS

if TYPE_CHECKING:
    from scenes._native import (
        DrawnArrays,
        ObservedWindow,
        TrackLayer,
        TrackProblem,
    )

__all__ = [
    "KERNELS",
    "Alone",
    "DrawnArrays",
    "ObservedWindow",
    "PoseLikelihood",
    "Relighter",
    "RoomLearner",
    "SeenWindow",
    "Setting",
    "Shell",
    "TrackKernels",
    "TrackLayer",
    "TrackProblem",
    "contour",
    "cut_out",
    "exposure",
    "laid_on",
    "looks",
    "outlined",
    "patch_means",
]

KERNELS = TrackKernels(OPTIONS.for_native())
"""The measurements with the product's options; stateless."""
