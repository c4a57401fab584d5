"""Where the tracker reaches the native crate; `tracking.kernels` and `tracking.learn` add constants."""

from typing import TYPE_CHECKING

from scenes._native import RoomLearner, SeenWindow, TrackKernels

if TYPE_CHECKING:
    from scenes._native import TrackLayer, TrackProblem

__all__ = ["RoomLearner", "SeenWindow", "TrackKernels", "TrackLayer", "TrackProblem"]
