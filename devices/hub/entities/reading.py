"""Operations that people ask for: each field read and checked."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from devices.hub.entities.drawn import FIELDS, NOTHING, Drawn
from devices.hub.protocol.fields import ID, PERSON, MessageError, read_number, read_text
from devices.hub.protocol.wire import MAX_ROOM_M
from devices.hub.roles import Op
from scenes.pose import Pose
from scenes.quad import quad_of
from scenes.state import PRIMITIVE_SHAPES, PrimitiveShape

MAX_POINTS = 1000
"""Points of a line; chosen: 20 m in steps of 2 cm."""

MIN_SIDE_M, MAX_SIDE_M = 0.02, 3.0
"""Sides of a primitive, metres; chosen: from a marble to a wardrobe that lies down."""

MAX_OBJECT_ID = 80
"""Characters of a tracked object's id."""

MAX_QUATERNION_ERROR = 0.1
"""How far a quaternion's length may be off one; it is made one."""


def read_drawn(op: Op, fields: dict[str, Any]) -> Drawn:
    """Return the entity that an operation is about, its key the client's own, by nobody yet.

    Args:
        op: any but undo and give.
        fields: of the message.

    Raises:
        MessageError: a field is wrong; it says which.
    """
    key = read_key(fields, FIELDS[op])
    match op:
        case Op.LINE:
            line = Drawn(op, key, "", _points(fields), _colour(fields))
            on = _object_id(fields, "on") if len(line.points) else ""
            pose = _pose(fields, "at") if on else line.room_from_entity
            return replace(line, object_id=on, room_from_entity=pose)
        case Op.SURFACE:
            return _surface(key, fields)
        case Op.PRIMITIVE:
            shape = _shape(fields)
            if shape is None:
                return Drawn(op, key, "")
            colour, size, pose = _colour(fields), _size(fields), _pose(fields)
            return Drawn(
                op, key, "", colour=colour, shape=shape, size_m=size, room_from_entity=pose
            )
        case _:
            object_id = _object_id(fields, "object")
            if not object_id:
                return Drawn(op, key, "")
            return Drawn(op, key, "", room_from_entity=_pose(fields), object_id=object_id)


def read_key(fields: dict[str, Any], field: str) -> str:
    """Return a client's name of an entity.

    Raises:
        MessageError: it is none.
    """
    key = read_text(fields, field)
    if not ID.fullmatch(key):
        raise MessageError(f"{field}: wanted 1..40 letters, digits, - _ .")
    return key


def read_person(fields: dict[str, Any], field: str) -> str:
    """Return the id of a person.

    Raises:
        MessageError: it is none.
    """
    person_id = read_text(fields, field)
    if not PERSON.fullmatch(person_id):
        raise MessageError(f"{field}: wanted 1..120 letters, digits, - _ .")
    return person_id


def _surface(key: str, fields: dict[str, Any]) -> Drawn:
    corners, seen = _corners(fields, "corners"), _corners(fields, "seen")
    if len(seen) and not len(corners):
        raise MessageError("seen: wanted corners, too, between which it is filmed")
    if len(seen):
        try:
            quad_of(seen)
        except ValueError:
            raise MessageError("seen: the places span no flat convex quad") from None
    return Drawn(Op.SURFACE, key, "", corners, seen=seen)


def _points(fields: dict[str, Any]) -> NDArray[np.float64]:
    given: object = fields.get("points")
    if given is None:
        return NOTHING
    if not isinstance(given, list):
        raise MessageError("points: wanted a list")
    points = cast(list[Any], given)
    if len(points) > MAX_POINTS:
        raise MessageError(f"points: {len(points)}, at most {MAX_POINTS}")
    return np.array([_place(p, "points") for p in points], dtype=np.float64).reshape(-1, 3)


def _corners(fields: dict[str, Any], field: str) -> NDArray[np.float64]:
    given = fields.get(field)
    if given is None or given == []:
        return NOTHING
    corners = cast(list[Any], given)
    if not isinstance(given, list) or len(corners) != 4:
        raise MessageError(f"{field}: wanted 4 places, or none")
    return np.array([_place(p, field) for p in corners], dtype=np.float64)


def _place(value: object, field: str) -> list[float]:
    if not isinstance(value, list) or len(cast(list[Any], value)) != 3:
        raise MessageError(f"{field}: wanted places of 3 numbers")
    place = [read_number(number, field) for number in cast(list[Any], value)]
    if any(abs(number) > MAX_ROOM_M for number in place):
        raise MessageError(f"{field}: a place is over {MAX_ROOM_M:g} m away")
    return place


def _colour(fields: dict[str, Any]) -> tuple[float, float, float]:
    value = fields.get("colour", [1.0, 1.0, 1.0])
    if not isinstance(value, list) or len(cast(list[Any], value)) != 3:
        raise MessageError("colour: wanted 3 numbers of 0..1")
    r, g, b = (read_number(number, "colour") for number in cast(list[Any], value))
    if not all(0.0 <= part <= 1.0 for part in (r, g, b)):
        raise MessageError("colour: wanted 3 numbers of 0..1")
    return r, g, b


def _shape(fields: dict[str, Any]) -> PrimitiveShape | None:
    value = fields.get("shape")
    if value is None:
        return None
    for shape in PRIMITIVE_SHAPES:
        if value == shape:
            return shape
    raise MessageError(f"shape: wanted one of {', '.join(PRIMITIVE_SHAPES)}, or none to erase it")


def _size(fields: dict[str, Any]) -> tuple[float, float, float]:
    value = fields.get("size")
    wanted = f"size: wanted 3 numbers of {MIN_SIDE_M:g}..{MAX_SIDE_M:g} m"
    if not isinstance(value, list) or len(cast(list[Any], value)) != 3:
        raise MessageError(wanted)
    x, y, z = (read_number(number, "size") for number in cast(list[Any], value))
    if not all(MIN_SIDE_M <= side <= MAX_SIDE_M for side in (x, y, z)):
        raise MessageError(wanted)
    return x, y, z


def _pose(fields: dict[str, Any], field: str = "pose") -> Pose:
    value = fields.get(field)
    if not isinstance(value, list) or len(cast(list[Any], value)) != 7:
        raise MessageError(f"{field}: wanted 7 numbers, place and quaternion x y z w")
    numbers = [read_number(number, field) for number in cast(list[Any], value)]
    place = _place(numbers[:3], field)
    x, y, z, w = numbers[3:]
    length = float(np.linalg.norm([w, x, y, z]))
    if not abs(length - 1.0) <= MAX_QUATERNION_ERROR:
        raise MessageError(f"{field}: wanted a quaternion of length 1")
    return Pose.from_quaternion([w / length, x / length, y / length, z / length], place)


def _object_id(fields: dict[str, Any], field: str) -> str:
    value = fields.get(field)
    if value is None:
        return ""
    if not isinstance(value, str) or not 0 < len(value) <= MAX_OBJECT_ID:
        raise MessageError(f"{field}: wanted an id of 1..{MAX_OBJECT_ID} characters, or none")
    return value
