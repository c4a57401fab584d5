"""Goals of tasks, judged from where objects stand: a room's layout, a figure of pieces."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from studio.study.plan import Goal, GoalKind, Target

Array = NDArray[np.float64]

MAX_SWAPS = 5040
"""Ways of standing for each other that are tried: seven objects of one kind."""


@dataclass(frozen=True, slots=True)
class Reached:
    """How near a goal is.

    Attributes:
        off_m: distance of each object from its target, by the target's object.
        off_rad: turn of each object from it, likewise; 0 of round ones.
        there: how many are within the goal's tolerance.
        is_met: whether all are.
    """

    off_m: Mapping[str, float]
    off_rad: Mapping[str, float]
    there: int
    is_met: bool


def judged(goal: Goal, poses: Mapping[str, Pose]) -> Reached | None:
    """Return how near a goal is; None where an object is unknown, or the participant says it.

    Objects of one kind may stand for each other. Of all such ways the one counts in which most are
    there, of these the one with the smallest distance in all. A figure may lie anywhere and be
    turned: it is moved onto the targets by the rigid motion of least squares first.

    Args:
        goal: what is wanted.
        poses: `world_from_object` by object id.

    Raises:
        ValueError: too many objects of one kind.
    """
    targets = goal.targets
    if goal.kind is GoalKind.SAID or any(t.object_id not in poses for t in targets):
        return None
    ways = [_way(goal, poses, order=order) for order in _orders(targets)]
    return max(ways, key=lambda way: (way.there, -sum(way.off_m.values())))


def yaw_apart(yaw_rad: float, symmetry: int) -> float:
    """Return the smallest turn between what looks the same so many times in a turn, 0 of round."""
    if symmetry == 0:
        return 0.0
    step = 2.0 * math.pi / symmetry
    return abs((yaw_rad + 0.5 * step) % step - 0.5 * step)


def _orders(targets: Sequence[Target]) -> Iterator[tuple[int, ...]]:
    """Yield which object, by its target's place in the list, stands for each target."""
    kinds: dict[str, list[int]] = {}
    for place, target in enumerate(targets):
        kinds.setdefault(target.kind or f"only {target.object_id}", []).append(place)
    count = math.prod(math.factorial(len(group)) for group in kinds.values())
    if count > MAX_SWAPS:
        raise ValueError(f"goal: {count} ways of standing for each other, at most {MAX_SWAPS}")
    for choice in product(*(permutations(group) for group in kinds.values())):
        order = list(range(len(targets)))
        for group, chosen in zip(kinds.values(), choice, strict=True):
            for place, other in zip(group, chosen, strict=True):
                order[place] = other
        yield tuple(order)


def _way(goal: Goal, poses: Mapping[str, Pose], *, order: tuple[int, ...]) -> Reached:
    targets = goal.targets
    standing = [poses[targets[other].object_id] for other in order]
    places = np.array([pose.translation[:2] for pose in standing])
    yaws = np.array([pose.yaw() for pose in standing])
    wanted = np.array([target.place_m for target in targets])
    if goal.kind is GoalKind.FIGURE:
        places, turn = moved_onto(places, wanted)
        yaws = yaws + turn
    off_m = np.linalg.norm(places - wanted, axis=1)
    off_rad = [
        yaw_apart(float(yaw) - target.yaw_rad, target.symmetry)
        for yaw, target in zip(yaws, targets, strict=True)
    ]
    names = [target.object_id for target in targets]
    there = sum(
        m <= goal.within_m and rad <= goal.within_rad for m, rad in zip(off_m, off_rad, strict=True)
    )
    return Reached(
        dict(zip(names, (float(m) for m in off_m), strict=True)),
        dict(zip(names, off_rad, strict=True)),
        there,
        there == len(targets),
    )


def moved_onto(places: Array, wanted: Array) -> tuple[Array, float]:
    """Return (N, 2) places moved onto others by the rigid motion of least squares, and its turn.

    Raises:
        ValueError: they are not equally many.
    """
    if places.shape != wanted.shape:
        raise ValueError(f"places {places.shape}, wanted {wanted.shape}: not equally many")
    middle, centre = places.mean(axis=0), wanted.mean(axis=0)
    a, b = places - middle, wanted - centre
    cross = float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())
    turn = math.atan2(cross, float((a * b).sum()))
    cos, sin = math.cos(turn), math.sin(turn)
    rotation = np.array([[cos, -sin], [sin, cos]])
    return a @ rotation.T + centre, turn


class GoalWatch:
    """A goal watched over time: it is reached once it was met for as long as it must hold.

    Args:
        goal: what is wanted.
    """

    def __init__(self, goal: Goal) -> None:
        self._goal = goal
        self._since_ns: int | None = None
        self.last: Reached | None = None
        """As it was judged last."""
        self.reached_ns: int | None = None
        """Since when it is met, once it was held for long enough; None before."""

    def look(self, poses: Mapping[str, Pose], t_ns: int) -> bool:
        """Judge it at a moment; return whether it is reached."""
        if self.reached_ns is not None:
            return True
        self.last = judged(self._goal, poses)
        if self.last is None or not self.last.is_met:
            self._since_ns = None
            return False
        since_ns = t_ns if self._since_ns is None else self._since_ns
        self._since_ns = since_ns
        if t_ns - since_ns >= round(self._goal.hold_s * 1e9):
            self.reached_ns = since_ns
        return self.reached_ns is not None
