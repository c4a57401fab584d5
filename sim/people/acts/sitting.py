"""To sit down on something, stay, and stand up again."""

from __future__ import annotations

import math

import numpy as np

from scenes.mesh import PhysicalObject
from scenes.pose import Pose
from sim.bodies import UNIT_BOX_CORNERS
from sim.navigation.planar import bearing, direction
from sim.people.acts.supports import HIGHEST_SEAT_M, support_at, tops_at
from sim.people.acts.walking import face, stand, walk_to
from sim.people.person import TICK_S, Person, Script, Vector
from sim.people.posture import SEAT_BACK_M
from sim.scenarios.actions import Sit

SITTING_DOWN_S = 1.1
USUAL_SEAT_M = 0.45
LOWEST_SEAT_M = 0.25
BACKREST_M = 0.1
"""Height above the seat from which parts are a back and no cushion."""


def sit(person: Person, action: Sit) -> Script:
    """Go before a seat, sit down on it, stay, and stand up."""
    seat, height = _seat(person, action)
    facing = _facing(person, action, seat=seat, height_m=height)
    yield from walk_to(person, seat + SEAT_BACK_M * direction(facing), ignore=action.object)
    yield from face(person, facing)
    person.body.position = seat + SEAT_BACK_M * direction(facing)
    person.body.seat_height_m = height
    yield f"sits down on {action.object or 'a seat'}"
    yield from _lowered(person, begin=0.0, end=1.0)
    yield from stand(action.seconds)
    yield "stands up"
    yield from _lowered(person, begin=1.0, end=0.0)


def stand_up(person: Person) -> Script:
    """From a seat onto the feet; nothing where the person stands."""
    if person.body.seated > 0.0:
        yield from _lowered(person, begin=person.body.seated, end=0.0)


def _lowered(person: Person, *, begin: float, end: float) -> Script:
    ticks = round(SITTING_DOWN_S / TICK_S)
    for k in range(1, ticks + 1):
        t = k / ticks
        person.body.seated = begin + (end - begin) * t * t * (3.0 - 2.0 * t)
        yield None
    person.body.seated = end


def _seat(person: Person, action: Sit) -> tuple[Vector, float]:
    """(x, y) of the seat's middle and its height above the floor."""
    if action.object is None:
        assert action.to is not None
        height = action.seat_height_m
        if height is None:
            height = support_at(person, action.to, highest_m=HIGHEST_SEAT_M)
        return np.array(action.to), height if height > LOWEST_SEAT_M else USUAL_SEAT_M
    item = person.room.object_by_id(action.object)
    pose = person.physics.object_pose(action.object)
    x, y, z = pose.translation
    if action.seat_height_m is not None:
        return np.array([x, y]), z + action.seat_height_m
    tops = [top for top in tops_at(item, pose, (x, y)) if LOWEST_SEAT_M < top < HIGHEST_SEAT_M]
    return np.array([x, y]), max(tops, default=USUAL_SEAT_M)


def _facing(person: Person, action: Sit, *, seat: Vector, height_m: float) -> float:
    """Away from the seat's back; where it has none, towards where the person comes from."""
    if action.face_deg is not None:
        return math.radians(action.face_deg)
    if action.object is not None:
        item = person.room.object_by_id(action.object)
        back = _backrest(item, person.physics.object_pose(action.object), height_m)
        if back is not None:
            return bearing(back, seat)
    return bearing(seat, person.body.position)


def _backrest(item: PhysicalObject, pose: Pose, height_m: float) -> Vector | None:
    """(x, y) of the middle of what rises above the seat, or None where it is no back."""
    total, moment = 0.0, np.zeros(2)
    for part in item.parts:
        corners = pose @ (part.object_from_box @ (UNIT_BOX_CORNERS * np.asarray(part.half_size_m)))
        if corners[:, 2].max() > height_m + BACKREST_M:
            volume = float(np.prod(part.half_size_m))
            total += volume
            moment += volume * corners[:, :2].mean(axis=0)
    if total == 0.0:
        return None
    middle = moment / total
    is_aside = float(np.linalg.norm(middle - pose.translation[:2])) > 0.1 * min(item.box_m[:2])
    return middle if is_aside else None
