"""Places of movable objects: the floor, tables, half behind furniture, under table tops."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.random_rooms.furniture import UNDER, Stand
from benchmarks.random_rooms.movable import FLOOR, Movable
from benchmarks.random_rooms.outlines import Outline, outline_of, overlaps, upright
from benchmarks.random_rooms.plan import Plan
from scenes.pose import Pose

FloatArray = NDArray[np.float64]

TRIES = 80
"""Places that are tried for an object before it is given up."""

GAP_M = 0.03
"""Least gap between objects, and between an object and furniture."""

RIM_M = 0.01
"""Objects stand at least this far inside the edge of what they stand on."""

BEHIND_SHARE, UNDER_SHARE, NEARBY_SHARE = 0.3, 0.2, 0.3
"""Of the objects on the floor, how many are tried behind something and under a table; of those that
are moved, how many stay within `NEARBY_M` of where they were."""

NEARBY_M = 0.5
"""Farthest that a moved object is nudged; the others go anywhere."""

STAND_HALF_M = 0.3
"""Half the side of the floor that the camera's stand takes: its feet reach 0.28 m."""

MIN_RANGE_M = 0.45
"""Nothing stands nearer to the camera than this, seen from above."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Everything that decides where objects may stand.

    Attributes:
        inside_low: (2,) lowest corner of the free floor, metres.
        inside_high: (2,) highest.
        solids: outlines of all that stays, the camera's stand among it.
        hiding: outlines behind which an object can hide on the floor.
        stands: tables, cabinets, sofas, and the floor under tables.
        camera: (3,) world metres.
    """

    inside_low: FloatArray
    inside_high: FloatArray
    solids: tuple[Outline, ...]
    hiding: tuple[Outline, ...]
    stands: tuple[Stand, ...]
    camera: FloatArray


def ground_of(plan: Plan, camera: FloatArray) -> Ground:
    """The ground of a room whose camera stands at (3,) `camera`."""
    solids = [outline_of(box, Pose.identity()) for box in plan.parts.solids]
    half = STAND_HALF_M
    pole = upright((2 * half, 2 * half, camera[2]), Pose.from_yaw(0.0, (*camera[:2], 0.0)))
    hiding = tuple(o for o in plan.furniture if 0.3 < o.high_m < 1.3)
    margin = 0.03
    return Ground(
        plan.inside.low[:2] + margin,
        plan.inside.high[:2] - margin,
        (*solids, pole),
        hiding,
        plan.stands,
        camera,
    )


def place(
    item: Movable,
    ground: Ground,
    taken: Sequence[Outline],
    rng: np.random.Generator,
    *,
    world_from_near: Pose | None = None,
) -> Pose | None:
    """Somewhere an object can stand without touching anything, or None.

    Args:
        item: what is placed.
        ground: of the room.
        taken: outlines of the objects that stand already.
        rng: decides.
        world_from_near: within `NEARBY_M` of here if given, at the same height.
    """
    on = item.on[int(rng.integers(len(item.on)))]
    way = float(rng.random())
    for attempt in range(TRIES):
        if attempt == TRIES // 2:
            on, way = item.on[int(rng.integers(len(item.on)))], 1.0
        yaw = float(rng.uniform(-math.pi, math.pi))
        if world_from_near is not None:
            shift = rng.uniform(-NEARBY_M, NEARBY_M, 2)
            pose = Pose.from_yaw(yaw, world_from_near.translation + np.array([*shift, 0.0]))
        else:
            pose = _somewhere(item, ground, taken, on=on, way=way, yaw=yaw, rng=rng)
        if pose is not None and is_free(item, pose, ground, taken):
            return pose
    return None


def is_free(
    item: Movable, world_from_object: Pose, ground: Ground, taken: Sequence[Outline]
) -> bool:
    """Whether an object can stand here: carried, inside, and clear of everything."""
    outline = upright(item.box_m, world_from_object)
    if not outline.is_inside(ground.inside_low, ground.inside_high):
        return False
    if float(np.linalg.norm(world_from_object.translation[:2] - ground.camera[:2])) < MIN_RANGE_M:
        return False
    if world_from_object.translation[2] > 0.0 and not _is_carried(outline, ground.stands):
        return False
    return not any(overlaps(outline, other, GAP_M) for other in (*ground.solids, *taken))


