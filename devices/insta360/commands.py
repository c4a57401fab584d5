"""Messages over port 6666: commands, their replies, and what a camera says of itself.

Numbers of commands, options and fields are those of the vendor's message definitions, as the
community has published them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from devices.insta360.errors import printable
from devices.insta360.packets import Message
from devices.insta360.protobuf import (
    BYTES,
    VARINT,
    Field,
    ProtobufError,
    bytes_field,
    inner,
    message,
    read_message,
    signed,
    text,
    varint_field,
    whole,
)


class Command(IntEnum):
    """Codes of commands that this program sends or its simulated camera knows."""

    START_LIVE_STREAM = 1
    STOP_LIVE_STREAM = 2
    TAKE_PICTURE = 3
    START_CAPTURE = 4
    STOP_CAPTURE = 5
    SET_OPTIONS = 7
    GET_OPTIONS = 8
    GET_FILE_LIST = 13
    GET_CAPTURE_STATUS = 15


OK, BAD_REQUEST, FAILED, NOT_IMPLEMENTED = 200, 400, 500, 501
"""Codes of replies."""

FIRST_NOTIFICATION = 8192
"""Codes from here on are notifications of the camera, not replies."""


class Option(IntEnum):
    """Numbers of options; an option's value is the field of the same number."""

    BATTERY = 11
    LOCAL_TIME = 12
    TIME_ZONE = 13
    SERIAL_NUMBER = 15
    MEDIA_OFFSET = 22
    FIRMWARE = 30
    CAMERA_TYPE = 48
    MEDIA_OFFSET_V2 = 80
    MEDIA_OFFSET_V3 = 81


class Resolution(IntEnum):
    """Numbers of preview sizes. X4 and later ignore it: the size is read from the stream."""

    SMALL_424_240_15 = 34
    SIDE_BY_SIDE_1440_720_30 = 9


INFO_OPTIONS = (
    Option.BATTERY,
    Option.SERIAL_NUMBER,
    Option.MEDIA_OFFSET,
    Option.FIRMWARE,
    Option.CAMERA_TYPE,
    Option.MEDIA_OFFSET_V2,
    Option.MEDIA_OFFSET_V3,
)

AUDIO_RATE_HZ = 48_000
"""Sample rate in the request that is known to work; no audio is asked for."""


@dataclass(frozen=True, slots=True)
class CameraInfo:
    """Description of a camera by itself; empty or None where it does not say it.

    Attributes:
        serial: serial number.
        camera_type: such as "Insta360 X4".
        firmware: version.
        battery: 0 to 1.
        offset, offset_v2, offset_v3: calibration strings of its lenses (`offsets.py`).
    """

    serial: str = ""
    camera_type: str = ""
    firmware: str = ""
    battery: float | None = None
    offset: str = ""
    offset_v2: str = ""
    offset_v3: str = ""


@dataclass(frozen=True, slots=True)
class LiveRequest:
    """Request for a live stream.

    Attributes:
        video: whether pictures are wanted.
        gyro: whether inertial samples are. True in the request that is known to work on X3 and X4.
        resolution: number of the main stream's size.
    """

    video: bool = True
    gyro: bool = True
    resolution: int = Resolution.SIDE_BY_SIDE_1440_720_30


def start_live(request: LiveRequest) -> bytes:
    """Body of `START_LIVE_STREAM`."""
    return message(
        varint_field(2, request.video),
        varint_field(4, AUDIO_RATE_HZ),
        varint_field(7, request.resolution),
        varint_field(8, request.gyro),
        varint_field(10, Resolution.SMALL_424_240_15),
    )


def read_start_live(body: bytes) -> LiveRequest:
    """Inverse of `start_live`.

    Raises:
        ProtobufError: the body is no message.
    """
    fields = read_message(body)
    return LiveRequest(bool(whole(fields, 2)), bool(whole(fields, 8)), whole(fields, 7) or 0)


