"""Schedules by the share done: learning rates, picture size, how many splats."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scenes.prepare.train.optimiser.rows import LOG_SCALE, LOGIT, MEAN, ROTATION, SH

MEAN_RATE = 5.0e-4
"""Per step and per metre of the typical distance at which the photos see the scene."""
MEAN_DECAY = 0.02
"""Factor by which the mean's rate falls by the end."""
OTHER_RATES = {"log_scale": 0.02, "rotation": 0.006, "logit": 0.05, "colour": 0.012, "sh": 0.0004}
OTHER_DECAY = 0.1
"""Factor by which all other rates fall by the end."""
DECAY_FROM = 0.7
"""From this share on all rates but the mean's fall, to `OTHER_DECAY` at the end."""

QUARTER_UNTIL = 0.04
"""Share done until which pictures have a quarter of their size."""
HALF_UNTIL = 0.14
"""Share done until which they have half of it."""
DENSIFY_EVERY = (20, 100)
"""Steps between two densifications, at least and at most."""
DENSIFICATIONS = 40
"""So many are wanted in all: a slow machine that takes few steps must grow as well."""
FULL_BUDGET_AT = 0.5
"""Share done from which on there are as many splats as allowed."""
DENSIFY_UNTIL = 0.8
"""Share done from which on splats are neither added nor removed."""
PUT_BACK_UNTIL = 0.95
"""Splats are put back on surfaces for longer than they are split."""

PUT_BACK_EVERY = 4
"""Densifications of which one puts splats back: asking every view is slow."""

DEPTH_PRICE = 3.0
"""Of light off the surfaces that stereo has seen, as `Trainee.step` charges it."""
DEPTH_FALL_FROM, DEPTH_FALL = 0.5, 0.1
"""From this share on it falls, to that share of itself at the end: by then splats lie where they
should, and stereo's own errors must not stay in the pictures."""


def depth_price(done: float) -> float:
    """Price of light off the surfaces, at a share of the training."""
    late = max(0.0, (done - DEPTH_FALL_FROM) / (1 - DEPTH_FALL_FROM))
    return DEPTH_PRICE * DEPTH_FALL**late


def rates(done: float, view_distance: float, width: int) -> NDArray[np.float32]:
    """Learning rate of each of the `width` numbers of a row.

    Args:
        done: 0..1 of the training.
        view_distance: typical distance from a camera to what it sees, in the world's unit.
        width: numbers in a row.
    """
    fall = OTHER_DECAY ** max(0.0, (done - DECAY_FROM) / (1 - DECAY_FROM))
    out = np.empty(width, dtype=np.float32)
    out[MEAN] = MEAN_RATE * view_distance * MEAN_DECAY**done
    out[LOG_SCALE] = OTHER_RATES["log_scale"] * fall
    out[ROTATION] = OTHER_RATES["rotation"] * fall
    out[LOGIT] = OTHER_RATES["logit"] * fall
    out[SH] = OTHER_RATES["sh"] * fall
    out[SH.start : SH.start + 3] = OTHER_RATES["colour"] * fall
    return out


def shrink(done: float) -> int:
    """By how much photos are made smaller: 4, then 2, then 1."""
    if done < QUARTER_UNTIL:
        return 4
    return 2 if done < HALF_UNTIL else 1


def densify_after(done: float, iterations: int) -> int:
    """Steps from one densification to the next, when `iterations` steps made `done` of the way."""
    low, high = DENSIFY_EVERY
    return int(np.clip(iterations / max(done, 1e-6) / DENSIFICATIONS, low, high))


def puts_back(iterations: int, since: int) -> bool:
    """Whether a densification, `since` steps after the last, puts splats back on surfaces."""
    return iterations % (PUT_BACK_EVERY * since) < since


def splats_wanted(done: float, start: int, budget: int) -> int:
    """Grows by the same factor per step from `start` to `budget`, which it reaches half-way."""
    if start >= budget:
        return budget
    return round(start * (budget / start) ** min(done / FULL_BUDGET_AT, 1.0))