def place_all(
    items: Mapping[str, Movable], ground: Ground, rng: np.random.Generator
) -> dict[str, Pose]:
    """A place for every object; those that find none are left out. Large ones choose first."""
    poses: dict[str, Pose] = {}
    taken: list[Outline] = []
    for name in sorted(items, key=lambda n: (-items[n].box_m[0] * items[n].box_m[1], n)):
        pose = place(items[name], ground, taken, rng)
        if pose is not None:
            poses[name] = pose
            taken.append(upright(items[name].box_m, pose))
    return {name: poses[name] for name in items if name in poses}


def rearranged(
    items: Mapping[str, Movable],
    before: Mapping[str, Pose],
    ground: Ground,
    rng: np.random.Generator,
    *,
    share: float,
) -> dict[str, Pose]:
    """The objects after some were moved: nudged and turned, or put somewhere else.

    Args:
        items: by id.
        before: where they stood.
        ground: of the room.
        rng: decides which, and where to.
        share: of the objects that are moved; at least one is tried.
    """
    names = list(before)
    count = max(1, round(share * len(names)))
    movers = [names[int(k)] for k in rng.permutation(len(names))[:count]]
    poses = dict(before)
    for name in movers:
        taken = [upright(items[n].box_m, poses[n]) for n in names if n != name]
        near = before[name] if rng.random() < NEARBY_SHARE else None
        found = place(items[name], ground, taken, rng, world_from_near=near)
        if found is not None:
            poses[name] = found
    return poses


def _somewhere(
    item: Movable,
    ground: Ground,
    taken: Sequence[Outline],
    *,
    on: str,
    way: float,
    yaw: float,
    rng: np.random.Generator,
) -> Pose | None:
    """A place to try; None where the room has nothing of the kind."""
    if on == FLOOR and way < BEHIND_SHARE:
        hiding = [*ground.hiding, *(o for o in taken if o.low_m < 0.01 and o.high_m > 0.3)]
        return _behind(item, hiding, ground.camera, yaw, rng)
    if on == FLOOR and way < BEHIND_SHARE + UNDER_SHARE:
        on = UNDER
    elif on == FLOOR:
        x, y = (float(v) for v in rng.uniform(ground.inside_low, ground.inside_high))
        return Pose.from_yaw(yaw, (x, y, 0.0))
    stands = [s for s in ground.stands if s.kind == on and s.clear_m > item.box_m[2]]
    if not stands:
        return None
    stand = stands[int(rng.integers(len(stands)))]
    x, y = (float(v) for v in rng.uniform(stand.low, stand.high))
    return Pose.from_yaw(yaw, (x, y, stand.z))


def _behind(
    item: Movable,
    hiding: Sequence[Outline],
    camera: FloatArray,
    yaw: float,
    rng: np.random.Generator,
) -> Pose | None:
    """Just behind some furniture or another object as the camera sees it, off to one side."""
    if not hiding:
        return None
    outline = hiding[int(rng.integers(len(hiding)))]
    middle = outline.corners.mean(axis=0)
    away = middle - camera[:2]
    away = away / max(float(np.linalg.norm(away)), 1e-9)
    side = np.array([-away[1], away[0]])
    depth = float((outline.corners @ away).max() - middle @ away)
    half = float((outline.corners @ side).max() - middle @ side)
    reach = 0.5 * max(item.box_m[:2])
    back = depth + reach + float(rng.uniform(0.02, 0.35))
    across = float(rng.uniform(-1.0, 1.0)) * (half + 0.3 * reach)
    x, y = (float(v) for v in middle + back * away + across * side)
    return Pose.from_yaw(yaw, (x, y, 0.0))


def _is_carried(outline: Outline, stands: Sequence[Stand]) -> bool:
    return any(
        abs(stand.z - outline.low_m) < 1e-6
        and outline.is_inside(np.array(stand.low) + RIM_M, np.array(stand.high) - RIM_M)
        for stand in stands
    )
