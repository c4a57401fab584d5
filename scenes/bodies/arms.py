"""Arms: from shoulders and wrists to elbows and hands, within what joints can do.

The elbow of a two-bone arm lies on a circle around the line from shoulder to wrist. A number of
places on it are scored (natural, within limits, beside the body, outside solids), and the best is
taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.bodies.skeleton import (
    ELBOW,
    FOREARM_M,
    HUMERAL_TWIST,
    PRONATION,
    SHOULDER_AXIS,
    SHOULDER_CONE_DEG,
    SIDES,
    UPPER_ARM_M,
    WRIST_DEVIATION,
    WRIST_FLEXION,
)
from scenes.bodies.vectors import (
    Array,
    about,
    across,
    back,
    cross,
    dot,
    length,
    packed,
    turned,
    unit,
)

SWIVELS = 24
"""Places of an elbow that are scored: 15 degrees apart, and a parabola between them."""

MIN_REACH_M = math.sqrt(
    UPPER_ARM_M**2 + FOREARM_M**2 + 2 * UPPER_ARM_M * FOREARM_M * math.cos(ELBOW.high)
)
"""From shoulder to wrist with the elbow bent as far as it goes, metres."""

MAX_REACH_M = 0.999 * (UPPER_ARM_M + FOREARM_M)
"""The same with a straight arm, metres: a thousandth less, so that there is a plane of the arm."""

OUT_OF_LIMITS, OUT_OF_WRIST, IN_BODY, NEAR_BODY_M = 12.0, 0.8, 25.0, 0.21
"""Weights of a score: a radian beyond a limit of the shoulder, of the wrist, a metre in the body;
and the body's half width at the elbow, metres. Natural is 0 to 2. Chosen by eye."""

_TABLE_RAD = np.radians(SHOULDER_CONE_DEG)
"""The same table in radians."""

_AROUND = np.array([[math.sqrt(0.5), -math.sqrt(0.5), 0.0], [0.0, 0.0, 1.0]])
"""(2, 3) directions across the chest and up, perpendicular to the axis of what an arm reaches."""


