"""Metadata record of a trailer: what camera took the file, its lenses, its clock.

A protocol buffer of about a hundred fields. Those that are used have a name here; all are kept to
the byte when one is changed.
"""

from __future__ import annotations

from dataclasses import dataclass

from devices.insta360.protobuf import (
    Field,
    bytes_field,
    double,
    double_field,
    inner,
    message,
    read_message,
    text,
    varint_field,
    whole,
)

SERIAL, CAMERA_TYPE, FIRMWARE, OFFSET = 1, 2, 3, 5
FIRST_FRAME, ROLLING_SHUTTER, WINDOW_CROP = 24, 25, 27
OFFSET_V2, OFFSET_V3, IS_RAW_GYRO, GYRO_RANGES = 53, 54, 62, 65
"""Field numbers, as the community has published them."""

STANDARD_GRAVITY_M_S2 = 9.80665
"""Acceleration of 1 g, by definition."""


@dataclass(frozen=True, slots=True)
class WindowCrop:
    """Part of the sensor that is in the picture, pixels."""

    sensor_width_px: int
    sensor_height_px: int
    width_px: int
    height_px: int
    x_px: int
    y_px: int


@dataclass(frozen=True, slots=True)
class Metadata:
    """The metadata record.

    Attributes:
        fields: all of its fields in the order of the file.
    """

    fields: tuple[Field, ...] = ()

    @property
    def serial(self) -> str:
        """Serial number; empty if unsaid."""
        return text(self.fields, SERIAL) or ""

    @property
    def camera_type(self) -> str:
        """Such as "Insta360 X4"; empty if unsaid."""
        return text(self.fields, CAMERA_TYPE) or ""

    @property
    def firmware(self) -> str:
        """Version of the firmware; empty if unsaid."""
        return text(self.fields, FIRMWARE) or ""

    @property
    def offset(self) -> str:
        """Best calibration string: version 3, else 2, else 1, else empty (`offsets.py`)."""
        found = (text(self.fields, n) for n in (OFFSET_V3, OFFSET_V2, OFFSET))
        return next((words for words in found if words), "")

    @property
    def raw_gyro(self) -> bool:
        """Whether gyro samples are whole numbers and times of records are microseconds."""
        return bool(whole(self.fields, IS_RAW_GYRO))

    @property
    def first_frame_ns(self) -> int | None:
        """Time of the first picture on the clock of the gyro and exposure records."""
        ticks = whole(self.fields, FIRST_FRAME)
        return None if ticks is None else ticks * self.tick_ns

    @property
    def tick_ns(self) -> int:
        """Nanoseconds of one unit of time in gyro and exposure records."""
        return 1_000 if self.raw_gyro else 1_000_000

    @property
    def rolling_shutter_s(self) -> float | None:
        """Time from the first row to the last; None if unsaid."""
        value = double(self.fields, ROLLING_SHUTTER)
        return None if value is None else value / 1e3

    @property
    def gyro_ranges(self) -> tuple[int, int] | None:
        """Full scale of the accelerometer, g, and of the gyroscope, °/s; None if unsaid.

        Raises:
            ProtobufError: the field is no message.
        """
        ranges = inner(self.fields, GYRO_RANGES)
        if ranges is None:
            return None
        accel, gyro = whole(ranges, 1), whole(ranges, 2)
        return None if not accel or not gyro else (accel, gyro)

    @property
    def window_crop(self) -> WindowCrop | None:
        """Part of the sensor that is in the picture; None if unsaid.

        Raises:
            ProtobufError: the field is no message.
        """
        crop = inner(self.fields, WINDOW_CROP)
        return None if crop is None else WindowCrop(*(whole(crop, n) or 0 for n in range(1, 7)))

    def with_fields(self, *new: Field) -> Metadata:
        """These fields instead of all of the same numbers; new ones go to the end."""
        kept = list(self.fields)
        for field in new:
            places = [at for at, old in enumerate(kept) if old.number == field.number]
            at = places[0] if places else len(kept)
            rest = [old for old in kept[at:] if old.number != field.number]
            kept = [*kept[:at], field, *rest]
        return Metadata(tuple(kept))


def read_metadata(data: bytes) -> Metadata:
    """The record's bytes as metadata.

    Raises:
        ProtobufError: they are no message.
    """
    return Metadata(read_message(data))


def write_metadata(metadata: Metadata) -> bytes:
    """Inverse of `read_metadata`, to the byte."""
    return message(*metadata.fields)


def new_metadata(
    *,
    serial: str,
    camera_type: str,
    firmware: str,
    offset: str = "",
    offset_v2: str = "",
    offset_v3: str = "",
    gyro_ranges: tuple[int, int] | None = None,
    first_frame_us: int = 0,
    rolling_shutter_s: float | None = None,
) -> Metadata:
    """Metadata of a file that this program writes: gyro samples raw, times in microseconds.

    Args:
        serial: serial number.
        camera_type: such as "Insta360 X4".
        firmware: its version.
        offset: calibration string of version 1; an empty one is left out.
        offset_v2: of version 2.
        offset_v3: of version 3.
        gyro_ranges: full scale of the accelerometer, g, and of the gyroscope, °/s.
        first_frame_us: time of the first picture on the clock of the gyro.
        rolling_shutter_s: time from the first row to the last.
    """
    strings = ((OFFSET, offset), (OFFSET_V2, offset_v2), (OFFSET_V3, offset_v3))
    first = [bytes_field(SERIAL, serial), bytes_field(CAMERA_TYPE, camera_type)]
    first.append(bytes_field(FIRMWARE, firmware))
    first += [bytes_field(number, words) for number, words in strings[:1] if words]
    rest = [varint_field(FIRST_FRAME, first_frame_us)]
    if rolling_shutter_s is not None:
        rest.append(double_field(ROLLING_SHUTTER, 1e3 * rolling_shutter_s))
    rest += [bytes_field(number, words) for number, words in strings[1:] if words]
    rest.append(varint_field(IS_RAW_GYRO, 1))
    if gyro_ranges is not None:
        accel, gyro = gyro_ranges
        rest.append(
            bytes_field(GYRO_RANGES, message(varint_field(1, accel), varint_field(2, gyro)))
        )
    return Metadata((*first, *rest))
