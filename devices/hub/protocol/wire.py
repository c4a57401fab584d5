"""Head, controllers and hands of a person in bytes, as they travel at a headset's display rate."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose

VERSION = 1
"""Of the layout; others are refused."""

JOINTS = 25
"""Joints of a hand as WebXR names them, wrist first."""


@dataclass(frozen=True, slots=True, eq=False)
class Hand:
    """A tracked hand.

    Attributes:
        joints: (25, 3) metres in the room, y up.
        radii_m: (25,) radius of the skin around each.
    """

    joints: NDArray[np.float64]
    radii_m: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Controller:
    """A controller: where it points from and is held, both in glTF axes; its buttons and axes."""

    room_from_aim: Pose
    room_from_grip: Pose
    buttons: int = 0
    axes: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Body:
    """A person's body at one instant. Poses are in glTF axes: metres, y up, looking along -z.

    Attributes:
        seq: counts a person's bodies.
        t_us: the device's own clock.
        room_from_head: None where it is not known.
        controllers: left, right; None where there is none.
        hands: left, right; None where none is tracked.
        ray: (2, 3) start and end of what they point with, metres; None if they do not point.
    """

    seq: int
    t_us: int
    room_from_head: Pose | None
    controllers: tuple[Controller | None, Controller | None] = (None, None)
    hands: tuple[Hand | None, Hand | None] = (None, None)
    ray: NDArray[np.float64] | None = None


class WireError(ValueError):
    """Bytes that are no body; says which part, and how many bytes were wanted."""


FLAG_HEAD, FLAG_RAY = 1, 32
"""Bits of the flags for the head and the ray."""

FLAG_CONTROLLERS = (2, 4)
"""Bits for the left and the right controller."""

FLAG_HANDS = (8, 16)
"""Bits for the left and the right hand."""

ALL_FLAGS = 63
"""Every bit that means anything; others are refused."""

MAX_ROOM_M = 100.0
"""Distance from the room's origin along an axis, metres; chosen: no room is larger."""

MAX_NORM_ERROR = 0.01
"""Deviation of a quaternion's norm from 1: float32 stays below 1e-6, devices that round below."""

MAX_BODY_BYTES = 574
"""Length with everything in it: 16 + 28 + 2 × 66 + 2 × 187 + 24."""

BODY_KIND, BUNDLE_KIND, PICTURE_KIND = 1, 2, 4
"""Second byte: one body on its way to the hub; several, or a picture, from it."""

MAX_NAME_BYTES = 256
"""Length of a surface's id, chosen: a person's and theirs, far above what anybody types."""

MAX_PICTURE_BYTES = 512 * 1024
"""Length of a JPEG, chosen: 1024 px of a screen full of text take half of it."""

_HEADER = struct.Struct("<BBHIQ")
"""Version, kind, flags, sequence number, device time in microseconds."""

_BUNDLE_HEADER = struct.Struct("<BBH")
"""Version, kind, number of bodies."""

_BUNDLE_ITEM = struct.Struct("<HH")
"""Index of a person, length of their body in bytes."""

_PICTURE_HEADER = struct.Struct("<BBH")
"""Version, kind, length of the surface's id in bytes."""

_POSE = "7f"
"""Place and quaternion x y z w."""

_JOINT = np.dtype([("offset_mm", "<i2", 3), ("radius_mm", "u1")])
"""A joint of a hand, 7 bytes."""

_AXIS_STEPS = 32767
"""Steps of a controller's axis between 0 and 1."""


