"""Solver of bodies: heads and hands in, skeletons out; a state and a time step carry on the rest.

Everything between is in the reference person's metres: people are scaled by their eye height.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.bodies.arms import Arms, arms_of
from scenes.bodies.bones import arm_points, laid_out
from scenes.bodies.goals import Goals, pointing_wrists
from scenes.bodies.hands import FINGERS, POINTING, RELAXED
from scenes.bodies.legs import Feet, legs_of, standing, stepped, tilted
from scenes.bodies.skeleton import EYE_M, MAX_EYE_M, MIN_EYE_M, SIDES, Skeleton, mirrored
from scenes.bodies.solids import MAX_DEPTH_M, ROUNDS, SKIN_M, Solids
from scenes.bodies.torso import Torso, head_angles, middle_below, shoulders_of, torso_of
from scenes.bodies.vectors import (
    Array,
    back,
    length,
    smooth,
    turned,
    unit,
    wrapped,
    yaw_rotation,
)

TURN_S = 0.35
"""Time in which a body has made two thirds of a turn after the head, seconds: chosen by eye."""

TURN_FREE_RAD, MAX_TURN_RAD = 0.35, 1.2
"""How far a head turns before the body does, and how far at most without it, radians."""

REACH_S = 0.30
"""Time in which an arm goes to a hand that appears, or hangs down after one that is gone,
seconds."""

GROWTH_M_S = 0.15
"""How fast somebody is taken for taller who is seen higher up, m/s."""

SPEED_S = 0.15
"""Time over which a body's speed is averaged, seconds."""

SWIVEL_RAD_S = 9.0
"""How fast an elbow may swing around the line from shoulder to wrist, rad/s."""

MAX_GAP_S = 0.5
"""A longer time without a body is not bridged by steps: it is laid out anew, seconds."""

HANGING = np.array([0.05, 0.10, -0.54])
"""(3,) wrist of a hanging left arm from the shoulder, metres, as the body faces."""

RETREATS = np.linspace(0.0, 1.0, 13)[1:]
"""Shares of the way back to the chest that are tried with a hand that cannot get out of a solid."""

SAFE_PLACES = np.array([[0.20, 0.04, -0.22], [0.02, 0.12, -0.52], [0.10, 0.14, 0.02]])
"""(3, 3) where those ways end, one tried after the other: before the chest, beside the hip, at the
shoulder; from the left shoulder, metres, in the chest's axes."""


@dataclass(frozen=True, slots=True, eq=False)
class BodyState:
    """Memory of N bodies between two instants.

    Attributes:
        eyes_m: (N,) eye heights, metres.
        facing: (N,) yaw of pelvises, radians.
        feet: of the reference person's size.
        middles: (N, 2) where the middle between the feet belonged, metres of the reference person.
        velocities: (N, 2) of that, m/s.
        swivels: (N, 2) of elbows, radians.
        reaches: (N, 2) share of the way from a hanging hand to where it was seen last.
        wrists: (N, 2, 3) there, from the shoulder, as the body faces.
        fingers: (N, 2, 5, 4) there.
    """

    eyes_m: Array
    facing: Array
    feet: Feet
    middles: Array
    velocities: Array
    swivels: Array
    reaches: Array
    wrists: Array
    fingers: Array


def solve_bodies(
    state: BodyState | None,
    goals: Goals,
    *,
    dt_s: float = 0.0,
    solids: Solids | None = None,
) -> tuple[BodyState, Skeleton]:
    """Return the state after `dt_s`, and the skeletons.

    Args:
        state: before; None lays everybody out anew.
        goals: heads and hands of the same people, in the same order.
        dt_s: time since the state, seconds; more than `MAX_GAP_S` lays everybody out anew.
        solids: what hands stay out of.
    """
    if state is None or not 0.0 <= dt_s <= MAX_GAP_S:
        state, dt_s = fresh_bodies(goals), 0.0
    state = replace(state, eyes_m=_eye_heights(state.eyes_m, goals.eyes[:, 2], dt_s=dt_s))
    scales = state.eyes_m / EYE_M
    eyes = goals.eyes / scales[:, None]
    facing = _facing(state.facing, goals, dt_s=dt_s)
    torso = torso_of(eyes, goals.heads, facing=facing, feet=state.feet.at()[..., :2].mean(axis=1))
    middle = middle_below(torso, facing)
    velocity = state.velocities
    if dt_s > 0.0:
        share = 1.0 - np.exp(-dt_s / SPEED_S)
        velocity = velocity + share * ((middle - state.middles) / dt_s - velocity)
    feet = stepped(state.feet, middle, facing=facing, velocity=velocity, dt_s=dt_s)
    state = replace(state, facing=facing, feet=feet, middles=middle, velocities=velocity)
    torso = tilted(torso, feet)
    state, wrists, angles = _hand_goals(state, goals, torso=torso, scales=scales, dt_s=dt_s)
    clavicles = shoulders_of(torso, wrists)
    solids = solids.grown(SKIN_M) if solids is not None and len(solids.centres) else None
    reach = _Reach(
        goals.palms,
        torso.world_from_chest,
        clavicles[1],
        state.swivels,
        scales,
        SWIVEL_RAD_S * dt_s,
        solids,
    )
    arms = reach.arms(wrists)
    if solids is not None:
        arms = _out_of_solids(reach, arms, angles=angles, solids=solids, scales=scales)
    skeleton = laid_out(
        torso,
        arms,
        clavicles=clavicles,
        legs=legs_of(torso, feet),
        angles=angles,
        scales=scales,
    )
    return replace(state, swivels=arms.swivels), skeleton


