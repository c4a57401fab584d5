"""Lines, live surfaces and shapes as entries of a log: one item each, gone without data."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from devices.sites.channels import MAX_NAME_BYTES, SiteBytesError
from scenes.pose import Pose
from scenes.state import (
    PRIMITIVE_SHAPES,
    Annotation,
    LiveSurface,
    PrimitiveShape,
    SharedPrimitive,
    id_of,
    is_there,
)

MAX_POINTS = 4_000
"""Points of a line: people send up to 1,000, a session's own may be longer."""

MAX_ROOM_M = 1_000.0
"""Distance along an axis beyond which no point is, metres."""

MAX_SIDE_PX = 8_192
"""Longer side of a surface's picture, pixels."""

MAX_SIDE_M = 100.0
"""Longest side of a shape, metres, chosen: people's have up to 3 m, a session's own more."""

DECIMALS = 4
"""Places after the point: a tenth of a millimetre, as people's own lines have."""

LINE, SURFACE, SHAPE = "line:", "surface:", "shape:"
"""Beginnings of items' names."""

Item = Annotation | LiveSurface | SharedPrimitive
"""A line, a surface or a shape."""

NOTHING = np.zeros((0, 3))
"""Points and corners of what is gone."""

_KINDS: Mapping[type, str] = {Annotation: LINE, LiveSurface: SURFACE, SharedPrimitive: SHAPE}
"""Beginnings of names by kind."""


def item_name(item: Item) -> str:
    """Return the name of an item in a log."""
    return f"{_KINDS[type(item)]}{id_of(item)}"


def ended(item: Item) -> Item:
    """Return the end of an item."""
    match item:
        case Annotation():
            return replace(item, points_in_world=NOTHING)
        case LiveSurface():
            return replace(item, corners_in_world=NOTHING)
        case SharedPrimitive():
            return replace(item, shape=None)


def pack_item(item: Item) -> bytes:
    """Return an item as it is sent; nothing where it is erased."""
    if not is_there(item):
        return b""
    fields: dict[str, Any]
    match item:
        case Annotation():
            fields = {
                "by": item.user_id,
                "points": _rounded(item.points_in_world),
                "colour": [float(part) for part in item.colour],
            }
            if item.world_from_object is not None:
                fields |= {"on": item.object_id, "at": _rows(item.world_from_object)}
        case LiveSurface():
            fields = {
                "corners": _rounded(item.corners_in_world),
                "size_px": [int(side) for side in item.size_px],
                "stream": item.stream_id,
            }
        case SharedPrimitive():
            fields = {
                "by": item.user_id,
                "shape": item.shape,
                "size_m": [float(side) for side in item.size_m],
                "colour": [float(part) for part in item.colour],
                "at": _rows(item.world_from_primitive),
            }
    return json.dumps(fields, separators=(",", ":")).encode()


def read_item(name: str, data: bytes) -> Item:
    """Return an item of a log's entry; without points or corners where it is gone.

    Raises:
        SiteBytesError: it is none.
    """
    kind = next((each for each in _KINDS.values() if name.startswith(each)), "")
    key = name.removeprefix(kind)
    if not kind or not key or len(key.encode()) > MAX_NAME_BYTES or not key.isprintable():
        raise SiteBytesError(f"drawn: {name[:40]!r} names no line, surface or shape")
    try:
        fields: Any = json.loads(data) if data else None
        if kind == LINE:
            return _line(key, fields)
        return _surface(key, fields) if kind == SURFACE else _shape(key, fields)
    except SiteBytesError:
        raise
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise SiteBytesError(f"drawn: {name[:40]!r}: {type(error).__name__}") from None


def _line(key: str, fields: Any) -> Annotation:
    if fields is None:
        return Annotation(key, "", NOTHING, (1.0, 1.0, 1.0))
    points = _points(fields["points"], range(1, MAX_POINTS + 1))
    line = Annotation(key, _text(fields["by"]), points, _colour(fields["colour"]))
    if "on" not in fields:
        return line
    return replace(line, object_id=_text(fields["on"]), world_from_object=_pose(fields["at"]))


def _surface(key: str, fields: Any) -> LiveSurface:
    if fields is None:
        return LiveSurface(key, NOTHING, (0, 0), "")
    corners = _points(fields["corners"], range(4, 5))
    width, height = _list(fields["size_px"])
    size_px = (round(_number(width, MAX_SIDE_PX)), round(_number(height, MAX_SIDE_PX)))
    return LiveSurface(key, corners, size_px, _text(fields["stream"]))


def _shape(key: str, fields: Any) -> SharedPrimitive:
    if fields is None:
        return SharedPrimitive(key, "", None, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), Pose.identity())
    shape: PrimitiveShape | None = next((s for s in PRIMITIVE_SHAPES if s == fields["shape"]), None)
    x, y, z = (_number(side, MAX_SIDE_M) for side in _list(fields["size_m"]))
    if shape is None or not min(x, y, z) > 0.0:
        wanted = f"one of {', '.join(PRIMITIVE_SHAPES)}, of sides over 0 m"
        raise SiteBytesError(f"drawn: {key[:40]!r} is no shape, wanted {wanted}")
    colour, pose = _colour(fields["colour"]), _pose(fields["at"])
    return SharedPrimitive(key, _text(fields["by"]), shape, (x, y, z), colour, pose)


def _colour(value: object) -> tuple[float, float, float]:
    red, green, blue = (_number(part, 1.0) for part in _list(value))
    return red, green, blue


def _rows(pose: Pose) -> list[list[float]]:
    return pose.matrix()[:3].tolist()


def _rounded(points: NDArray[np.float64]) -> list[list[float]]:
    return np.round(np.asarray(points, dtype=np.float64), DECIMALS).tolist()


def _points(value: object, counts: range) -> NDArray[np.float64]:
    rows = _list(value)
    if len(rows) not in counts:
        raise SiteBytesError(f"drawn: {len(rows)} points, wanted {counts[0]} to {counts[-1]}")
    found = [[_number(part, MAX_ROOM_M) for part in _list(row)] for row in rows]
    if any(len(row) != 3 for row in found):
        raise SiteBytesError("drawn: a point is not of 3 numbers")
    return np.array(found, dtype=np.float64)


def _pose(value: object) -> Pose:
    rows = [[_number(part, MAX_ROOM_M) for part in _list(row)] for row in _list(value)]
    if [len(row) for row in rows] != [4, 4, 4]:
        raise SiteBytesError("drawn: a pose is not of 3 rows of 4 numbers")
    return Pose.from_matrix(np.array([*rows, [0.0, 0.0, 0.0, 1.0]]))


def _list(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise SiteBytesError("drawn: wanted a list")
    return cast(list[Any], value)


def _number(value: object, limit: float) -> float:
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        raise SiteBytesError("drawn: wanted a number")
    if not abs(value) <= limit or not math.isfinite(value):
        raise SiteBytesError(f"drawn: {value}, wanted at most {limit:g}")
    return float(value)


def _text(value: object) -> str:
    if not isinstance(value, str) or len(value) > MAX_NAME_BYTES or not value.isprintable():
        raise SiteBytesError("drawn: wanted a short text")
    return value
