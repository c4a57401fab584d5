"""Legs: feet that stay where they stand, and step when the body has moved on."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from scenes.bodies.skeleton import (
    ANKLE_M,
    HIP_ABDUCTION,
    HIP_FLEXION,
    HIP_IN_PELVIS,
    KNEE,
    SHIN_M,
    SIDES,
    THIGH_M,
    mirrored,
)
from scenes.bodies.torso import Torso
from scenes.bodies.vectors import (
    Array,
    about,
    across,
    back,
    cross,
    dot,
    length,
    packed,
    smooth,
    turned,
    unit,
    wrapped,
)

STEP_FROM_M, STEP_FROM_RAD = 0.16, math.radians(32.0)
"""How far a foot may be from where it belongs before it steps: chosen, a third of a foot's
length."""

EVEN = 1e-6
"""Feet whose need for a step differs by less are even, and the left one goes first: rounding does
not decide, which differs from machine to machine."""

STEP_S = 0.34
"""Time of a step, seconds: a walk of 1.4 m/s has 0.40 (Perry, *Gait Analysis*, 1992)."""

STEP_HEIGHT_M = 0.07
"""How high an ankle is lifted, metres."""

STRIDE_M = 0.35
"""Most that a step goes beyond where a foot belongs, metres: the body moves on meanwhile."""

JUMP_M = 1.2
"""A body that is so far from its feet did not walk there, metres: feet are put down at once."""

TOES_OUT_RAD = math.radians(8.0)
"""How far feet turn out."""

HALF_STANCE_M = 0.105
"""Half the distance between ankles of who stands, metres."""

LEG_M = 0.999 * (THIGH_M + SHIN_M)
"""Hip to ankle of a straight leg, metres; a thousandth less, so that a knee has a direction."""

MIN_LEG_M = math.sqrt(THIGH_M**2 + SHIN_M**2 + 2 * THIGH_M * SHIN_M * math.cos(KNEE.high))
"""The same with the knee bent as far as it goes, metres."""

TILTS = 2
"""Times that a pelvis is tilted after its thighs: it takes the hips along, by a centimetre."""


@dataclass(frozen=True, slots=True, eq=False)
class Feet:
    """Feet of N people, metres of the reference person.

    Attributes:
        places: (N, 2, 3) x, y and yaw of where they stand, or came from.
        goals: (N, 2, 3) the same of where a step goes.
        steps: (N, 2) 0..1 of a step; 1 stands.
    """

    places: Array
    goals: Array
    steps: Array

    def at(self) -> Array:
        """Return (N, 2, 4): x, y, height over the floor and yaw."""
        share = smooth(self.steps)[..., None]
        change = self.goals - self.places
        change = np.concatenate([change[..., :2], wrapped(change[..., 2:])], axis=-1)
        place = self.places + share * change
        lift = STEP_HEIGHT_M * np.sin(np.pi * np.clip(self.steps, 0.0, 1.0))
        far = np.minimum(length(change[..., :2]) / 0.2 + np.abs(change[..., 2]), 1.0)
        return packed(place[..., 0], place[..., 1], lift * far, place[..., 2])


def feet_below(middle: Array, facing: Array) -> Array:
    """Return (N, 2, 3) x, y and yaw of feet that stand below a place.

    Args:
        middle: (N, 2) between both feet.
        facing: (N,) radians.
    """
    c, s = np.cos(facing)[:, None], np.sin(facing)[:, None]
    out = HALF_STANCE_M * SIDES
    yaw = facing[:, None] + TOES_OUT_RAD * SIDES
    return packed(middle[:, :1] - s * out, middle[:, 1:] + c * out, yaw)


def standing(middle: Array, facing: Array) -> Feet:
    """Return feet that stand below a place."""
    places = feet_below(middle, facing)
    return Feet(places, places, np.ones(places.shape[:2]))


def stepped(feet: Feet, middle: Array, *, facing: Array, velocity: Array, dt_s: float) -> Feet:
    """Return feet a moment later; of two at most one is in the air unless both are far away.

    Args:
        feet: before.
        middle: (N, 2) where the middle between the feet belongs.
        facing: (N,) yaw of the pelvis, radians.
        velocity: (N, 2) of the body, m/s.
        dt_s: the moment.
    """
    home = feet_below(middle, facing)
    speed = length(velocity)
    pace = STEP_S / (1.0 + 0.6 * np.minimum(speed, 2.5))
    steps = np.minimum(feet.steps + dt_s / pace[:, None], 1.0)
    done = (steps >= 1.0) & (feet.steps < 1.0)
    places = np.where(done[..., None], feet.goals, feet.places)
    moving = steps < 1.0
    # A step in the air still goes where the foot belongs by now, while it is young.
    ahead = velocity * np.minimum(0.9 * pace, STRIDE_M / np.maximum(speed, 1e-6))[:, None]
    aim = home.copy()
    aim[..., :2] += ahead[:, None]
    goals = np.where((moving & (steps < 0.7))[..., None], aim, feet.goals)
    error = length(home[..., :2] - places[..., :2]) / STEP_FROM_M
    error = np.maximum(error, np.abs(wrapped(home[..., 2] - places[..., 2])) / STEP_FROM_RAD)
    error = np.where(moving, 0.0, error)
    is_left = error[:, 0] >= error[:, 1] - EVEN
    worst = np.stack([is_left, ~is_left], axis=1)
    starts = (error > 1.0) & worst & ~moving.any(axis=1, keepdims=True)
    steps = np.where(starts, 0.0, steps)
    goals = np.where(starts[..., None], aim, goals)
    gone = length(home[..., :2] - places[..., :2]).max(axis=1) > JUMP_M
    fresh = gone[:, None]
    return Feet(
        np.where(fresh[..., None], home, places),
        np.where(fresh[..., None], home, goals),
        np.where(fresh, 1.0, steps),
    )


def tilted(torso: Torso, feet: Feet) -> Torso:
    """Return bodies whose pelvis is tilted back where a thigh would be bent further than it goes.

    So people squat: the back leans, the pelvis stays behind. Feet stay where they are.
    """
    for _ in range(TILTS):
        hips, knees, _, _ = _free_legs(torso, feet)
        flexion, _ = hip_angles(torso, unit(knees - hips))
        excess = np.maximum(flexion - HIP_FLEXION.high, 0.0).max(axis=1)
        if not excess.any():
            break
        axes = np.swapaxes(torso.world_from_pelvis, -1, -2)
        level = np.broadcast_to(axes[:, 1:2], axes.shape)
        axes = about(level, -excess[:, None], vector=axes)
        torso = replace(torso, world_from_pelvis=np.swapaxes(axes, -1, -2))
    return torso


def hip_angles(torso: Torso, thighs: Array) -> tuple[Array, Array]:
    """Return flexion and abduction of thighs (N, 2, 3), unit vectors, radians."""
    local = back(torso.world_from_pelvis[:, None], thighs)
    flexion = np.arctan2(local[..., 0], -local[..., 2])
    return flexion, np.arcsin(np.clip(local[..., 1] * SIDES, -1.0, 1.0))


def legs_of(torso: Torso, feet: Feet) -> tuple[Array, Array, Array, Array]:
    """Return hips, knees and ankles (N, 2, 3), and yaws of feet (N, 2).

    A foot that a leg does not reach, or not without turning the hip too far, comes along; under who
    hovers, legs hang.
    """
    hips, knees, ankles, yaw = _free_legs(torso, feet)
    flexion, abduction = hip_angles(torso, unit(knees - hips))
    is_far = (HIP_FLEXION.excess(flexion) + HIP_ABDUCTION.excess(abduction)) > 0.0
    if not is_far.any():
        return hips, knees, ankles, yaw
    flexion, abduction = HIP_FLEXION.clip(flexion), HIP_ABDUCTION.clip(abduction)
    level = np.cos(abduction)
    local = packed(level * np.sin(flexion), SIDES * np.sin(abduction), -level * np.cos(flexion))
    thighs = turned(torso.world_from_pelvis[:, None], local)
    far_knees = hips + THIGH_M * thighs
    far_ankles = far_knees + SHIN_M * _shins(far_knees, thighs, ankles=ankles)
    there = is_far[..., None]
    return hips, np.where(there, far_knees, knees), np.where(there, far_ankles, ankles), yaw


def _shins(knees: Array, thighs: Array, *, ankles: Array) -> Array:
    """Return (N, 2, 3) where shins point: to ankles, not through the floor, not too far bent."""
    way = unit(ankles - knees)
    down = np.clip((ANKLE_M - knees[..., 2]) / SHIN_M, -1.0, 1.0)
    level = np.sqrt(1.0 - down**2)[..., None] * unit(way[..., :2])
    on_floor = packed(level[..., 0], level[..., 1], down)
    way = unit(np.where((way[..., 2] < down)[..., None], on_floor, way))
    bend = np.arctan2(length(cross(thighs, way)), dot(thighs, way))
    lever = across(way, thighs)
    most = np.cos(KNEE.high) * thighs + np.sin(KNEE.high) * lever
    return np.where((bend > KNEE.high)[..., None], most, way)


def _free_legs(torso: Torso, feet: Feet) -> tuple[Array, Array, Array, Array]:
    """Return what `legs_of` does, whatever hips can do."""
    hips = torso.pelvis[:, None] + turned(torso.world_from_pelvis[:, None], mirrored(HIP_IN_PELVIS))
    at = feet.at()
    ankles = packed(at[..., 0], at[..., 1], ANKLE_M + at[..., 2])
    below = hips - (0.0, 0.0, LEG_M)
    hovers = smooth((below[..., 2] - ANKLE_M) / 0.25)[..., None]
    ankles = ankles + hovers * (below - (0.0, 0.0, 0.004) - ankles)
    yaw = at[..., 3]
    ahead = packed(np.cos(yaw), np.sin(yaw), np.zeros_like(yaw))
    left = packed(-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw))
    pole = ahead + 0.08 * SIDES[:, None] * left
    knees, ankles = bent(
        hips, ankles, poles=pole, lengths_m=(THIGH_M, SHIN_M), limits_m=(MIN_LEG_M, LEG_M)
    )
    return hips, knees, ankles, yaw


def bent(
    roots: Array,
    ends: Array,
    *,
    poles: Array,
    lengths_m: tuple[float, float],
    limits_m: tuple[float, float],
) -> tuple[Array, Array]:
    """Return middle joints and reached ends of two-bone limbs that bend towards poles.

    Args:
        roots: (..., 3).
        ends: (..., 3) where the limbs should end.
        poles: (..., 3) directions.
        lengths_m: of both bones.
        limits_m: least and most from root to end.
    """
    first, second = lengths_m
    towards = ends - roots
    axis = unit(towards)
    reach = np.clip(length(towards), *limits_m)
    along = (first**2 - second**2 + reach**2) / (2.0 * reach)
    out = np.sqrt(np.maximum(first**2 - along**2, 0.0))
    side = across(poles + 1e-6 * (dot(poles, axis) > 0.999)[..., None], axis)
    return roots + along[..., None] * axis + out[..., None] * side, roots + reach[..., None] * axis
