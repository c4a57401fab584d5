"""Where the tracker reaches the native crate; others add the constants."""

from typing import TYPE_CHECKING

from scenes._native import (
    Alone,
    Relighter,
    RoomLearner,
    SeenWindow,
    Setting,
    Shell,
    TrackKernels,
    compare_templates,
    contour,
    cut_out,
    exposure,
    laid_on,
    looks,
    outlined,
    patch_means,
)

if TYPE_CHECKING:
    from scenes._native import DrawnArrays, TrackLayer, TrackProblem

__all__ = [
    "Alone",
    "DrawnArrays",
    "Relighter",
    "RoomLearner",
    "SeenWindow",
    "Setting",
    "Shell",
    "TrackKernels",
    "TrackLayer",
    "TrackProblem",
    "compare_templates",
    "contour",
    "cut_out",
    "exposure",
    "laid_on",
    "looks",
    "outlined",
    "patch_means",
]