def encode_body(body: Body) -> bytes:
    """Return a body as bytes, little endian.

    Layout: `u8 version, u8 kind = 1, u16 flags, u32 seq, u64 t_us`, then what the flags (1 head,
    2 and 4 controllers, 8 and 16 hands, 32 ray) name, in this order: head and controllers' poses as
    7 f32 (x y z, qx qy qz qw), a controller as aim, grip, `u16 buttons, 4 i16 axes`; a hand as
    `3 f32` of its wrist, then 25 × (`3 i16` millimetres from the wrist, `u8` radius, millimetres);
    a ray as 6 f32.

    Raises:
        WireError: a number is not finite or does not fit.
    """
    flags = FLAG_HEAD * (body.room_from_head is not None) + FLAG_RAY * (body.ray is not None)
    parts: list[bytes] = []
    if body.room_from_head is not None:
        parts.append(_pose_bytes(body.room_from_head))
    for bit, controller in zip(FLAG_CONTROLLERS, body.controllers, strict=True):
        if controller is not None:
            flags += bit
            parts.append(_controller_bytes(controller))
    for bit, hand in zip(FLAG_HANDS, body.hands, strict=True):
        if hand is not None:
            flags += bit
            parts.append(_hand_bytes(hand))
    if body.ray is not None:
        parts.append(np.asarray(body.ray, dtype="<f4").reshape(6).tobytes())
    try:
        header = _HEADER.pack(VERSION, BODY_KIND, flags, body.seq, body.t_us)
    except struct.error as error:
        raise WireError(f"body {body.seq} at {body.t_us} us: {error}") from error
    data = b"".join((header, *parts))
    check_body(data)
    return data


def check_body(data: bytes) -> int:
    """Return the sequence number of a body that `decode_body` reads; some microseconds.

    Raises:
        WireError: it would not.
    """
    flags, seq, _t_us = _read_header(data)
    numbers = struct.unpack_from(_float_layout(flags), data, _HEADER.size)
    for number in numbers:
        if not -MAX_ROOM_M <= number <= MAX_ROOM_M:
            raise WireError(f"body {seq}: {number} is not within ±{MAX_ROOM_M:g} m")
    for at in _quaternion_places(flags):
        x, y, z, w = numbers[at : at + 4]
        norm = math.sqrt(x * x + y * y + z * z + w * w)
        if not abs(norm - 1.0) <= MAX_NORM_ERROR:
            raise WireError(
                f"body {seq}: quaternion of norm {norm:.4g}, wanted 1 ± {MAX_NORM_ERROR}"
            )
    return seq


def head_only(data: bytes) -> bytes:
    """Return a body, which `check_body` has let through, without all but its head."""
    version, kind, flags, seq, t_us = _HEADER.unpack_from(data)
    kept = flags & FLAG_HEAD
    end = _HEADER.size + struct.calcsize(_float_layout(kept))
    return _HEADER.pack(version, kind, kept, seq, t_us) + data[_HEADER.size : end]


def decode_body(data: bytes) -> Body:
    """Return the body in bytes of somebody else.

    Raises:
        WireError: it is cut short, too long, of another version, or a number is not finite or out
            of a room's range (100 m).
    """
    check_body(data)
    flags, seq, t_us = _read_header(data)
    at = _HEADER.size
    head = None
    if flags & FLAG_HEAD:
        head = _read_pose(data, at)
        at += struct.calcsize(_POSE)
    controllers: list[Controller | None] = [None, None]
    for side, bit in enumerate(FLAG_CONTROLLERS):
        if flags & bit:
            controllers[side] = _read_controller(data, at)
            at += _CONTROLLER_BYTES
    hands: list[Hand | None] = [None, None]
    for side, bit in enumerate(FLAG_HANDS):
        if flags & bit:
            hands[side] = _read_hand(data, at)
            at += _HAND_BYTES
    ray = None
    if flags & FLAG_RAY:
        ray = np.frombuffer(data, "<f4", 6, at).astype(np.float64).reshape(2, 3)
    left, right = controllers
    return Body(seq, t_us, head, (left, right), (hands[0], hands[1]), ray)


def pack_bodies(bodies: Sequence[tuple[int, bytes]]) -> bytes:
    """Return newest bodies as one message from the hub.

    Args:
        bodies: index of a person, their body as it came.

    Raises:
        WireError: more than 65,535 bodies, or an index or a length out of range.
    """
    return join_items([pack_item(index, data) for index, data in bodies])


