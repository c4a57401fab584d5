"""AMF0, the values of RTMP's commands (Adobe, "Action Message Format", 2007), read with bounds."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import TypeAlias, cast

AmfValue: TypeAlias = "float | bool | str | dict[str, AmfValue] | list[AmfValue] | None"

MAX_DEPTH = 8
"""Objects within objects that are read; commands of publishers nest one deep."""

MAX_VALUES = 512
"""Values in one message that are read; FFmpeg and OBS send fewer than 30."""

NUMBER, BOOLEAN, STRING, OBJECT, NULL, UNDEFINED = 0, 1, 2, 3, 5, 6
ECMA_ARRAY, OBJECT_END, STRICT_ARRAY, DATE, LONG_STRING = 8, 9, 10, 11, 12


class AmfError(ValueError):
    """Bytes that are no AMF0 values, or too many of them."""


def encode_amf(*values: AmfValue) -> bytes:
    """Values one after another."""
    return b"".join(_encode(value) for value in values)


def _encode(value: AmfValue) -> bytes:
    if value is None:
        return bytes([NULL])
    if isinstance(value, bool):
        return bytes([BOOLEAN, value])
    if isinstance(value, int | float):
        return bytes([NUMBER]) + struct.pack(">d", float(value))
    if isinstance(value, str):
        return bytes([STRING]) + _text(value)
    if isinstance(value, list):
        return struct.pack(">BI", STRICT_ARRAY, len(value)) + encode_amf(*value)
    fields = cast(Mapping[str, AmfValue], value)
    inside = b"".join(_text(name) + _encode(field) for name, field in fields.items())
    return bytes([OBJECT]) + inside + b"\x00\x00" + bytes([OBJECT_END])


def _text(text: str) -> bytes:
    data = text.encode("utf-8")[:0xFFFF]
    return struct.pack(">H", len(data)) + data


def decode_amf(data: bytes) -> list[AmfValue]:
    """Every value in `data`.

    Raises:
        AmfError: it is cut short, has a type that no publisher sends, or too many values.
    """
    reader = _Values(data)
    values: list[AmfValue] = []
    while not reader.is_done:
        values.append(reader.value(0))
    return values


class _Values:
    def __init__(self, data: bytes) -> None:
        self._data, self._at, self._left = data, 0, MAX_VALUES

    @property
    def is_done(self) -> bool:
        return self._at >= len(self._data)

    def value(self, depth: int) -> AmfValue:
        self._left -= 1
        if depth > MAX_DEPTH or self._left < 0:
            raise AmfError(f"AMF0: more than {MAX_VALUES} values or {MAX_DEPTH} levels")
        kind = self._take(1)[0]
        if kind == NUMBER:
            return float(struct.unpack(">d", self._take(8))[0])
        if kind == BOOLEAN:
            return self._take(1)[0] != 0
        if kind == STRING:
            return self._text(2)
        if kind == LONG_STRING:
            return self._text(4)
        if kind in (NULL, UNDEFINED):
            return None
        if kind == DATE:
            return float(struct.unpack(">dh", self._take(10))[0])
        if kind == STRICT_ARRAY:
            return [self.value(depth + 1) for _ in range(self._number(4))]
        if kind in (OBJECT, ECMA_ARRAY):
            return self._object(depth, kind)
        raise AmfError(f"AMF0: type {kind} at byte {self._at - 1}")

    def _object(self, depth: int, kind: int) -> dict[str, AmfValue]:
        if kind == ECMA_ARRAY:
            self._take(4)
        fields: dict[str, AmfValue] = {}
        while True:
            name = self._text(2)
            if not name and self._data[self._at : self._at + 1] == bytes([OBJECT_END]):
                self._at += 1
                return fields
            fields[name] = self.value(depth + 1)

    def _text(self, length_bytes: int) -> str:
        return self._take(self._number(length_bytes)).decode("utf-8", "replace")

    def _number(self, count: int) -> int:
        return int.from_bytes(self._take(count), "big")

    def _take(self, count: int) -> bytes:
        taken = self._data[self._at : self._at + count]
        if len(taken) != count:
            raise AmfError(f"AMF0: {count} bytes wanted at {self._at}, {len(taken)} left")
        self._at += count
        return taken
