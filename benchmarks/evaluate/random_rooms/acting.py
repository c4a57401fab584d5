"""People who move objects in a random room: one carries something, one pushes something else."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.random_rooms.movable import Movable
from benchmarks.random_rooms.outlines import overlaps, upright
from benchmarks.random_rooms.placing import Ground, is_free, place
from scenes.pose import Pose, wrap_angle
from sim.people.posture import (
    FULL_STRIDE_M,
    SIDES,
    Posture,
    bend_to_reach,
    part_poses,
    resting_hand,
)

Vector = NDArray[np.float64]

FRAME_S = 0.1
"""Time between pictures: ten a second, as a rehearsal's camera delivers."""

CARRY_M_S, PUSH_M_S = 1.0, 0.5
"""Speeds of somebody who carries or pushes something, metres a second."""

REACH_FRAMES, LIFT_FRAMES, TURN_FRAMES = 5, 6, 5
"""Pictures that bending down, lifting (and putting down), and turning take."""

HELD_M = 0.95
"""Height of the middle of what is carried."""

CARRIED_KG, CARRIED_M = 6.0, 0.62
"""Heaviest and widest object that one person carries before the body."""

CARRY_REACH_M = (0.8, 2.2)
"""Shortest and farthest way that something is carried; two seconds at most."""

PUSH_REACH_M = (0.5, 1.2)
"""The same for what is pushed."""

BODY_M = 0.42
"""Side of the floor that somebody takes while walking."""