def fresh_bodies(goals: Goals) -> BodyState:
    """Return the state of people of whom nothing is known yet: they stand below their heads."""
    count = len(goals.eyes)
    seen = goals.eyes[:, 2]
    eyes_m = np.where((seen >= MIN_EYE_M) & (seen <= MAX_EYE_M), seen, EYE_M)
    eyes = goals.eyes * (EYE_M / eyes_m)[:, None]
    facing = _wanted_facing(goals)
    torso = torso_of(eyes, goals.heads, facing=facing, feet=eyes[:, :2])
    middle = middle_below(torso, facing)
    known = np.isfinite(goals.wrists[..., 0])
    known[:, 1] |= np.isfinite(goals.aims[:, 0])
    return BodyState(
        eyes_m=eyes_m,
        facing=facing,
        feet=standing(middle, facing),
        middles=middle,
        velocities=np.zeros((count, 2)),
        swivels=np.full((count, 2), np.nan),
        reaches=known.astype(np.float64),
        wrists=np.tile(HANGING, (count, 2, 1)),
        fingers=np.broadcast_to(RELAXED, (count, 2, FINGERS, 4)).copy(),
    )


def _eye_heights(known_m: Array, seen_m: Array, *, dt_s: float) -> Array:
    """Return (N,) eye heights: somebody who is seen higher up, and not flying, is taller."""
    taller = np.where(seen_m <= MAX_EYE_M, np.maximum(seen_m, known_m), known_m)
    return np.clip(np.minimum(taller, known_m + GROWTH_M_S * dt_s), MIN_EYE_M, MAX_EYE_M)


def _wanted_facing(goals: Goals) -> Array:
    """Return (N,) yaw that bodies would have: the head's, drawn towards two hands held ahead."""
    yaw, _, _ = head_angles(goals.heads)
    both = goals.wrists.mean(axis=1) - goals.eyes
    offset = wrapped(np.arctan2(both[:, 1], both[:, 0]) - yaw)
    weight = 0.5 * smooth(length(both[:, :2]) / 0.35)
    pull = weight * np.clip(offset, -1.0, 1.0)
    return yaw + np.where(np.isfinite(pull), pull, 0.0)


def _facing(facing: Array, goals: Goals, *, dt_s: float) -> Array:
    yaw, _, _ = head_angles(goals.heads)
    off = wrapped(_wanted_facing(goals) - facing)
    free = np.sign(off) * np.maximum(np.abs(off) - TURN_FREE_RAD, 0.0)
    turned_to = facing + (1.0 - np.exp(-dt_s / TURN_S)) * free
    return yaw + np.clip(wrapped(turned_to - yaw), -MAX_TURN_RAD, MAX_TURN_RAD)


