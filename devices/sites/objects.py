"""All objects of a room in one message: whoever has the newest has nothing stale."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable

import numpy as np

from devices.sites.channels import MAX_NAME_BYTES, MAX_OBJECTS, SiteBytesError
from scenes.pose import Pose
from scenes.state import TrackedObject, TrackState

VERSION = 1
"""Of the layout; others are refused."""

MAX_AWAY_M = 1_000.0
"""Distance along an axis beyond which no object is, metres."""

_HEADER = struct.Struct("<BHQ")
"""Version, number of objects, session time in nanoseconds."""

_OBJECT = struct.Struct("<BffQQ7d")
"""State, confidence, visible fraction, capture time, frame, place, quaternion w x y z."""

_STATES: tuple[TrackState, ...] = tuple(TrackState)
"""States by their numbers on the wire."""

_UNKNOWN = np.full((4, 4), np.nan)
"""Covariance elsewhere: it is not sent."""


def pack_objects(objects: Iterable[TrackedObject], t_ns: int) -> bytes:
    """Return all objects of a room at a session time."""
    parts = [_object_bytes(tracked) for tracked in objects]
    return b"".join((_HEADER.pack(VERSION, len(parts), t_ns), *parts))


def read_objects(data: bytes) -> tuple[int, dict[str, bytes]]:
    """Return the session time, and each object's bytes by its id: `read_object` reads those.

    Raises:
        SiteBytesError: they are no objects.
    """
    if len(data) < _HEADER.size:
        raise SiteBytesError(f"objects: {len(data)} bytes, wanted at least {_HEADER.size}")
    version, count, t_ns = _HEADER.unpack_from(data)
    if version != VERSION or count > MAX_OBJECTS or t_ns >= 2**63:
        raise SiteBytesError(f"objects: version {version}, {count} of them; wanted 1, fewer")
    found: dict[str, bytes] = {}
    at = _HEADER.size
    for number in range(count):
        length = data[at] if at < len(data) else 0
        end = at + 1 + length + _OBJECT.size
        if not length or end > len(data):
            raise SiteBytesError(f"objects: number {number} of {count} is cut short")
        try:
            name = data[at + 1 : at + 1 + length].decode()
        except UnicodeDecodeError as error:
            raise SiteBytesError(f"objects: name of number {number}: {error.reason}") from None
        found[name] = data[at + 1 + length : end]
        at = end
    if at != len(data):
        raise SiteBytesError(f"objects: {len(data)} bytes, wanted {at}")
    return t_ns, found


def read_object(object_id: str, data: bytes) -> TrackedObject:
    """Return an object of its bytes; its covariance is not known.

    Raises:
        SiteBytesError: a number is out of range.
    """
    numbers: tuple[float, ...] = _OBJECT.unpack(data)
    state, t_ns, seq = (int(numbers[at]) for at in (0, 3, 4))
    confidence, visible = numbers[1:3]
    x, y, z, qw, qx, qy, qz = numbers[5:]
    norm = math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
    if state >= len(_STATES) or t_ns >= 2**63 or not abs(norm - 1.0) <= 1e-3:
        raise SiteBytesError(f"object {object_id[:40]!r}: state {state}, quaternion of norm {norm}")
    if not all(abs(part) <= MAX_AWAY_M for part in (x, y, z)):
        raise SiteBytesError(f"object {object_id[:40]!r}: a place over {MAX_AWAY_M:g} m away")
    if not (0.0 <= confidence <= 1.0 and 0.0 <= visible <= 1.0):
        raise SiteBytesError(f"object {object_id[:40]!r}: confidence {confidence}, {visible}")
    return TrackedObject(
        object_id,
        t_ns,
        _pose((qw, qx, qy, qz), (x, y, z)),
        _UNKNOWN,
        visible,
        _STATES[state],
        confidence,
        seq,
    )


def _pose(wxyz: tuple[float, float, float, float], place: tuple[float, float, float]) -> Pose:
    """Return a pose, by plain numbers: a room has hundreds a second, and numpy takes longer."""
    w, x, y, z = wxyz
    s = 2.0 / (x * x + y * y + z * z + w * w)
    rows = (
        (1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)),
    )
    return Pose(np.array(rows), np.array(place))


def _object_bytes(tracked: TrackedObject) -> bytes:
    name = tracked.object_id.encode()
    if not 0 < len(name) <= MAX_NAME_BYTES:
        raise ValueError(f"object {tracked.object_id[:40]!r}: a name of {len(name)} bytes")
    pose = tracked.world_from_object
    record = _OBJECT.pack(
        _STATES.index(tracked.state),
        _share(tracked.confidence),
        _share(tracked.visible_fraction),
        tracked.t_ns,
        tracked.source_seq,
        *pose.translation.tolist(),
        *pose.quaternion().tolist(),
    )
    return bytes([len(name)]) + name + record


def _share(value: float) -> float:
    return min(1.0, max(0.0, value)) if math.isfinite(value) else 0.0