TRIES = 250
"""Ways that are tried before an object is left alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Act:
    """One person's action, frame by frame from its beginning.

    Attributes:
        object_id: what is moved.
        poses: of the object.
        people: limbs of the person, in the order of `sim.people.posture.PART_NAMES`.
    """

    object_id: str
    poses: tuple[Pose, ...]
    people: tuple[tuple[Pose, ...], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """Room and people that an act is planned with.

    Attributes:
        items: by object id.
        poses: where they stand when it begins.
        ground: of the room.
        kept_free: ways of other people, as outlines.
    """

    items: Mapping[str, Movable]
    poses: Mapping[str, Pose]
    ground: Ground
    kept_free: tuple[Vector, ...] = ()

    def others(self, object_id: str) -> list[str]:
        """Every object but this one."""
        return [name for name in self.items if name != object_id]

    def is_walkable(self, start: Vector, end: Vector, but: str) -> bool:
        """Whether somebody can walk from (2,) to (2,) without touching anything but an object."""
        room = self.ground
        taken = [upright(self.items[n].box_m, self.poses[n]) for n in self.others(but)]
        steps = max(2, math.ceil(float(np.linalg.norm(end - start)) / 0.15) + 1)
        for at in np.linspace(start, end, steps):
            body = upright((BODY_M, BODY_M, 1.7), Pose.from_yaw(0.0, (*at, 0.0)))
            if not body.is_inside(room.inside_low, room.inside_high):
                return False
            if any(overlaps(body, other, 0.0) for other in (*room.solids, *taken)):
                return False
            if any(float(np.linalg.norm(at - other)) < 0.7 for other in self.kept_free):
                return False
        return True


def carried(stage: Stage, rng: np.random.Generator) -> Act | None:
    """Somebody takes an object and puts it down elsewhere; None where the room leaves no way."""
    for name in _shuffled(stage, rng, _can_be_carried):
        item, start = stage.items[name], stage.poses[name]
        taken = [upright(stage.items[n].box_m, stage.poses[n]) for n in stage.others(name)]
        reach = 0.5 * max(item.box_m[:2]) + 0.3
        for _ in range(TRIES):
            end = place(item, stage.ground, taken, rng)
            if end is None:
                break
            way = float(np.linalg.norm((end.translation - start.translation)[:2]))
            if not CARRY_REACH_M[0] <= way <= CARRY_REACH_M[1]:
                continue
            first, last = rng.uniform(-math.pi, math.pi, 2)
            a, b = (
                pose.translation[:2] - reach * np.array([math.cos(yaw), math.sin(yaw)])
                for pose, yaw in ((start, first), (end, last))
            )
            # What is carried keeps its turn against the person.
            turned = Pose.from_yaw(start.yaw() + float(last - first), end.translation)
            if is_free(item, turned, stage.ground, taken) and stage.is_walkable(a, b, name):
                return _carry(name, item, (start, turned), (a, b), (float(first), float(last)))
    return None


def pushed(stage: Stage, rng: np.random.Generator) -> Act | None:
    """Somebody pushes an object over the floor; None where the room leaves no way."""
    for name in _shuffled(stage, rng, _can_be_pushed):
        item, start = stage.items[name], stage.poses[name]
        taken = [upright(stage.items[n].box_m, stage.poses[n]) for n in stage.others(name)]
        reach = 0.5 * max(item.box_m[:2]) + 0.3
        for _ in range(TRIES // 4):
            yaw, way = float(rng.uniform(-math.pi, math.pi)), float(rng.uniform(*PUSH_REACH_M))
            turn = float(rng.uniform(-0.6, 0.6))
            ahead = np.array([math.cos(yaw), math.sin(yaw)])
            count = round(way / PUSH_M_S / FRAME_S)
            poses = [
                Pose.from_yaw(
                    start.yaw() + turn * s, start.translation + np.array([*(s * way * ahead), 0.0])
                )
                for s in _eased(count)
            ]
            a = start.translation[:2] - reach * ahead
            if stage.is_walkable(a, a + way * ahead, name) and all(
                is_free(item, pose, stage.ground, taken) for pose in poses
            ):
                return _push(name, item, poses, reach=reach, yaw=yaw)
    return None


def _can_be_carried(item: Movable, pose: Pose) -> bool:
    del pose
    return item.mass_kg <= CARRIED_KG and max(item.box_m[:2]) <= CARRIED_M and item.box_m[2] < 1.1


def _can_be_pushed(item: Movable, pose: Pose) -> bool:
    return float(pose.translation[2]) == 0.0 and 0.25 < item.box_m[2] < 1.25


def _shuffled(
    stage: Stage, rng: np.random.Generator, suits: Callable[[Movable, Pose], bool]
) -> list[str]:
    names = [name for name, item in stage.items.items() if suits(item, stage.poses[name])]
    return [names[int(k)] for k in rng.permutation(len(names))]


def _carry(
    name: str,
    item: Movable,
    ends: tuple[Pose, Pose],
    feet: tuple[Vector, Vector],
    facing: tuple[float, float],
) -> Act:
    """Reach, lift, walk, put down, let go."""
    start, end = ends
    ahead = 0.5 * max(item.box_m[:2]) + 0.2
    held_z = HELD_M - 0.5 * item.box_m[2]
    turn = wrap_angle(facing[1] - facing[0])
    steps = max(
        TURN_FRAMES, math.ceil(float(np.linalg.norm(feet[1] - feet[0])) / CARRY_M_S / FRAME_S)
    )
    poses: list[Pose] = []
    people: list[tuple[Pose, ...]] = []

    def held(position: Vector, yaw: float) -> Pose:
        front = position + ahead * np.array([math.cos(yaw), math.sin(yaw)])
        return Pose.from_yaw(start.yaw() + yaw - facing[0], (*front, held_z))

    def show(
        position: Vector, yaw: float, world_from_object: Pose, grasp: float, walked_m: float = -1.0
    ) -> None:
        poses.append(world_from_object)
        people.append(
            _limbs(position, yaw, item, world_from_object, grasp=grasp, walked_m=walked_m)
        )

    for s in _eased(REACH_FRAMES):
        show(feet[0], facing[0], start, s)
    for s in _eased(LIFT_FRAMES):
        show(feet[0], facing[0], _between(start, held(feet[0], facing[0]), s), 1.0)
    way = float(np.linalg.norm(feet[1] - feet[0]))
    for s in _eased(steps):
        position, yaw = feet[0] + s * (feet[1] - feet[0]), facing[0] + s * turn
        show(position, yaw, held(position, yaw), 1.0, s * way)
    for s in _eased(LIFT_FRAMES):
        show(feet[1], facing[0] + turn, _between(held(feet[1], facing[0] + turn), end, s), 1.0)
    for s in _eased(REACH_FRAMES):
        show(feet[1], facing[1], end, 1.0 - s)
    return Act(name, tuple(poses), tuple(people))


def _push(name: str, item: Movable, poses: Sequence[Pose], *, reach: float, yaw: float) -> Act:
    """Reach, push, let go."""
    ahead = np.array([math.cos(yaw), math.sin(yaw)])
    feet = [pose.translation[:2] - reach * ahead for pose in poses]
    way = [float(np.linalg.norm(at - feet[0])) for at in feet]
    people = [
        *(_limbs(feet[0], yaw, item, poses[0], grasp=s) for s in _eased(REACH_FRAMES)),
        *(_limbs(at, yaw, item, pose, grasp=1.0, walked_m=m)
          for at, pose, m in zip(feet, poses, way, strict=True)),
        *(_limbs(feet[-1], yaw, item, poses[-1], grasp=1.0 - s) for s in _eased(REACH_FRAMES)),
    ]  # fmt: skip
    still = [poses[0]] * REACH_FRAMES
    return Act(name, (*still, *poses, *[poses[-1]] * REACH_FRAMES), tuple(people))


def _limbs(
    position: Vector,
    yaw: float,
    item: Movable,
    pose: Pose,
    *,
    grasp: float,
    walked_m: float = -1.0,
) -> tuple[Pose, ...]:
    """A person with the hands at an object as far as `grasp` (0..1), walking if `walked_m` >= 0."""
    stride = 0.55 * FULL_STRIDE_M if walked_m >= 0.0 else 0.0
    phase = max(walked_m, 0.0) / FULL_STRIDE_M % 1.0
    upright_body = Posture(position, yaw, phase, stride, 0.0, 0.0, np.zeros(3), np.zeros(3))
    facing = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    across = np.array([-facing[1], facing[0], 0.0])
    middle = pose.translation + np.array([0.0, 0.0, min(0.6 * item.box_m[2], 0.85)])
    half = 0.45 * min(item.box_m[:2])
    hands: list[Vector] = []
    for side in SIDES:
        at_object = middle + side * half * across - 0.2 * half * facing
        hands.append((1 - grasp) * resting_hand(upright_body, side) + grasp * at_object)
    lean, crouch = bend_to_reach(position, yaw, hands[0], hands[1])
    return part_poses(Posture(position, yaw, phase, stride, lean, crouch, hands[0], hands[1]))


def _between(a: Pose, b: Pose, share: float) -> Pose:
    """From a to b, turning the short way."""
    yaw = a.yaw() + share * wrap_angle(b.yaw() - a.yaw())
    return Pose.from_yaw(yaw, (1 - share) * a.translation + share * b.translation)


def _eased(count: int) -> list[float]:
    """Shares of a way that begins and ends slowly, the last one 1."""
    s = np.arange(1, count + 1) / count
    return [float(v) for v in s * s * (3 - 2 * s)]
