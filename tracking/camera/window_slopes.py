"""Displacements of windows of up to a few pixels, by the mean slopes of both pictures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.camera.displacements import (
    MIN_CORRELATION,
    MIN_RESIDUAL,
    MIN_SLOPE,
    MIN_USABLE,
    Displacements,
    displacements,
    noise_area,
    tensors,
)
from tracking.camera.lens_view import LensView, Sight, lens_view
from tracking.window.filters import box_blurred, slopes

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

WINDOW_PX = 23
"""Side in px of its windows, odd."""

STRIDE_PX = 7
"""Distance in px of their centres."""

FARTHEST_PX = 3.0
"""Displacement in px up to which slopes describe a window."""

MIN_POWER = 1e-10
"""Squared grey value, 0..1, of a window's details below which it is blank."""


def by_slopes(sight: Sight, world_from_rig: Pose, *, blur_px: float) -> Displacements:
    """Displacements of all textured windows.

    Args:
        sight: the lens.
        world_from_rig: where the room is drawn from.
        blur_px: Gaussian blur of both pictures.
    """
    view = lens_view(
        sight, sight.camera, sight.image, world_from_rig,
        blur_px=blur_px, margin_px=WINDOW_PX // 2,
    )  # fmt: skip
    weight = (view.facing > 0).astype(np.float32)
    live = _at_same_contrast(view, weight)
    residual = live - view.drawn
    (gx, gy), (live_x, live_y) = slopes(view.drawn), slopes(live)
    # The mean of both slopes is right to second order of the displacement.
    for slope, of_live in ((gx, live_x), (gy, live_y)):
        slope += of_live
        slope *= np.float32(0.5) * weight
    residual *= weight
    drawn = view.drawn * weight
    usable = _windows(weight)
    share = np.maximum(usable, np.float32(1e-6))
    product = np.empty_like(weight)
    xx, xy, yy, along_x, along_y, before, power = (
        np.asarray(_windows(np.multiply(one, other, out=product)) / share, dtype=np.float32)
        for one, other in (
            (gx, gx), (gx, gy), (gy, gy), (gx, residual), (gy, residual),
            (residual, residual), (drawn, drawn),
        )
    )  # fmt: skip
    textured = (usable > MIN_USABLE) & (xx + yy > MIN_SLOPE**2) & (power > MIN_POWER)
    tensor = tensors([xx[textured], xy[textured], yy[textured]])
    moment = np.stack([along_x[textured], along_y[textured]], axis=1).astype(np.float64)
    shift = _shift(tensor, moment)
    contrast = power[textured].astype(np.float64)
    left = before[textured] + (moment * shift).sum(axis=1)
    left = np.maximum(left, MIN_RESIDUAL * contrast)
    kept = (1.0 - left / (2.0 * contrast) > MIN_CORRELATION) & (
        np.linalg.norm(shift, axis=1) < FARTHEST_PX
    )
    # Windows overlap: each stands for the pixels nearest to it.
    pixels_per_noise = usable[textured] * STRIDE_PX**2 / (noise_area(blur_px) * left)
    steep = gx * gx + gy * gy
    nearness = _windows(steep * view.inverse_range)[textured] / _windows(steep)[textured]
    facing = _windows(view.facing)[textured] / share[textured]
    rows, columns = np.nonzero(textured)
    pixels = np.stack([columns, rows], axis=1).astype(np.float64) * STRIDE_PX
    pixels += STRIDE_PX // 2 + 0.5
    return displacements(
        sight,
        sight.camera,
        pixels[kept],
        shift[kept],
        (tensor * pixels_per_noise[:, None, None])[kept],
        range_m=1.0 / nearness[kept].astype(np.float64),
        facing=facing[kept].astype(np.float64),
        share=float(kept.mean()) if len(kept) else 0.0,
    )


def _at_same_contrast(view: LensView, weight: FloatArray) -> FloatArray:
    """The live details at the drawn ones' contrast, window by window, as in a correlation."""
    drawn, live = (
        box_blurred(weight * picture * picture, WINDOW_PX) for picture in (view.drawn, view.live)
    )
    gain = np.sqrt(np.maximum(drawn, 0) / np.maximum(live, MIN_POWER))
    return np.asarray(view.live * np.clip(gain, 0.2, 5.0), dtype=np.float32)


def _shift(tensor: Points, moment: Points) -> Points:
    """(N, 2) px, least squares; along an edge, where nothing is known, 0."""
    stiff = 1e-3 * (tensor[:, 0, 0] + tensor[:, 1, 1])[:, None, None] * np.eye(2)
    inverse = np.asarray(np.linalg.inv(tensor + stiff), dtype=np.float64)
    return np.asarray(-np.einsum("nij,nj->ni", inverse, moment), dtype=np.float64)


def _windows(picture: NDArray[np.floating]) -> FloatArray:
    """Means over the windows."""
    first = STRIDE_PX // 2
    means = box_blurred(picture.astype(np.float32, copy=False), WINDOW_PX)
    return means[first::STRIDE_PX, first::STRIDE_PX]