@dataclass(frozen=True, slots=True, eq=False)
class Arms:
    """Both arms of N people, metres of the reference person.

    Attributes:
        elbows: (N, 2, 3).
        wrists: (N, 2, 3) where they are.
        hinges: (N, 2, 3) axes that elbows bend about.
        palms: (N, 2, 3, 3) world from the palm's axes.
        pronation: (N, 2) of forearms from thumb up, radians.
        swivels: (N, 2) angle of the elbow from hanging down, radians.
    """

    elbows: Array
    wrists: Array
    hinges: Array
    palms: Array
    pronation: Array
    swivels: Array

    def of(self, rows: NDArray[np.intp]) -> Arms:
        """Return those of some people."""
        return Arms(*(each[rows] for each in self._arrays()))

    def with_rows(self, rows: NDArray[np.intp], others: Arms) -> Arms:
        """Return them with those of some people exchanged."""
        found = tuple(each.copy() for each in self._arrays())
        for each, other in zip(found, others._arrays(), strict=True):
            each[rows] = other
        return Arms(*found)

    def _arrays(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        return (
            self.elbows,
            self.wrists,
            self.hinges,
            self.palms,
            self.pronation,
            self.swivels,
        )


def in_left_axes(vectors: Array) -> Array:
    """Return vectors (..., 2, K, 3) of the chest's axes with those of the right side mirrored."""
    return vectors * _MIRROR


_MIRROR = np.stack([np.ones((1, 3)), np.array([[1.0, -1.0, 1.0]])])
"""(2, 1, 3) factors that make vectors of the right side those of the left."""


def cone_angles(upper: Array) -> tuple[Array, Array]:
    """Return angles of upper arms from the middle of their reach, and direction around it, radians.

    Args:
        upper: (..., 3) unit vectors in the chest's axes, of a left arm.
    """
    side, high = upper @ _AROUND[0], upper @ _AROUND[1]
    angle = np.arctan2(np.hypot(side, high), upper @ SHOULDER_AXIS)
    return angle, np.arctan2(high, side) % (2.0 * np.pi)


def cone_limit(direction: Array) -> Array:
    """Return how far an arm gets in a direction around the middle of its reach, radians."""
    return np.interp(direction, _TABLE_RAD[:, 0], _TABLE_RAD[:, 1])


def twist_of(upper: Array, forearm: Array) -> Array:
    """Return the turn of upper arms about themselves, radians, of left arms, chest's axes."""
    zero = _swung(upper)
    bent = across(forearm, upper)
    return np.arctan2(dot(cross(zero, bent), upper), dot(zero, bent))


def _swung(upper: Array) -> Array:
    """Return the direction across the chest, carried along as an arm swings to `upper`."""
    axis = np.broadcast_to(SHOULDER_AXIS, upper.shape)
    turn = cross(axis, upper)
    sine = length(turn)
    angle = np.arctan2(sine, dot(axis, upper))
    straight = sine < 1e-6
    way = np.where(straight[..., None], (0.0, 0.0, 1.0), turn / np.maximum(sine, 1e-6)[..., None])
    return about(way, angle, vector=np.broadcast_to(_AROUND[0], upper.shape))


def arms_of(
    shoulders: Array,
    wrists: Array,
    *,
    palms: Array,
    chests: Array,
    previous: Array,
    max_turn: float,
    solid_depth: Callable[[Array], Array] | None = None,
) -> Arms:
    """Return both arms.

    Args:
        shoulders: (N, 2, 3).
        wrists: (N, 2, 3) where wrists should be.
        palms: (N, 2, 3, 3) how palms should be held, NaN where that is free.
        chests: (N, 3, 3) world from the chest's axes.
        previous: (N, 2) swivels of a moment ago, NaN before the first.
        max_turn: how far a swivel may go on from there, radians.
        solid_depth: takes points (N, K, 3) and returns (N, K) how deep in solids, or None.
    """
    chest = chests[:, None]
    circle = _circle(back(chest, wrists - shoulders) * _MIRROR[:, 0])
    local_palms = (np.swapaxes(chest, -1, -2) @ palms) * _MIRROR[:, 0, :, None]
    grid: Array = np.broadcast_to(_GRID, (*circle.reach.shape, SWIVELS))
    upper, fore = circle.place(grid)
    score = 1.0 - np.cos(grid) + _strain(upper, fore, palms=local_palms)
    score = score + IN_BODY * np.maximum(_body_depth(upper), 0.0)
    if solid_depth is not None:
        lever = turned(chests[:, None, None], in_left_axes(upper))
        at = shoulders[:, :, None] + UPPER_ARM_M * lever
        depth = solid_depth(at.reshape(len(at), -1, 3)).reshape(score.shape)
        score = score + IN_BODY * depth
    swivel = _lowest(score)
    step = np.clip((swivel - previous + np.pi) % (2 * np.pi) - np.pi, -max_turn, max_turn)
    swivel = np.where(np.isfinite(previous), previous + step, swivel)
    upper, fore = circle.place(swivel[..., None])
    return _within_limits(
        upper[:, :, 0],
        fore[:, :, 0],
        palms=local_palms,
        chest=chest,
        shoulders=shoulders,
        swivels=swivel,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Circle:
    """Places of elbows (N, 2) around lines from shoulders to wrists, left arms' axes.

    Attributes:
        axis: (N, 2, 3) from shoulder to wrist.
        reach: (N, 2) how far, metres.
        along: (N, 2) from the shoulder to the circle's middle, metres.
        out: (N, 2) radius of the circle, metres.
        first: (N, 2, 3) direction of swivel 0.
        second: (N, 2, 3) direction of a right angle.
    """

    axis: Array
    reach: Array
    along: Array
    out: Array
    first: Array
    second: Array

    def place(self, angle: Array) -> tuple[Array, Array]:
        """Return unit vectors of upper arms and forearms (N, 2, K, 3) for swivels (N, 2, K)."""
        c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
        lever = c * self.first[:, :, None] + s * self.second[:, :, None]
        middle = self.along[..., None] * self.axis
        elbow = middle[:, :, None] + self.out[..., None, None] * lever
        wrist = (self.reach[..., None] * self.axis)[:, :, None]
        return elbow / UPPER_ARM_M, (wrist - elbow) / FOREARM_M


def _circle(towards: Array) -> _Circle:
    """Return where elbows can be for vectors from shoulders to wrists (N, 2, 3), metres."""
    distance = length(towards)
    axis = np.where(distance[..., None] > 1e-6, unit(towards), unit(_OUT))
    reach = np.clip(distance, MIN_REACH_M, MAX_REACH_M)
    along = (UPPER_ARM_M**2 - FOREARM_M**2 + reach**2) / (2.0 * reach)
    out = np.sqrt(np.maximum(UPPER_ARM_M**2 - along**2, 0.0))
    first = across(_pole(axis, reach), axis)
    return _Circle(axis, reach, along, out, first, cross(axis, first))


_OUT = np.array([0.5, 0.5, -0.7])
"""(3,) where a hand is put that is in the shoulder, in the chest axes of a left arm."""

_GRID: Array = np.linspace(0.0, 2.0 * np.pi, SWIVELS, endpoint=False)
"""(SWIVELS,) places of an elbow that are scored, radians."""


def _pole(axis: Array, reach: Array) -> Array:
    """Return (N, 2, 3) where elbows like to be, in the chest's axes, of a left arm.

    Down and a little out and back; further out when the hand is high or across the chest or near.
    """
    high = np.clip(axis[..., 2] + 0.2, 0.0, 1.0)
    inwards = np.clip(-axis[..., 1], 0.0, 1.0)
    near = 1.0 - reach / MAX_REACH_M
    down = -1.0 + 0.55 * high
    outwards = 0.32 + 0.55 * high + 0.35 * inwards + 0.25 * near
    behind = -0.40 + 0.30 * high + 0.35 * inwards
    return packed(behind, outwards, down)


def _strain(upper: Array, fore: Array, *, palms: Array) -> Array:
    """Return (N, 2, K) how far joints are beyond their limits, weighted."""
    angle, around = cone_angles(upper)
    found = OUT_OF_LIMITS * np.maximum(angle - cone_limit(around), 0.0)
    found += OUT_OF_LIMITS * HUMERAL_TWIST.excess(twist_of(upper, fore))
    if np.isnan(palms).all():
        return found
    hinge = unit(cross(upper, fore))
    pronation, bend, deviation = _wrist_angles(fore, hinge, palms=palms[:, :, None])
    strain = 0.7 * PRONATION.excess(pronation) + WRIST_FLEXION.excess(bend)
    strain += WRIST_DEVIATION.excess(deviation) + 0.05 * np.abs(pronation)
    return found + OUT_OF_WRIST * np.where(np.isnan(strain), 0.0, strain)


def _body_depth(upper: Array) -> Array:
    """Return (N, 2, K) how deep elbows are in the body, metres."""
    elbow = upper * UPPER_ARM_M + (0.0, 0.175, -0.045)
    inside = NEAR_BODY_M - np.hypot(1.3 * elbow[..., 0], elbow[..., 1])
    return np.where((elbow[..., 2] < 0.02) & (elbow[..., 2] > -0.6), inside, 0.0)


def _lowest(score: Array) -> Array:
    """Return (N, 2) the swivel of the lowest score, by a parabola through it and its neighbours."""
    best = np.argmin(score, axis=-1)[..., None]
    left, middle, right = (
        np.take_along_axis(score, (best + k) % SWIVELS, axis=-1)[..., 0] for k in (-1, 0, 1)
    )
    curve = np.maximum(left - 2.0 * middle + right, 1e-9)
    return (best[..., 0] + np.clip(0.5 * (left - right) / curve, -0.5, 0.5)) * (2 * np.pi / SWIVELS)


def _within_limits(
    upper: Array, fore: Array, *, palms: Array, chest: Array, shoulders: Array, swivels: Array
) -> Arms:
    """Return arms of which every joint is within its limits; no wrist is where it cannot be."""
    angle, around = cone_angles(upper)
    limit = cone_limit(around)
    sine, cosine = np.sin(limit)[..., None], np.cos(limit)[..., None]
    ring = np.cos(around)[..., None] * _AROUND[0] + np.sin(around)[..., None] * _AROUND[1]
    upper = np.where((angle > limit)[..., None], cosine * SHOULDER_AXIS + sine * ring, unit(upper))
    bend = ELBOW.clip(np.arctan2(length(cross(upper, fore)), dot(upper, fore)))
    twist = HUMERAL_TWIST.clip(twist_of(upper, fore))
    lever = about(upper, twist, vector=_swung(upper))
    fore = np.cos(bend)[..., None] * upper + np.sin(bend)[..., None] * lever
    hinge = cross(upper, lever)
    pronation, flexion, deviation = _wrist_angles(fore, hinge, palms=palms)
    free = ~np.isfinite(pronation + flexion + deviation)
    relaxed = np.radians(25.0) + np.radians(40.0) * np.clip(fore[..., 2] + 0.75, 0.0, 1.0)
    pronation = PRONATION.clip(np.where(free, relaxed, pronation))
    flexion = WRIST_FLEXION.clip(np.where(free, 0.06, flexion))
    deviation = WRIST_DEVIATION.clip(np.where(free, 0.0, deviation))
    palm = _palm(fore, hinge, pronation=pronation, flexion=flexion, deviation=deviation)
    world = np.broadcast_to(chest, (*upper.shape[:-1], 3, 3))

    def out(vector: Array) -> Array:
        return turned(world, vector * _MIRROR[:, 0])

    elbows = shoulders + UPPER_ARM_M * out(upper)
    # A mirrored frame turns its y round so that it stays right-handed; so does the hinge, an axis.
    hinges = out(hinge) * SIDES[:, None]
    along, dorsal = out(palm[..., 0]), out(palm[..., 2])
    return Arms(
        elbows=elbows,
        wrists=elbows + FOREARM_M * out(fore),
        hinges=hinges,
        palms=packed(along, cross(dorsal, along), dorsal),
        pronation=pronation,
        swivels=swivels,
    )


def _palm(
    fore: Array, hinge: Array, *, pronation: Array, flexion: Array, deviation: Array
) -> Array:
    """Return palms (..., 3, 3) of a left arm; the inverse of `_wrist_angles`."""
    neutral = -hinge
    dorsal = about(fore, pronation, vector=neutral)
    side = cross(dorsal, fore)
    # y of a left palm points to the little finger.
    ahead = about(dorsal, deviation, vector=fore)
    side = about(dorsal, deviation, vector=side)
    ahead, dorsal = about(side, flexion, vector=ahead), about(side, flexion, vector=dorsal)
    return packed(ahead, side, dorsal)


def _wrist_angles(fore: Array, hinge: Array, *, palms: Array) -> tuple[Array, Array, Array]:
    """Return pronation, flexion and deviation of hands of left arms, radians.

    Args:
        fore: (..., 3) along forearms.
        hinge: (..., 3) axes of elbows.
        palms: (..., 3, 3) with columns ahead, any, back of the hand.
    """
    ahead, dorsal = palms[..., 0], palms[..., 2]
    side = cross(dorsal, ahead)
    # The side's axis is perpendicular to the forearm but for the deviation.
    deviation = -np.arcsin(np.clip(dot(side, fore), -1.0, 1.0))
    flat = unit(side + np.sin(deviation)[..., None] * fore)
    back_of_forearm = cross(fore, flat)
    neutral = -hinge
    pronation = np.arctan2(
        dot(cross(neutral, back_of_forearm), fore), dot(neutral, back_of_forearm)
    )
    straight = about(back_of_forearm, deviation, vector=fore)
    flexion = np.arctan2(dot(cross(straight, ahead), side), dot(straight, ahead))
    return pronation, flexion, deviation
