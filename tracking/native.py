"""Where the tracker reaches the native crate; `tracking.kernels` adds the constants."""

from typing import TYPE_CHECKING

from scenes._native import SeenWindow, TrackKernels

if TYPE_CHECKING:
    from scenes._native import TrackLayer, TrackProblem

__all__ = ["SeenWindow", "TrackKernels", "TrackLayer", "TrackProblem"]
