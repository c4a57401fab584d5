"""Adam for the splats that a picture shows, in numpy; the twin of the native crate's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.train.optimiser.rows import TrainingRows

BETA_FIRST = 0.9
BETA_SECOND = 0.999
EPSILON = 1e-15
"""As in 3D Gaussian splatting; every splat counts its own steps, so that new ones start at full
length (Kingma and Ba 2015, algorithm 1)."""


def step(
    rows: TrainingRows,
    gradient: NDArray[np.float64],
    is_seen: NDArray[np.bool_],
    rates: NDArray[np.float32],
) -> TrainingRows:
    """Rows after one step; those not seen stay as they are.

    Args:
        rows: N splats.
        gradient: (N, 11 + 3K) of the loss by every number.
        is_seen: (N,).
        rates: (11 + 3K,) learning rates.
    """
    seen = np.flatnonzero(is_seen)
    slope = gradient[seen]
    steps = rows.steps.copy()
    steps[seen] += 1
    first = rows.first.astype(np.float64)
    second = rows.second.astype(np.float64)
    first[seen] = BETA_FIRST * first[seen] + (1 - BETA_FIRST) * slope
    second[seen] = BETA_SECOND * second[seen] + (1 - BETA_SECOND) * slope**2
    count = steps[seen, None].astype(np.float64)
    towards = first[seen] / (1 - BETA_FIRST**count)
    size = np.sqrt(second[seen] / (1 - BETA_SECOND**count))
    values = rows.values.astype(np.float64)
    values[seen] -= rates * towards / (size + EPSILON)
    return TrainingRows(
        values.astype(np.float32),
        first.astype(np.float32),
        second.astype(np.float32),
        steps,
        rows.error,
    )
