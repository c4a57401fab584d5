"""Remote configuration, port 3809: questions and settings, each a command byte and its values."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from devices.hololens.wire.taking import Take, WireError, checked_count, taken

Values = tuple[Any, ...]


class Setting(IntEnum):
    """Commands."""

    VERSION = 0x00
    UTC_OFFSET = 0x01
    MARKER_STATE = 0x02
    VIDEO_STATUS = 0x03
    FOCUS = 0x04
    TEMPORAL_DENOISING = 0x05
    WHITE_BALANCE_PRESET = 0x06
    WHITE_BALANCE_VALUE = 0x07
    EXPOSURE = 0x08
    EXPOSURE_PRIORITY = 0x09
    ISO_SPEED = 0x0A
    BACKLIGHT = 0x0B
    SCENE_MODE = 0x0C
    FLAT_MODE = 0x0D
    EYE_SELECTION = 0x0E
    OPTIMIZATION = 0x0F
    PRIMARY_USE = 0x10
    OPTICAL_STABILIZATION = 0x11
    HDR_VIDEO = 0x12
    REGION_OF_INTEREST = 0x13
    PORT_PRIORITY = 0x14
    QUIET = 0x15
    MAP_POINTS = 0x16
    RIG_POSES = 0x17
    TIME = 0x18
    INPUT_DELAY = 0x19
    ENCODER_BUFFERING = 0x20
    READER_BUFFERING = 0x21
    LOOP_CONTROL = 0x22


class TimeSource(IntEnum):
    """Clocks of the headset that `Setting.TIME` asks for."""

    OWN = 0
    UTC = 1


REQUESTS: dict[Setting, str] = {
    Setting.VERSION: "<",
    Setting.UTC_OFFSET: "<",
    Setting.MARKER_STATE: "<I",
    Setting.VIDEO_STATUS: "<",
    Setting.FOCUS: "<5I",
    Setting.TEMPORAL_DENOISING: "<I",
    Setting.WHITE_BALANCE_PRESET: "<I",
    Setting.WHITE_BALANCE_VALUE: "<I",
    Setting.EXPOSURE: "<2I",
    Setting.EXPOSURE_PRIORITY: "<I",
    Setting.ISO_SPEED: "<2I",
    Setting.BACKLIGHT: "<I",
    Setting.SCENE_MODE: "<I",
    Setting.FLAT_MODE: "<I",
    Setting.EYE_SELECTION: "<I",
    Setting.OPTIMIZATION: "<I",
    Setting.PRIMARY_USE: "<I",
    Setting.OPTICAL_STABILIZATION: "<I",
    Setting.HDR_VIDEO: "<I",
    Setting.REGION_OF_INTEREST: "<I4f",
    Setting.PORT_PRIORITY: "<Ii",
    Setting.QUIET: "<I",
    Setting.MAP_POINTS: "<3I",
    Setting.RIG_POSES: "<I",
    Setting.TIME: "<I",
    Setting.INPUT_DELAY: "<q",
    Setting.ENCODER_BUFFERING: "<I",
    Setting.READER_BUFFERING: "<I",
    Setting.LOOP_CONTROL: "<2I",
}
"""Values after a command byte. `MAP_POINTS` (port, operation, count) is followed by two float32 a
point, `RIG_POSES` (count) by a uint64 a time."""

REPLIES: dict[Setting, str] = {
    Setting.VERSION: "<4H",
    Setting.UTC_OFFSET: "<Q",
    Setting.VIDEO_STATUS: "<B",
    Setting.TIME: "<Q",
}
"""Answers of a fixed size; to `MAP_POINTS` there are two float32 a point, to `RIG_POSES` 16 a time,
to all others none."""

_FOLLOWING = {Setting.MAP_POINTS: "2f", Setting.RIG_POSES: "Q"}
"""Layout of each of the counted values of a request."""

_ANSWERED = {Setting.MAP_POINTS: "2f", Setting.RIG_POSES: "16f"}
"""Layout of the answer to each of them."""

MAX_COUNT = 4096
"""Most points or times of a request, chosen: an answer of 256 KiB."""


@dataclass(frozen=True, slots=True)
class Request:
    """One command.

    Attributes:
        setting: which.
        values: as `REQUESTS` says.
        following: values after a count, flat.
    """

    setting: Setting
    values: Values = ()
    following: Values = ()


def encode_request(request: Request) -> bytes:
    """Return a command's bytes."""
    head = bytes([request.setting]) + struct.pack(REQUESTS[request.setting], *request.values)
    layout = _FOLLOWING.get(request.setting)
    if layout is None:
        return head
    return head + struct.pack("<" + layout * int(request.values[-1]), *request.following)


def read_request(take: Take) -> Request:
    """Read a command.

    Raises:
        WireError: there is none of this number, or its count is above `MAX_COUNT`.
    """
    number = take(1)[0]
    try:
        setting = Setting(number)
    except ValueError:
        raise WireError(f"remote configuration: command {number:#04x}, there is none") from None
    values = taken(take, struct.Struct(REQUESTS[setting]))
    layout = _FOLLOWING.get(setting)
    if layout is None:
        return Request(setting, values)
    count = checked_count(f"{setting.name}: count", values[-1], most=MAX_COUNT)
    return Request(setting, values, taken(take, struct.Struct("<" + layout * count)))


def reply_layout(request: Request) -> struct.Struct:
    """Return the layout of the answer to a command; of no bytes where there is none."""
    layout = _ANSWERED.get(request.setting)
    if layout is not None:
        return struct.Struct("<" + layout * int(request.values[-1]))
    return struct.Struct(REPLIES.get(request.setting, "<"))


def encode_reply(request: Request, values: Values) -> bytes:
    """Return the bytes of an answer."""
    return reply_layout(request).pack(*values)


def read_reply(take: Take, request: Request) -> Values:
    """Read the answer to a command, flat."""
    return taken(take, reply_layout(request))
