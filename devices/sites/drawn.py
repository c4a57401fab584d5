"""Lines and live surfaces as entries of a log: one item each, gone where it has no data."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from devices.sites.channels import MAX_NAME_BYTES, SiteBytesError
from scenes.pose import Pose
from scenes.state import Annotation, LiveSurface

MAX_POINTS = 4_000
"""Points of a line: people send up to 1,000, a session's own may be longer."""

MAX_ROOM_M = 1_000.0
"""Distance along an axis beyond which no point is, metres."""

MAX_SIDE_PX = 8_192
"""Longer side of a surface's picture, pixels."""

DECIMALS = 4
"""Places after the point: a tenth of a millimetre, as people's own lines have."""

LINE, SURFACE = "line:", "surface:"
"""Beginnings of items' names."""

Item = Annotation | LiveSurface
"""A line or a surface."""


def item_name(item: Item) -> str:
    """Return the name of an item in a log."""
    return (
        f"{LINE}{item.annotation_id}"
        if isinstance(item, Annotation)
        else f"{SURFACE}{item.surface_id}"
    )


def pack_item(item: Item) -> bytes:
    """Return an item as it is sent; nothing where it is erased."""
    if isinstance(item, Annotation):
        if not len(item.points_in_world):
            return b""
        fields: dict[str, Any] = {
            "by": item.user_id,
            "points": _rounded(item.points_in_world),
            "colour": [float(part) for part in item.colour],
        }
        if item.world_from_object is not None:
            pose = item.world_from_object.matrix()[:3].tolist()
            fields |= {"on": item.object_id, "at": pose}
    else:
        if not len(item.corners_in_world):
            return b""
        fields = {
            "corners": _rounded(item.corners_in_world),
            "size_px": [int(side) for side in item.size_px],
            "stream": item.stream_id,
        }
    return json.dumps(fields, separators=(",", ":")).encode()


def read_item(name: str, data: bytes) -> Item:
    """Return an item of a log's entry; without points or corners where it is gone.

    Raises:
        SiteBytesError: it is none.
    """
    kind = LINE if name.startswith(LINE) else SURFACE
    key = name.removeprefix(kind)
    if not key or key == name or len(key.encode()) > MAX_NAME_BYTES or not key.isprintable():
        raise SiteBytesError(f"drawn: {name[:40]!r} names neither a line nor a surface")
    if not data:
        nothing = np.zeros((0, 3))
        if kind == LINE:
            return Annotation(key, "", nothing, (1.0, 1.0, 1.0))
        return LiveSurface(key, nothing, (0, 0), "")
    try:
        fields: Any = json.loads(data)
        if kind == LINE:
            red, green, blue = (_number(part, 1.0) for part in _list(fields["colour"]))
            points = _points(fields["points"], range(1, MAX_POINTS + 1))
            line = Annotation(key, _text(fields["by"]), points, (red, green, blue))
            if "on" not in fields:
                return line
            at = _pose(fields["at"])
            return replace(line, object_id=_text(fields["on"]), world_from_object=at)
        corners = _points(fields["corners"], range(4, 5))
        width, height = _list(fields["size_px"])
        size_px = (round(_number(width, MAX_SIDE_PX)), round(_number(height, MAX_SIDE_PX)))
        return LiveSurface(key, corners, size_px, _text(fields["stream"]))
    except SiteBytesError:
        raise
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise SiteBytesError(f"drawn: {name[:40]!r}: {type(error).__name__}") from None


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
