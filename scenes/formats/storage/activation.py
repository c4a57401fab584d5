"""What splat files store (logarithms, logits, free quaternions) to a `SplatCloud`, and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.formats.storage.blocks import owned
from scenes.formats.storage.error import refusal
from scenes.splats import SplatCloud, validate

UNIT_TOLERANCE = 1e-6
"""A quaternion this near to norm 1 is kept bit by bit, so that what was written is read back."""

damaged_values_are_quiet = np.errstate(invalid="ignore", over="ignore", divide="ignore")
"""Decorates readers: arithmetic on damaged numbers is silent, as they are refused by name later."""

SMALLEST_NORM = 1e-6
"""A quaternion below this norm points nowhere."""

LOGIT_LIMITS = (-110.0, 18.0)
"""Logits whose sigmoid is exactly 0 and exactly 1 in float32."""


def cloud_from_file(
    path: Path,
    *,
    means: NDArray[np.float32],
    scales: NDArray[np.float32],
    quaternions: NDArray[np.float32],
    opacities: NDArray[np.float32],
    sh: NDArray[np.float32],
    start: int = 0,
) -> SplatCloud:
    """A checked cloud of activated values, which it keeps; quaternions are normalised here.

    Args:
        path: the file, for messages.
        means: (N, 3) positions in the file's length unit.
        scales: (N, 3) linear standard deviations.
        quaternions: (N, 4) wxyz of any norm above `SMALLEST_NORM`.
        opacities: (N,) 0..1.
        sh: (N, K, 3) coefficients.
        start: the number of the first of these splats in the file, for messages.

    Raises:
        FormatError: a value is not finite, a scale is not positive, a quaternion has no direction
            or an opacity is outside 0..1.
    """
    cloud = owned(
        means=means,
        scales=scales,
        rotations=unit_quaternions(path, quaternions, start),
        opacities=opacities,
        sh=sh,
    )
    try:
        validate(cloud, str(path), start=start)
    except ValueError as error:
        raise refusal(path, "", _without(str(error), path), "export the file again") from None
    return cloud


def unit_quaternions(
    path: Path, quaternions: NDArray[np.float32], start: int = 0
) -> NDArray[np.float32]:
    """(N, 4) quaternions of norm 1; `start` is the number of the first, for messages.

    Raises:
        FormatError: a norm is not finite or below `SMALLEST_NORM`.
    """
    wide = quaternions.astype(np.float64)
    norms = np.linalg.norm(wide, axis=1)
    bad = ~(np.isfinite(norms) & (norms > SMALLEST_NORM))
    if bad.any():
        first = int(np.argmax(bad))
        raise refusal(
            path,
            f"splat {start + first}",
            f"quaternion norm {norms[first]:g}, wanted finite and > {SMALLEST_NORM:g} "
            f"({int(bad.sum())} of {len(bad)} splats)",
            "export the file again",
        )
    loose = np.abs(norms - 1.0) > UNIT_TOLERANCE
    return np.where(loose[:, None], wide / norms[:, None], wide).astype(np.float32)


def exponential(logarithms: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear scales of log scales; what overflows becomes infinite and is refused later."""
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
    path: Path, three: NDArray[np.float64], largest: NDArray[np.intp], *, start: int
) -> NDArray[np.float32]:
    """Rebuild quaternions from their three smallest components.

    Args:
        path: the file, for messages.
        three: (N, 3) components in the order of the file, without the largest.
        largest: (N,) index 0..3 of the missing component, which is positive.
        start: the number of the first of these splats in the file, for messages.

    Returns:
        (N, 4) components in the order of the file.

    Raises:
        FormatError: the three alone exceed norm 1.
    """
    squares = np.sum(three * three, axis=1)
    bad = squares > 1.0
    if bad.any():
        first = int(np.argmax(bad))
        raise refusal(
            path,
            f"splat {start + first}",
            f"quaternion norm: three components alone have norm {np.sqrt(squares[first]):.3f}, "
            f"limit 1 ({int(bad.sum())} of {len(bad)} splats)",
            "the file is damaged, export it again",
        )
    rows = np.arange(len(three))
    quaternions = np.empty((len(three), 4))
    others = np.array([[j for j in range(4) if j != i] for i in range(4)])
    quaternions[rows[:, None], others[largest]] = three
    quaternions[rows, largest] = np.sqrt(1.0 - squares)
    return quaternions.astype(np.float32)


def _without(message: str, path: Path) -> str:
    return message.removeprefix(f"{path}: ")