def pack_item(index: int, data: bytes) -> bytes:
    """Return one body as it is in a message of several.

    Raises:
        WireError: an index or a length out of range.
    """
    try:
        return _BUNDLE_ITEM.pack(index, len(data)) + data
    except struct.error as error:
        raise WireError(f"body of person {index}, {len(data)} bytes: {error}") from error


def join_items(items: Sequence[bytes]) -> bytes:
    """Return packed bodies as one message.

    Raises:
        WireError: more than 65,535.
    """
    try:
        return _BUNDLE_HEADER.pack(VERSION, BUNDLE_KIND, len(items)) + b"".join(items)
    except struct.error as error:
        raise WireError(f"{len(items)} bodies: {error}") from error


def pack_picture(surface_id: str, jpeg: bytes) -> bytes:
    """Return what a live surface shows as one message from the hub.

    Layout: `u8 version, u8 kind = 4, u16 length of the id`, the id in UTF-8, the JPEG to the end.

    Raises:
        WireError: the id or the picture is too long.
    """
    name = surface_id.encode()
    if len(name) > MAX_NAME_BYTES or len(jpeg) > MAX_PICTURE_BYTES:
        raise WireError(
            f"picture of {surface_id[:40]!r}: {len(name)} bytes of id (limit {MAX_NAME_BYTES}), "
            f"{len(jpeg)} of picture (limit {MAX_PICTURE_BYTES}); make it smaller"
        )
    return _PICTURE_HEADER.pack(VERSION, PICTURE_KIND, len(name)) + name + jpeg


def unpack_bodies(data: bytes) -> tuple[tuple[int, bytes], ...]:
    """Return indices of persons and their bodies, not yet decoded.

    Raises:
        WireError: it is cut short, too long or of another version or kind.
    """
    if len(data) < _BUNDLE_HEADER.size:
        raise WireError(f"bodies: {len(data)} bytes, wanted at least {_BUNDLE_HEADER.size}")
    version, kind, count = _BUNDLE_HEADER.unpack_from(data)
    if (version, kind) != (VERSION, BUNDLE_KIND):
        raise WireError(f"bodies: version {version}, kind {kind}; wanted {VERSION}, {BUNDLE_KIND}")
    found: list[tuple[int, bytes]] = []
    at = _BUNDLE_HEADER.size
    for number in range(count):
        if len(data) - at < _BUNDLE_ITEM.size:
            raise WireError(f"bodies: ends in the head of number {number} of {count}")
        index, length = _BUNDLE_ITEM.unpack_from(data, at)
        at += _BUNDLE_ITEM.size
        if length > min(MAX_BODY_BYTES, len(data) - at):
            raise WireError(f"bodies: number {number} of {length} bytes, {len(data) - at} are left")
        found.append((index, data[at : at + length]))
        at += length
    if at != len(data):
        raise WireError(f"bodies: {len(data)} bytes, wanted {at}")
    return tuple(found)


def _read_header(data: bytes) -> tuple[int, int, int]:
    """Return flags, sequence number and device time of a body that is as long as its flags say."""
    if len(data) < _HEADER.size:
        raise WireError(f"body: {len(data)} bytes, wanted at least {_HEADER.size}")
    version, kind, flags, seq, t_us = _HEADER.unpack_from(data)
    if (version, kind) != (VERSION, BODY_KIND):
        raise WireError(f"body: version {version}, kind {kind}; wanted {VERSION}, {BODY_KIND}")
    if flags & ~ALL_FLAGS:
        raise WireError(f"body {seq}: flags {flags:#x}, wanted none beyond {ALL_FLAGS:#x}")
    wanted = _HEADER.size + struct.calcsize(_float_layout(flags))
    if len(data) != wanted:
        raise WireError(f"body {seq}: {len(data)} bytes, wanted {wanted} for flags {flags:#x}")
    return flags, seq, t_us


