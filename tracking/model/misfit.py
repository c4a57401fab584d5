"""How badly a pixel fits what is expected of it, in nats."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]

RESIDUAL_SIGMA = 0.07
"""Standard deviation, channels of 0..1, of a live pixel about the composite of a scanned object in
fitted light. Measured at true poses of foreign scans: half of the pixels are within it."""

MAX_MISFIT = -1.5 * math.log(2 * math.pi) - 3 * math.log(RESIDUAL_SIGMA)
"""Largest misfit of a pixel, nats: there the Gaussian of `RESIDUAL_SIGMA` meets the density of a
colour that may be any of the unit cube."""


def misfit(residual: FloatArray, sigma: float = RESIDUAL_SIGMA) -> FloatArray:
    """(..., H, W) nats of (..., H, W, 3) residuals, at most `MAX_MISFIT`."""
    squared = np.einsum("...c,...c->...", residual, residual)
    return np.minimum(squared / (2 * sigma**2), MAX_MISFIT).astype(np.float32)
