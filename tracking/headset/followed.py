"""A pose through many pictures: fused while they agree, and begun anew once it has changed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracking.headset.corner_fit import Belief, SeenPoints, distance, joined, updated

REFUSED_SIGMAS = 4.265
"""Quantile of a normal distribution for a probability of 1e-5, at which corners that are as far off
are refused; chosen: by chance once in three hours of ten codes a second."""

CONVINCED_PICTURES, CONVINCED_NS = 5, 400_000_000
"""Pictures, and nanoseconds between the first and the last, that must agree on another pose before
it replaces the one that was followed; chosen: a hand before a code, or one false reading, is over
by then, and nobody waits half a second for what jumped."""

FORGOTTEN_NS = 3_000_000_000
"""Time without a picture that agrees after which another pose is dropped."""


@dataclass(frozen=True, slots=True, eq=False)
class Rival:
    """A pose that pictures speak for which contradict the followed one.

    Attributes:
        belief: the pose.
        first_ns: of its first picture.
        pictures: how many agree on it.
    """

    belief: Belief
    first_ns: int
    pictures: int = 1

    @property
    def is_convincing(self) -> bool:
        """Whether it replaces what was followed."""
        lasted = self.belief.t_ns - self.first_ns
        return self.pictures >= CONVINCED_PICTURES and lasted >= CONVINCED_NS


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """A pose that is followed; begin with `Followed()`.

    Attributes:
        belief: the pose; None before the first picture.
        rival: another one that may replace it.
        pictures: how many it was fused from.
        restarts: how often another pose has replaced it.
        seen_ns: when a picture last agreed with it.
    """

    belief: Belief | None = None
    rival: Rival | None = None
    pictures: int = 0
    restarts: int = 0
    seen_ns: int = 0


@dataclass(frozen=True, slots=True)
class Wander:
    """By how much a pose may change by itself in a second: a random walk's standard deviations."""

    turn_rad: float
    shift_m: float

    def later(self, belief: Belief, t_ns: int) -> Belief:
        """Return a belief at a later time."""
        return belief.later(t_ns, turn_rad=self.turn_rad, shift_m=self.shift_m)


def agrees(belief: Belief, seen: SeenPoints) -> bool:
    """Return whether points are where a belief expects them, as far as both are known."""
    # Wilson & Hilferty 1931: the cube root of a sum of squares is nearly normal.
    count = 2.0 * len(seen.points)
    spread = 2.0 / (9.0 * count)
    limit = count * (1.0 - spread + REFUSED_SIGMAS * math.sqrt(spread)) ** 3
    return distance(belief, seen) <= limit


def follow(
    known: Followed,
    seen: Sequence[SeenPoints],
    *,
    t_ns: int,
    first: Belief | None,
    wander: Wander,
) -> tuple[Followed, tuple[bool, ...]]:
    """Return the pose after a picture, and which of its codes agreed with it.

    Args:
        known: the pose so far.
        seen: the codes in the picture; of several, further covariance is left out.
        t_ns: when it was taken.
        first: a pose from this picture alone, to begin with; None where there is none.
        wander: of the pose.
    """
    if not seen:
        return known, ()
    if known.belief is None:
        belief = None if first is None else _fused(first, seen)
        if belief is None:
            return known, (False,) * len(seen)
        return Followed(belief, None, 1, known.restarts, t_ns), (True,) * len(seen)
    expected = wander.later(known.belief, t_ns)
    agreed = tuple(agrees(expected, one) for one in seen)
    if any(agreed):
        belief = _fused(expected, [one for one, is_in in zip(seen, agreed, strict=True) if is_in])
        if belief is not None:
            count = known.pictures + 1
            return Followed(belief, None, count, known.restarts, t_ns), agreed
        return replace(known, belief=expected), agreed
    rival = _rival(known.rival, seen, t_ns=t_ns, first=first, wander=wander)
    if rival is not None and rival.is_convincing:
        count = known.restarts + 1
        return Followed(rival.belief, None, rival.pictures, count, t_ns), (True,) * len(seen)
    return replace(known, belief=expected, rival=rival), agreed


def _rival(
    known: Rival | None,
    seen: Sequence[SeenPoints],
    *,
    t_ns: int,
    first: Belief | None,
    wander: Wander,
) -> Rival | None:
    """Return the other pose after a picture that contradicts the followed one."""
    if known is not None and t_ns - known.belief.t_ns <= FORGOTTEN_NS:
        expected = wander.later(known.belief, t_ns)
        if all(agrees(expected, one) for one in seen):
            belief = _fused(expected, seen)
            if belief is not None:
                return Rival(belief, known.first_ns, known.pictures + 1)
    belief = None if first is None else _fused(first, seen)
    return None if belief is None else Rival(belief, t_ns)


def _fused(belief: Belief, seen: Sequence[SeenPoints]) -> Belief | None:
    """Return a belief with all codes of a picture: their common errors are common."""
    found = updated(belief, seen[0] if len(seen) == 1 else joined(seen))
    if found is None or not np.isfinite(found.covariance).all():
        return None
    return found