def set_time(unix_s: int, zone_s: int) -> bytes:
    """Body of `SET_OPTIONS` for the camera's clock: seconds since 1970 and east of Greenwich."""
    value = message(
        varint_field(Option.LOCAL_TIME, unix_s),
        varint_field(Option.TIME_ZONE, zone_s),
    )
    return message(
        varint_field(1, Option.LOCAL_TIME), varint_field(1, Option.TIME_ZONE), bytes_field(2, value)
    )


def read_set_time(body: bytes) -> tuple[int, int] | None:
    """Inverse of `set_time`; None where other options are set.

    Raises:
        ProtobufError: the body is no message.
    """
    value = inner(read_message(body), 2) or ()
    unix_s, zone_s = whole(value, Option.LOCAL_TIME), signed(value, Option.TIME_ZONE)
    return None if unix_s is None else (unix_s, zone_s or 0)


def get_options(options: tuple[int, ...]) -> bytes:
    """Body of `GET_OPTIONS`."""
    return message(*(varint_field(1, option) for option in options))


def read_get_options(body: bytes) -> tuple[int, ...]:
    """The numbers that are asked for, packed or one a field.

    Raises:
        ProtobufError: the body is no message.
    """
    numbers: list[int] = []
    for field in read_message(body):
        if field.number == 1 and field.kind == VARINT and isinstance(field.value, int):
            numbers.append(field.value)
        elif field.number == 1 and field.kind == BYTES and isinstance(field.value, bytes):
            numbers += _pack(field.value)
    return tuple(numbers)


def _pack(data: bytes) -> list[int]:
    """Numbers of a packed field, which are varints of one byte or two for known options."""
    numbers: list[int] = []
    value, shift = 0, 0
    for byte in data:
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            numbers.append(value)
            value, shift = 0, 0
        elif shift > 63:
            raise ProtobufError("packed options: a number of more than 64 bits")
    return numbers


def info_reply(info: CameraInfo, wanted: tuple[int, ...]) -> bytes:
    """Body of the reply to `GET_OPTIONS`: those of the wanted options that the camera knows."""
    battery = round(100 * (info.battery or 0.0))
    status = message(varint_field(2, battery), varint_field(3, 100))
    known: dict[int, Field] = {
        Option.BATTERY: bytes_field(Option.BATTERY, status),
        Option.SERIAL_NUMBER: bytes_field(Option.SERIAL_NUMBER, info.serial),
        Option.MEDIA_OFFSET: bytes_field(Option.MEDIA_OFFSET, info.offset),
        Option.FIRMWARE: bytes_field(Option.FIRMWARE, info.firmware),
        Option.CAMERA_TYPE: bytes_field(Option.CAMERA_TYPE, info.camera_type),
        Option.MEDIA_OFFSET_V2: bytes_field(Option.MEDIA_OFFSET_V2, info.offset_v2),
        Option.MEDIA_OFFSET_V3: bytes_field(Option.MEDIA_OFFSET_V3, info.offset_v3),
    }
    given = [number for number in wanted if number in known]
    value = message(*(known[number] for number in given))
    return message(*(varint_field(1, number) for number in given), bytes_field(2, value))


def read_info(body: bytes) -> CameraInfo:
    """Inverse of `info_reply`.

    Raises:
        ProtobufError: the body is no message.
    """
    value = inner(read_message(body), 2) or ()
    status = inner(value, Option.BATTERY) or ()
    level, scale = whole(status, 2), whole(status, 3) or 100
    return CameraInfo(
        text(value, Option.SERIAL_NUMBER) or "",
        text(value, Option.CAMERA_TYPE) or "",
        text(value, Option.FIRMWARE) or "",
        None if level is None else min(level / scale, 1.0),
        text(value, Option.MEDIA_OFFSET) or "",
        text(value, Option.MEDIA_OFFSET_V2) or "",
        text(value, Option.MEDIA_OFFSET_V3) or "",
    )


def refusal(reply: Message) -> str:
    """Why the camera refused, in its own words or by its code."""
    try:
        said = text(read_message(reply.body), 2)
    except ProtobufError:
        said = reply.body.decode("utf-8", "replace")
    words = printable(said or "")
    return f"code {reply.code}: {words}" if words else f"code {reply.code}"
