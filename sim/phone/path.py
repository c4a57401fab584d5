# pyright: standard
"""How somebody walks through a room who films it with a phone: smooth, by hand, everything once.

A lap along the furniture that looks across the room, half a turn, and a smaller lap that looks
outwards at the walls; a lap that looks up at the ceiling; or arcs around the movable objects. Where
a phone can be follows from the plan of the room's solids.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d, minimum_filter1d
from scipy.spatial.transform import Rotation

from scenes.frames import look_at
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose

FloatArray = NDArray[np.float64]

CELL_M = 0.04
CLEARANCE_M = 0.28
"""Around whoever walks upright."""
LOW_THING_M = 0.25
"""A phone is held over what is lower than this."""
DIRECTIONS = 180
ACROSS_SHARE, OUTWARD_SHARE = 0.92, 0.30
"""Shares, from the inner to the outer end of the free floor, at which the two laps run."""
TURN_SHARE = 0.12
"""Part of a lap that the half turn between the laps takes."""
KNOTS = 144
LEAD_RAD = 0.25
"""The phone looks this far ahead of straight across and straight outward."""
WALL_DISTANCE_M = 1.7
"""A blank wall from nearer shows nothing that could be found again in another photo."""
UP_HEIGHT_M, UP_NOD_RAD, UP_SWAY_RAD = 1.5, 0.42, 0.06
"""The phone's height when it looks up, how far up, and how much more and less on the way."""
SHAKE_HZ = (0.7, 1.3, 2.1, 3.4, 5.2)
METRES_PER_RADIAN = 1.6
"""How much walking counts as much as a turn, when the pace is made even."""
ARC_CLEARANCE_M = 0.12
"""Around an arm that holds the phone out: around objects, and past furniture."""
ARC_KNOTS = 48


@dataclass(frozen=True, slots=True)
class HandShake:
    """How unsteady the hand is.

    Attributes:
        position_m: standard deviation of the phone's place on every axis.
        turn_rad: the same of its direction.
    """

    position_m: float = 0.004
    turn_rad: float = 0.006


@dataclass(frozen=True, slots=True, eq=False)
class Walk:
    """Pose of the phone at any time of a walk.

    Attributes:
        duration_s: from the first to the last moment.
        eye: time in seconds -> (3,) world metres.
        target: time in seconds -> (3,) point looked at.
        tremor: time in seconds -> (6,) metres and radians in the phone's axes.
    """

    duration_s: float
    eye: Callable[[float], FloatArray]
    target: Callable[[float], FloatArray]
    tremor: Callable[[float], FloatArray]

    def world_from_camera(self, t_s: float) -> Pose:
        """The phone's pose, OpenCV axes."""
        steady = look_at(self.eye(t_s), self.target(t_s))
        shake = self.tremor(t_s)
        return steady @ Pose(Rotation.from_rotvec(shake[3:]).as_matrix(), shake[:3])


def walk_around(
    room: PhysicalRoom, duration_s: float, rng: np.random.Generator, *, shake: HandShake
) -> Walk:
    """Two laps: one that looks across the room, one that looks at the walls.

    Raises:
        ValueError: there is no floor to walk on around the middle of the room.
    """
    ring = _rings(room)
    start, side = rng.uniform(0, 2 * math.pi), float(rng.choice([-1.0, 1.0]))
    s = np.linspace(0.0, 2.0, KNOTS)
    angle = start + side * 2 * math.pi * s
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turned = _smooth_step((s - 1.0) / TURN_SHARE + 0.5)
    outer, inner = (_radius(radii, angle) for radii in ring)
    stepped_in = _smooth_step((s - 1.0) / (2 * TURN_SHARE) + 1.0)
    radius = outer + (inner - outer) * stepped_in
    middle = room.footprint_m.mean(axis=0)
    sway = 0.05 * np.sin(2 * math.pi * 2.3 * s + rng.uniform(0, 6))
    height = 1.58 - 0.18 * turned + sway
    eye = np.column_stack([middle + radius[:, None] * along, height])
    aside = _aside(room, eye[s > 1.2, :2], angle[s > 1.2], side)
    yaw = angle + side * (math.pi * (1.0 - turned) + LEAD_RAD * (turned - 1.0) + aside * turned)
    nod = np.where(s < 1.0, -0.20, -0.02) + np.where(s < 1.0, 0.07, 0.30) * np.sin(
        2 * math.pi * np.where(s < 1.0, 4.0, 5.0) * s
    )
    nod = gaussian_filter1d(nod, 1.5, mode="nearest")
    gaze = np.column_stack([np.cos(yaw) * np.cos(nod), np.sin(yaw) * np.cos(nod), np.sin(nod)])
    return _paced(eye, eye + 2.0 * gaze, duration_s, rng, shake)