_CONTROLLER_BYTES = struct.calcsize("<14fH4h")
"""Aim, grip, buttons, axes."""

_HAND_BYTES = 12 + JOINTS * _JOINT.itemsize
"""Wrist and joints."""


@cache
def _float_layout(flags: int) -> str:
    """Return the layout of a body after its header, of which only the floats are read."""
    controllers = sum(bool(flags & bit) for bit in FLAG_CONTROLLERS)
    hands = sum(bool(flags & bit) for bit in FLAG_HANDS)
    return (
        "<"
        + _POSE * bool(flags & FLAG_HEAD)
        + (2 * _POSE + "10x") * controllers
        + f"3f{_HAND_BYTES - 12}x" * hands
        + "6f" * bool(flags & FLAG_RAY)
    )


@cache
def _quaternion_places(flags: int) -> tuple[int, ...]:
    """Return where quaternions begin among the floats of a body."""
    poses = bool(flags & FLAG_HEAD) + 2 * sum(bool(flags & bit) for bit in FLAG_CONTROLLERS)
    return tuple(7 * pose + 3 for pose in range(poses))


def _pose_bytes(pose: Pose) -> bytes:
    w, x, y, z = pose.quaternion().tolist()
    return struct.pack("<7f", *pose.translation.tolist(), x, y, z, w)


def _read_pose(data: bytes, at: int) -> Pose:
    px, py, pz, x, y, z, w = struct.unpack_from("<7f", data, at)
    # Plain numbers: a crowd sends thousands a second, and numpy takes longer to be called.
    s = 2.0 / (x * x + y * y + z * z + w * w)
    rows = (
        (1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)),
    )
    return Pose(np.array(rows), np.array((px, py, pz)))


def _controller_bytes(controller: Controller) -> bytes:
    poses = _pose_bytes(controller.room_from_aim) + _pose_bytes(controller.room_from_grip)
    try:
        steps = [
            max(-_AXIS_STEPS, min(_AXIS_STEPS, round(_AXIS_STEPS * a))) for a in controller.axes
        ]
        return poses + struct.pack("<H4h", controller.buttons, *steps)
    except (struct.error, ValueError, OverflowError) as error:
        raise WireError(
            f"controller: buttons {controller.buttons}, axes {controller.axes}: {error}"
        ) from error


def _read_controller(data: bytes, at: int) -> Controller:
    aim, grip = _read_pose(data, at), _read_pose(data, at + 28)
    buttons, *steps = struct.unpack_from("<H4h", data, at + 56)
    a, b, c, d = (max(-1.0, step / _AXIS_STEPS) for step in steps)
    return Controller(aim, grip, buttons, (a, b, c, d))


def _hand_bytes(hand: Hand) -> bytes:
    if hand.joints.shape != (JOINTS, 3) or hand.radii_m.shape != (JOINTS,):
        raise WireError(
            f"hand: joints {hand.joints.shape}, radii {hand.radii_m.shape}; "
            f"wanted ({JOINTS}, 3), ({JOINTS},)"
        )
    wrist = hand.joints[0].astype("<f4")
    offsets = np.rint(1000.0 * (hand.joints - wrist.astype(np.float64)))
    radii = np.rint(1000.0 * hand.radii_m)
    if not (np.all(np.abs(offsets) <= 32767) and np.all((radii >= 0) & (radii <= 255))):
        raise WireError("hand: a joint over 32 m from its wrist, or a radius not within 0..255 mm")
    joints = np.zeros(JOINTS, dtype=_JOINT)
    joints["offset_mm"], joints["radius_mm"] = offsets, radii
    return wrist.tobytes() + joints.tobytes()


def _read_hand(data: bytes, at: int) -> Hand:
    wrist = np.frombuffer(data, "<f4", 3, at).astype(np.float64)
    joints = np.frombuffer(data, _JOINT, JOINTS, at + 12)
    return Hand(wrist + 0.001 * joints["offset_mm"], 0.001 * joints["radius_mm"])
