"""Stored values (logarithms, logits, free quaternions) to a `SplatCloud`, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.formats.storage.blocks import owned
from scenes.splats import SplatCloud

UNIT_TOLERANCE = 1e-6
"""A quaternion this near to norm 1 is kept bit by bit, so that what was written is read back."""

damaged_values_are_quiet = np.errstate(invalid="ignore", over="ignore", divide="ignore")
"""Decorates readers: damaged numbers make no noise, as their rows are left out later."""

MIN_NORM = 1e-6
"""A quaternion below this norm points nowhere."""

TINY = np.float32(1e-12)
"""Standard deviation of a splat without any, in the file's unit: far below what is drawn, and its
square and reciprocal fit float32."""

LOGIT_LIMITS = (-110.0, 18.0)
"""Logits whose sigmoid is exactly 0 and exactly 1 in float32."""


def cloud_from_file(
    *,
    means: NDArray[np.float32],
    scales: NDArray[np.float32],
    quaternions: NDArray[np.float32],
    opacities: NDArray[np.float32],
    sh: NDArray[np.float32],
) -> SplatCloud:
    """A cloud of activated values, which it keeps; whoever reads the file leaves out bad rows.

    Quaternions are normalised, and a scale of exactly 0, which exporters of flat splats write, is
    `TINY`.

    Args:
        means: (N, 3) positions in the file's length unit.
        scales: (N, 3) linear standard deviations.
        quaternions: (N, 4) wxyz of any norm above `MIN_NORM`.
        opacities: (N,) 0..1.
        sh: (N, K, 3) coefficients.
    """
    return owned(
        means=means,
        scales=np.where(scales == 0, TINY, scales),
        rotations=unit_quaternions(quaternions),
        opacities=opacities,
        sh=sh,
    )


def unit_quaternions(quaternions: NDArray[np.float32]) -> NDArray[np.float32]:
    """(N, 4) quaternions of norm 1; as they are where the norm is below `MIN_NORM`."""
    wide = quaternions.astype(np.float64)
    norms = np.linalg.norm(wide, axis=1)
    kept = (np.abs(norms - 1.0) <= UNIT_TOLERANCE) | (norms <= MIN_NORM)
    norms[kept] = 1.0
    return (wide / norms[:, None]).astype(np.float32)


def exponential(logarithms: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear scales of log scales; what overflows becomes infinite and is left out later."""
    with np.errstate(over="ignore", under="ignore"):
        return np.exp(logarithms.astype(np.float64)).astype(np.float32)


def logarithm(scales: NDArray[np.float32]) -> NDArray[np.float32]:
    """Log scales of linear scales > 0."""
    return np.log(scales.astype(np.float64)).astype(np.float32)


def sigmoid(logits: NDArray[np.float32]) -> NDArray[np.float32]:
    """Opacities of logits. Infinite logits, which some exporters write, give exactly 0 or 1."""
    with np.errstate(over="ignore", under="ignore"):
        negative = np.exp(-np.abs(logits.astype(np.float64)))
        small = negative / (1.0 + negative)
    return np.where(logits > 0, 1.0 - small, np.where(np.isnan(logits), np.nan, small)).astype(
        np.float32
    )


def logit(opacities: NDArray[np.float32]) -> NDArray[np.float32]:
    """Finite logits of opacities 0..1; exactly 0 and exactly 1 come back from `sigmoid`."""
    wide = opacities.astype(np.float64)
    with np.errstate(divide="ignore"):
        logits = np.log(wide) - np.log1p(-wide)
    return np.clip(logits, *LOGIT_LIMITS).astype(np.float32)


def rotations_from_three(
    three: NDArray[np.float64], largest: NDArray[np.intp]
) -> NDArray[np.float32]:
    """Rebuild quaternions from their three smallest components.

    Args:
        three: (N, 3) components in the order of the file, without the largest.
        largest: (N,) index 0..3 of the missing component, which is positive.

    Returns:
        (N, 4) components in the order of the file; not a number where the three alone exceed
        norm 1.
    """
    squares = np.sum(three * three, axis=1)
    rows = np.arange(len(three))
    quaternions = np.empty((len(three), 4))
    others = np.array([[j for j in range(4) if j != i] for i in range(4)])
    quaternions[rows[:, None], others[largest]] = three
    quaternions[rows, largest] = np.sqrt(np.where(squares > 1.0, np.nan, 1.0 - squares))
    return quaternions.astype(np.float32)