def _hand_goals(
    state: BodyState, goals: Goals, *, torso: Torso, scales: Array, dt_s: float
) -> tuple[BodyState, Array, Array]:
    """Return the state, where wrists go (N, 2, 3) in the reference person's metres, and fingers."""
    body = yaw_rotation(state.facing)
    shoulders = shoulders_of(torso, torso.neck[:, None] - (0.0, 0.0, 1.0) + np.zeros((1, 2, 3)))[1]
    seen = goals.wrists / scales[:, None, None]
    seen = seen - (goals.grips_m / scales[:, None])[..., None] * unit(seen - shoulders)
    points = np.isfinite(goals.aims[:, 0]) & np.isnan(seen[:, 1, 0])
    aims = pointing_wrists(goals.aims / scales[:, None], shoulders[:, 1])
    seen[:, 1] = np.where(points[:, None], aims, seen[:, 1])
    known = np.isfinite(seen[..., 0])
    local = back(body[:, None], seen - shoulders)
    last = np.where(known[..., None], local, state.wrists)
    angles = np.where(np.isfinite(goals.fingers), goals.fingers, state.fingers)
    angles[:, 1] = np.where(points[:, None, None], POINTING, angles[:, 1])
    change = np.where(known, dt_s / REACH_S, -dt_s / REACH_S)
    reaches = np.clip(state.reaches + change, 0.0, 1.0)
    ahead = np.vecdot(state.feet.at()[..., :2], body[:, None, :2, 0])
    swing = 0.35 * (ahead[:, :1] - ahead[:, 1:]) * -SIDES
    hanging = mirrored(HANGING) + np.zeros_like(local)
    hanging[..., 0] += swing
    hanging[..., 2] += 0.5 * np.abs(swing) ** 2
    share = smooth(reaches)[..., None]
    wrists = shoulders + turned(body[:, None], hanging + share * (last - hanging))
    angles = RELAXED + share[..., None] * (angles - RELAXED)
    after = replace(state, reaches=reaches, wrists=last)
    return after, wrists, angles


@dataclass(frozen=True, slots=True, eq=False)
class _Reach:
    """Arms of N people but for where their wrists go, metres of the reference person."""

    palms: Array
    chests: Array
    shoulders: Array
    swivels: Array
    scales: Array
    max_turn: float
    solids: Solids | None

    def arms(self, wrists: Array) -> Arms:
        """Return arms that go there, with elbows outside solids where there is such a way."""
        return arms_of(
            self.shoulders,
            wrists,
            palms=self.palms,
            chests=self.chests,
            previous=self.swivels,
            max_turn=self.max_turn,
            solid_depth=None if self.solids is None else self._depths,
        )

    def _depths(self, points: Array) -> Array:
        assert self.solids is not None
        return self.solids.depths(points * self.scales[:, None, None])

    def of(self, rows: NDArray[np.intp]) -> _Reach:
        """Return those of some people."""
        return _Reach(
            self.palms[rows],
            self.chests[rows],
            self.shoulders[rows],
            self.swivels[rows],
            self.scales[rows],
            self.max_turn,
            self.solids,
        )


def _out_of_solids(
    reach: _Reach, arms: Arms, *, angles: Array, solids: Solids, scales: Array
) -> Arms:
    """Return arms of which no hand is in a solid by more than `MAX_DEPTH_M`."""
    sizes = scales[:, None, None, None]
    depth = solids.depths(arm_points(arms, angles) * sizes).max(axis=-1)
    rows = np.flatnonzero((depth > 0.5 * MAX_DEPTH_M).any(axis=1))
    if not len(rows):
        return arms
    moved = _moved_out(
        reach.of(rows), arms.of(rows), angles=angles[rows], solids=solids, sizes=sizes[rows]
    )
    return arms.with_rows(rows, moved)


def _moved_out(reach: _Reach, arms: Arms, *, angles: Array, solids: Solids, sizes: Array) -> Arms:
    """Return arms pushed out of solids; where that does not help, drawn back to the chest."""
    wrists = arms.wrists.copy()
    for _ in range(ROUNDS):
        points = arm_points(arms, angles) * sizes
        depth = solids.depths(points).max(axis=-1)
        if depth.max() <= 0.5 * MAX_DEPTH_M:
            return arms
        shift = solids.pushes(points.reshape(-1, *points.shape[2:])).reshape(-1, 2, 3)
        moved = (depth > 0.0)[..., None]
        wrists = np.where(moved, arms.wrists + shift / sizes[..., 0], wrists)
        arms = reach.arms(wrists)
    for safe in SAFE_PLACES:
        end = reach.shoulders + turned(reach.chests[:, None], mirrored(safe))
        start = arms.wrists
        for share in RETREATS:
            deep = solids.depths(arm_points(arms, angles) * sizes).max(axis=-1) > MAX_DEPTH_M
            if not deep.any():
                return arms
            wrists = np.where(deep[..., None], start + share * (end - start), wrists)
            arms = reach.arms(wrists)
        # A hand that is in the way however near it is may be held in another way.
        reach = replace(reach, palms=np.full_like(reach.palms, np.nan))
    return arms
