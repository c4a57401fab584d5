"""Where the tracker reaches the native crate; `tracking.kernels` adds the constants."""

from scenes._native import SeenWindow, TrackKernels

__all__ = ["SeenWindow", "TrackKernels"]
