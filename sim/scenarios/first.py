"""A first scenario for any room: somebody comes in, pushes what is large and carries what is small.

It is written as the file that a person would write, to be changed by one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from scenes.mesh import PhysicalObject, PhysicalRoom
from sim.navigation.floor import FloorMap, FreeFloor
from sim.navigation.planar import Vector, direction
from sim.scenarios.action_checks import HEAVIEST_KG

ON_FLOOR_M = 0.15
"""Above the lowest object's foot: what stands higher stands on furniture, and is carried."""
PUSHED_M = (0.8, 0.55, 0.35)
"""How far an object is pushed, the farthest first for which there is room."""
BEHIND_M = 0.55
"""Room that somebody needs behind what he pushes: arms and body."""
CARRIED_M = 0.2
"""How far something small is carried along what it stands on; it hardly leaves a table."""
MAX_PUSHED, MAX_CARRIED = 2, 1
CAMERA_M = 1.3
"""Height of the camera on its stand: between table and eyes."""
CAMERA_GAP_M = 0.5
"""Distance of the stand from what may be moved: nobody trips over it."""
ACTION_S = 6.0
"""Time that an action takes with the way there: a room's length at walking pace, and as much."""
BARE_S = 10.0
"""Length of a scenario in which nothing can be moved: one walk through the room."""


def first_scenario(room: PhysicalRoom) -> str:
    """TOML text of a scenario in which the room's objects are moved as far as there is room.

    Args:
        room: what exists; without movable objects somebody only walks through it.

    Raises:
        ValueError: there is no free floor to stand on.
    """
    floor = FloorMap(room)
    if not _inside(floor.bare).free.any():
        raise ValueError(
            f"room {room.name!r}: no free floor in it for anybody to stand on; is its mesh a "
            "room's, with the floor at z = 0?"
        )
    camera = _camera_place(room, floor)
    stands = [(item.world_from_object.translation[:2], _radius(item)) for item in room.objects]
    free = floor.around([*stands, (camera, 0.1)])
    free = _inside(free)
    start = _far_from(free if free.free.any() else _inside(floor.bare), camera)
    walkable = _inside(floor.bare.reachable(start))
    lines = [f"  {action}," for action in _actions(room, floor, walkable, start, camera)]
    count = len(lines)
    duration_s = max(BARE_S, ACTION_S * count)
    middle = np.mean([place for place, _ in stands], axis=0) if stands else start
    turn = math.degrees(math.atan2(*(middle - camera)[::-1]))
    return "\n".join(
        [
            "# A first scenario of this room, to be changed: see docs/scenarios.md",
            f'room = "{room.name}"',
            f"duration_s = {duration_s:.1f}",
            "",
            "[camera]",
            f"position = [{camera[0]:.2f}, {camera[1]:.2f}, {CAMERA_M}]",
            f"facing_deg = {turn:.0f}.0",
            "",
            "[[people]]",
            'id = "local-user"',
            f"start = [{start[0]:.2f}, {start[1]:.2f}]",
            "actions = [",
            *lines,
            "]",
            "",
        ]
    )


def _actions(
    room: PhysicalRoom, floor: FloorMap, walkable: FreeFloor, start: Vector, camera: Vector
) -> list[str]:
    lowest = min((i.world_from_object.translation[2] for i in room.objects), default=0.0)
    by_size = sorted(room.objects, key=lambda item: -float(np.prod(item.box_m)))
    low = [o for o in by_size if o.world_from_object.translation[2] < lowest + ON_FLOOR_M]
    # What is flat for its height does not topple where it is put down.
    flattest = sorted(
        (o for o in by_size if o not in low and o.mass_kg < HEAVIEST_KG),
        key=lambda item: -min(item.box_m[:2]) / item.box_m[2],
    )
    pushed: list[str] = []
    carried: list[str] = []
    for item in low:
        if len(pushed) < MAX_PUSHED:
            goal = _push_goal(item, room.objects, floor, walkable, camera)
            if goal is not None:
                place = f"[{goal[0]:.2f}, {goal[1]:.2f}]"
                pushed.append(f'{{ do = "push", object = "{item.object_id}", to = {place} }}')
    for item in flattest[:MAX_CARRIED]:
        at = item.world_from_object.translation[:2]
        goal = at + CARRIED_M * direction(_open_side(item, room.objects))
        place = f"[{goal[0]:.2f}, {goal[1]:.2f}]"
        carried.append(
            f'{{ do = "carry", object = "{item.object_id}", to = {place}, turn_deg = 40.0 }}'
        )
    back = f'{{ do = "walk", to = [{start[0]:.2f}, {start[1]:.2f}] }}'
    if not (pushed or carried):
        there = _far_from(walkable, start)
        walk = f'{{ do = "walk", to = [{there[0]:.2f}, {there[1]:.2f}] }}'
        return [walk, back]
    return [*pushed, *carried, back]