def walk_looking_up(
    room: PhysicalRoom, duration_s: float, rng: np.random.Generator, *, shake: HandShake
) -> Walk:
    """A lap that looks across the room at where the far walls meet the ceiling.

    The walls' tops stay in the picture: a blank ceiling alone could not be placed.

    Raises:
        ValueError: there is no floor to walk on around the middle of the room.
    """
    start, side = rng.uniform(0, 2 * math.pi), float(rng.choice([-1.0, 1.0]))
    s = np.linspace(0.0, 1.0, KNOTS // 2)
    angle = start + side * 2 * math.pi * s
    outer, _ = _rings(room)
    along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    plan = room.footprint_m.mean(axis=0) + _radius(outer, angle)[:, None] * along
    eye = np.column_stack([plan, np.full(len(s), UP_HEIGHT_M)])
    yaw = angle + side * (math.pi - LEAD_RAD)
    nod = UP_NOD_RAD + UP_SWAY_RAD * np.sin(2 * math.pi * 4.0 * s)
    gaze = np.column_stack([np.cos(yaw) * np.cos(nod), np.sin(yaw) * np.cos(nod), np.sin(nod)])
    return _paced(eye, eye + 2.0 * gaze, duration_s, rng, shake)


def walk_by_objects(
    room: PhysicalRoom, duration_s: float, rng: np.random.Generator, *, shake: HandShake
) -> Walk:
    """Close-ups: an arc there and back around every movable object, first high, then low.

    Raises:
        ValueError: the room has no movable object, or one cannot be walked around at all.
    """
    if not room.objects:
        raise ValueError(f"room {room.name!r}: no movable object to film")
    arcs = [_arc(room, item) for item in room.objects]
    eye, target = (np.concatenate([arc[k] for arc in arcs]) for k in (0, 1))
    return _paced(eye, target, duration_s, rng, shake)


def _rings(room: PhysicalRoom) -> tuple[FloatArray, FloatArray]:
    """Radii of the outer and inner lap about the room's middle, by direction, closed."""
    clear, low = _clear_plan(room, LOW_THING_M)
    middle = room.footprint_m.mean(axis=0)
    is_walkable = bool(clear.max() > CLEARANCE_M)
    radii = np.arange(0.0, float(np.linalg.norm(np.ptp(room.footprint_m, axis=0))), CELL_M / 2)
    ends = np.empty((DIRECTIONS, 2))
    for k in range(DIRECTIONS):
        angle = 2 * math.pi * k / DIRECTIONS
        at = middle + radii[:, None] * (math.cos(angle), math.sin(angle))
        room_there = _sampled(clear, low, at)
        free = room_there > CLEARANCE_M
        runs = np.flatnonzero(np.diff(np.concatenate([[0], free, [0]]).astype(int)))
        if len(runs):
            first, last = runs.reshape(-1, 2)[np.argmax(np.diff(runs.reshape(-1, 2), axis=1))]
            ends[k] = radii[first], radii[last - 1]
            continue
        # Past furniture one reaches where most room is.
        widest = int(np.argmax(room_there))
        if not is_walkable or room_there[widest] < ARC_CLEARANCE_M:
            raise ValueError(
                f"room {room.name!r}: no free floor towards {math.degrees(angle):.0f}° from its "
                f"middle, wanted {CLEARANCE_M} m of clearance somewhere"
            )
        ends[k] = radii[widest]
    outer, inner = (
        gaussian_filter1d(minimum_filter1d(radius, 15, mode="wrap"), 8.0, mode="wrap")
        for radius in (
            ends @ (1 - ACROSS_SHARE, ACROSS_SHARE),
            ends @ (1 - OUTWARD_SHARE, OUTWARD_SHARE),
        )
    )
    return np.append(outer, outer[0]), np.append(inner, inner[0])


def _radius(ring: FloatArray, angle: FloatArray) -> FloatArray:
    """Of a closed ring, by direction in radians."""
    known = np.arange(DIRECTIONS + 1) * 2 * math.pi / DIRECTIONS
    return np.interp(angle % (2 * math.pi), known, ring)


def _aside(room: PhysicalRoom, eyes: FloatArray, outward: FloatArray, side: float) -> float:
    """How far aside to look from straight outward, so that the wall seen is not too near."""
    aside = LEAD_RAD
    while aside < 0.5 * math.pi:
        yaw = outward + side * aside
        along = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
        bound = np.where(along > 0, room.footprint_m[1], room.footprint_m[0])
        reach = ((bound - eyes) / np.where(np.abs(along) < 1e-9, 1e-9, along)).min(axis=1)
        if np.percentile(reach, 20) >= WALL_DISTANCE_M:
            break
        aside += 0.05
    return aside


def _arc(room: PhysicalRoom, item: PhysicalObject) -> tuple[FloatArray, FloatArray]:
    """Eyes and targets (K, 3) on the longest free arc around an object."""
    size = float(np.linalg.norm(item.box_m))
    middle = item.world_from_object @ np.array([0.0, 0.0, 0.5 * item.box_m[2]])
    radius = 0.35 + 0.75 * size
    clear, low = _clear_plan(room, float(item.world_from_object.translation[2]) + 0.3)
    angles = 2 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    free = _sampled(clear, low, middle[:2] + radius * around) > ARC_CLEARANCE_M
    if not free.any():
        raise ValueError(
            f"{item.object_id}: nothing free {radius:.2f} m around it, wanted a place to film from"
        )
    if free.all():
        first, count = 0, DIRECTIONS
    else:
        taken = np.flatnonzero(~free)
        gaps = np.diff(np.append(taken, taken[0] + DIRECTIONS))
        widest = int(np.argmax(gaps))
        first, count = (int(taken[widest]) + 1) % DIRECTIONS, int(gaps[widest]) - 1
    there = angles[first] + np.linspace(0, (count - 1) * 2 * math.pi / DIRECTIONS, ARC_KNOTS)
    turn = np.concatenate([there, there[::-1]])
    rise = 0.30 + 0.35 * _smooth_step(np.linspace(2.0, -1.0, len(turn)))
    eye = np.column_stack(
        [
            middle[0] + radius * np.cos(turn),
            middle[1] + radius * np.sin(turn),
            middle[2] + radius * rise * 1.4,
        ]
    )
    return eye, np.broadcast_to(middle, eye.shape)


def _clear_plan(room: PhysicalRoom, above_m: float) -> tuple[FloatArray, FloatArray]:
    """Metres to the nearest wall or solid that reaches above a height, by cell, and the corner."""
    low = room.footprint_m[0]
    columns, rows = np.ceil(np.ptp(room.footprint_m, axis=0) / CELL_M).astype(int)
    free = np.zeros((rows + 2, columns + 2), np.uint8)
    free[1:-1, 1:-1] = 1
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    for solid in room.solids:
        corners = solid.object_from_box @ (signs * solid.half_size_m)
        if corners[:, 2].max() > above_m:
            plan = np.round((corners[:, :2] - low) / CELL_M + 0.5).astype(np.int32)
            cv2.fillConvexPoly(free, cv2.convexHull(plan), 0)
    clear = CELL_M * np.asarray(cv2.distanceTransform(free, cv2.DIST_L2, 5), np.float64)
    return clear, low


def _sampled(clear: FloatArray, low: FloatArray, at: FloatArray) -> FloatArray:
    """(N,) clearance at plan points (N, 2); 0 outside the room."""
    cell = np.floor((at - low) / CELL_M).astype(int) + 1
    outside = np.any((cell < 0) | (cell >= clear.shape[::-1]), axis=1)
    cell[outside] = 0
    return np.where(outside, 0.0, clear[cell[:, 1], cell[:, 0]])


def _paced(
    eye: FloatArray,
    target: FloatArray,
    duration_s: float,
    rng: np.random.Generator,
    shake: HandShake,
) -> Walk:
    """A walk through the knots at an even pace of stepping and turning together."""
    gaze = (target - eye) / np.linalg.norm(target - eye, axis=1, keepdims=True)
    stepped = np.linalg.norm(np.diff(eye, axis=0), axis=1) / METRES_PER_RADIAN
    turned = np.arccos(np.clip((gaze[1:] * gaze[:-1]).sum(axis=1), -1.0, 1.0))
    times = np.concatenate([[0.0], np.cumsum(np.hypot(stepped, turned) + 1e-6)])
    times *= duration_s / times[-1]
    return Walk(
        duration_s, CubicSpline(times, eye), CubicSpline(times, target), _tremor(rng, shake)
    )


def _tremor(rng: np.random.Generator, shake: HandShake) -> Callable[[float], FloatArray]:
    """Band-limited noise: sines of random phase, weaker the faster."""
    hz = np.array(SHAKE_HZ)[:, None] * rng.uniform(0.85, 1.15, (len(SHAKE_HZ), 6))
    phase = rng.uniform(0, 2 * math.pi, hz.shape)
    weight = 1.0 / np.array(SHAKE_HZ)[:, None]
    weight = weight * math.sqrt(2.0) / np.linalg.norm(weight)
    scale = np.array([shake.position_m] * 3 + [shake.turn_rad] * 3)

    def tremor(t_s: float) -> FloatArray:
        return scale * (weight * np.sin(2 * math.pi * hz * t_s + phase)).sum(axis=0)

    return tremor


def _smooth_step(x: FloatArray) -> FloatArray:
    """0 below 0, 1 above 1, smooth between."""
    t = np.clip(x, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
