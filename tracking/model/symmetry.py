"""Symmetry: the turns about the vertical axis that leave an object looking the same.

A turned object is compared with itself as poses are compared in a picture: in the light that fits
best, in nats per pixel. Shading that the fitted light does not explain is coarse, while edges and
prints are fine, so only the fine part of a residual counts.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tracking.model.misfit import RESIDUAL_SIGMA, misfit
from tracking.model.relighting import LIGHT_SIGMA, LightPrior, fit_light
from tracking.window.filters import blurred

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

ROUND = 0
"""Symmetry of an object that looks the same at every yaw."""

SAME_NATS = 0.1
"""Nats a pixel that shares no error below which a turn cannot be seen: 20 to 1 need thirty of them,
an object of some 160 px. In three rooms by seed, what is symmetric had 0.02 to 0.08 and a plain
book turned by half 0.16; only a glossy ball, whose highlight was scanned, had more."""

COARSE = 1.0 / 7.0
"""Gaussian blur, in radii of the object, that separates shading from edges and prints: between
a light's variation over a whole side and the width of a book's spine."""

SHARED_PX2 = 100.0
"""Pixels that share one error, for the weight of the prior of light: as in a lens picture."""

GREY = 0.5
"""Background, channels of 0..1, before which the object is compared."""

COMPARED_EVERY = 4
"""One of so many yaws is compared with its turns: six directions to look from."""


def nats_of_turns(pictures: FloatArray, facing: FloatArray, *, radius_px: float) -> Points:
    """(Y,) mean nats a pixel by which an object turned by each step of yaw differs from itself.

    Args:
        pictures: (E, Y, H, W, 4) RGBA over black by elevation and evenly spaced yaw.
        facing: (E, Y, H, W, 3) where its surface faces, in its own frame; 0 where unknown.
        radius_px: of its sphere in the pictures.
    """
    yaws = pictures.shape[1]
    nats: Points = np.zeros(int(yaws), dtype=np.float64)
    for step in range(1, yaws // 2 + 1):
        pairs = [
            _difference(level[yaw], level[yaw - step], sides[yaw - step], radius_px)
            for level, sides in zip(pictures, facing, strict=True)
            for yaw in range(0, yaws, COMPARED_EVERY)
        ]
        nats[step] = nats[-step] = float(np.mean(pairs))
    return nats


def symmetry_of(turn_nats: Points) -> int:
    """How often an object repeats in a turn, or `ROUND`.

    Args:
        turn_nats: of `nats_of_turns`.
    """
    yaws = len(turn_nats)
    if (turn_nats < SAME_NATS).all():
        return ROUND
    folds = [n for n in (12, 8, 6, 4, 3, 2) if yaws % n == 0]
    return next((n for n in folds if turn_nats[yaws // n] < SAME_NATS), 1)


def are_same(turn_nats: Points, turn_rad: Points) -> NDArray[np.bool_]:
    """(N,) whether turns (rad) leave an object looking the same."""
    yaws = len(turn_nats)
    return turn_nats[np.rint(turn_rad * yaws / (2 * math.pi)).astype(int) % yaws] < SAME_NATS


def _difference(seen: FloatArray, drawn: FloatArray, facing: FloatArray, radius_px: float) -> float:
    """Nats a pixel of a picture of an object, as another picture of it in the likeliest light."""
    alpha = drawn[..., 3]
    live = seen[..., :3] + (1.0 - seen[..., 3:]) * GREY
    shown = (live - (1.0 - alpha)[..., None] * GREY).astype(np.float32)
    rgb = np.ascontiguousarray(drawn[..., :3])
    prior = LightPrior(LIGHT_SIGMA, 1.0 / (RESIDUAL_SIGMA**2 * SHARED_PX2))
    _, light = fit_light(rgb, facing, shown, alpha, prior=prior)
    residual = (shown - rgb * light.gains(facing)).astype(np.float32)
    fine = residual - blurred(residual, COARSE * radius_px)
    either = np.maximum(alpha, seen[..., 3])
    return float((either * misfit(fine)).sum() / max(float(alpha.sum()), 1.0))