def _push_goal(
    item: PhysicalObject,
    objects: Sequence[PhysicalObject],
    floor: FloorMap,
    walkable: FreeFloor,
    camera: Vector,
) -> Vector | None:
    """Find where an object can be pushed straight: free ahead, and behind it for the person."""
    pose = item.world_from_object
    at = pose.translation[:2]
    others = [
        (other.world_from_object.translation[:2], _radius(other))
        for other in objects
        if other.object_id != item.object_id
        and other.world_from_object.translation[2] < pose.translation[2] + item.box_m[2]
    ]
    free = floor.around([*others, (camera, CAMERA_GAP_M)])
    for distance in PUSHED_M:
        for quarter in range(4):
            ahead = direction(pose.yaw() + 0.5 * math.pi * quarter)
            half = 0.5 * item.box_m[quarter % 2]
            behind = at - (half + BEHIND_M) * ahead
            is_reached = bool(walkable.free[walkable.cell(behind)])
            if is_reached and free.is_clear(at + half * ahead, at + (half + distance) * ahead):
                return at + distance * ahead
    return None


def _open_side(item: PhysicalObject, objects: Sequence[PhysicalObject]) -> float:
    """Direction from an object in which most room is left to those that stand as high, radians."""
    at = item.world_from_object.translation
    near = [
        other.world_from_object.translation[:2]
        for other in objects
        if other.object_id != item.object_id
        and abs(other.world_from_object.translation[2] - at[2]) < ON_FLOOR_M
    ]
    turns = item.world_from_object.yaw() + 0.25 * math.pi * np.arange(8)
    if not near:
        return float(turns[0])
    gaps = [
        min(float(np.linalg.norm(at[:2] + CARRIED_M * direction(turn) - other)) for other in near)
        for turn in turns
    ]
    return float(turns[int(np.argmax(gaps))])


def _camera_place(room: PhysicalRoom, floor: FloorMap) -> Vector:
    """Free floor beside all objects from which the farthest of them is nearest."""
    own = room.world_from_rig.translation[:2]
    places = [item.world_from_object.translation[:2] for item in room.objects]
    radii = [_radius(item) for item in room.objects]
    bare = _inside(floor.bare)
    centres = bare.centres()[bare.free.ravel()]
    if not places:
        return bare.nearest_free(own)
    away = np.linalg.norm(centres[:, None] - np.stack(places)[None], axis=2)
    clear = (away - np.array(radii)).min(axis=1)
    cost = away.max(axis=1) + 10.0 * np.maximum(CAMERA_GAP_M - clear, 0.0)
    return centres[int(np.argmin(cost))]


def _inside(floor: FreeFloor) -> FreeFloor:
    """Without its outermost cells: nobody starts within a wall's thickness of the room's edge."""
    free = floor.free.copy()
    free[[0, -1], :] = free[:, [0, -1]] = False
    return FreeFloor(free, floor.low_xy)


def _far_from(floor: FreeFloor, place: Vector) -> Vector:
    """The free place farthest from another."""
    centres = floor.centres()[floor.free.ravel()]
    return centres[int(np.argmax(np.linalg.norm(centres - place, axis=1)))]


def _radius(item: PhysicalObject) -> float:
    return 0.5 * float(np.hypot(*item.box_m[:2]))
