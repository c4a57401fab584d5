"""Protocol Buffers on the wire: the fields of one message, read and written without a schema.

Only what cameras use is known: varints, fixed 32 and 64 bit, and length-delimited fields. Whatever
is read is kept to the byte, so unknown fields survive a change of known ones.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
"""Wire types: the low three bits of a field's key (protobuf.dev, "Encoding")."""

MAX_FIELDS = 16_384
"""Fields in one message. A file's metadata has about a hundred; a list of files one a file."""

MAX_NUMBER = (1 << 29) - 1
"""Field numbers have 29 bits (protobuf.dev, "Assigning Field Numbers")."""

_MASK64 = (1 << 64) - 1


class ProtobufError(ValueError):
    """Bytes that are no message: says where and what is wrong."""


@dataclass(frozen=True, slots=True)
class Field:
    """One field as it is on the wire.

    Attributes:
        number: which field, from 1.
        kind: wire type, one of `VARINT`, `FIXED64`, `BYTES`, `FIXED32`.
        value: the varint or the fixed bits as an unsigned whole number, or the bytes.
        encoded: key and value exactly as they were read.
    """

    number: int
    kind: int
    value: int | bytes
    encoded: bytes


def read_message(data: bytes) -> tuple[Field, ...]:
    """All fields of a message in their order; `b"".join(f.encoded for f in …)` gives `data` back.

    Raises:
        ProtobufError: cut off, a wire type or number that does not exist, too many fields.
    """
    return tuple(_fields(data))


def _fields(data: bytes) -> Iterator[Field]:
    at, count = 0, 0
    while at < len(data):
        if count == MAX_FIELDS:
            raise ProtobufError(f"message with more than {MAX_FIELDS} fields: no camera's")
        count += 1
        key, end = _read_varint(data, at)
        number, kind = key >> 3, key & 7
        if not 1 <= number <= MAX_NUMBER:
            raise ProtobufError(f"byte {at}: field number {number}, wanted 1 to {MAX_NUMBER}")
        value: int | bytes
        if kind == VARINT:
            value, end = _read_varint(data, end)
        elif kind == BYTES:
            size, start = _read_varint(data, end)
            end = _end(data, start, size, number)
            value = data[start:end]
        elif kind in (FIXED64, FIXED32):
            start = end
            end = _end(data, start, 8 if kind == FIXED64 else 4, number)
            value = int.from_bytes(data[start:end], "little")
        else:
            raise ProtobufError(f"byte {at}: field {number} of wire type {kind}, wanted 0, 1, 2, 5")
        yield Field(number, kind, value, data[at:end])
        at = end


def _end(data: bytes, start: int, size: int, number: int) -> int:
    if size > len(data) - start:
        raise ProtobufError(
            f"byte {start}: field {number} wants {size} bytes, {len(data) - start} are left"
        )
    return start + size


def _read_varint(data: bytes, at: int) -> tuple[int, int]:
    """A number of up to 64 bits and the position after it."""
    value = 0
    for index in range(10):
        if at + index >= len(data):
            raise ProtobufError(f"byte {at}: a number is cut off")
        byte = data[at + index]
        value |= (byte & 0x7F) << (7 * index)
        if byte < 0x80:
            if value > _MASK64:
                break
            return value, at + index + 1
    raise ProtobufError(f"byte {at}: a number of more than 64 bits")


def varint_field(number: int, value: int) -> Field:
    """A whole number (negative: as two's complement of 64 bits, as int32 and int64 are) or a bool.

    Raises:
        ProtobufError: it has more than 64 bits.
    """
    if not -(1 << 63) <= value <= _MASK64:
        raise ProtobufError(f"field {number}: {value} has more than 64 bits")
    unsigned = value & _MASK64
    return Field(number, VARINT, unsigned, _varint(number << 3 | VARINT) + _varint(unsigned))


def bytes_field(number: int, value: bytes | str) -> Field:
    """Bytes, text (as UTF-8) or a message in a message."""
    raw = value.encode() if isinstance(value, str) else value
    return Field(number, BYTES, raw, _varint(number << 3 | BYTES) + _varint(len(raw)) + raw)


def double_field(number: int, value: float) -> Field:
    """A 64-bit floating-point number."""
    raw = struct.pack("<d", value)
    return Field(
        number, FIXED64, int.from_bytes(raw, "little"), _varint(number << 3 | FIXED64) + raw
    )


def message(*fields: Field) -> bytes:
    """Fields as one message, in the order given."""
    return b"".join(field.encoded for field in fields)


def _varint(value: int) -> bytes:
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def last(fields: Iterable[Field], number: int) -> Field | None:
    """The field of that number that counts: the last one; None if there is none."""
    found = None
    for field in fields:
        if field.number == number:
            found = field
    return found


def whole(fields: Iterable[Field], number: int) -> int | None:
    """An unsigned whole number; None where there is none, or something else."""
    field = last(fields, number)
    return field.value if field and field.kind == VARINT and isinstance(field.value, int) else None


def signed(fields: Iterable[Field], number: int) -> int | None:
    """A signed whole number (int32 or int64); None where there is none, or something else."""
    value = whole(fields, number)
    return value if value is None or value < 1 << 63 else value - (1 << 64)


def double(fields: Iterable[Field], number: int) -> float | None:
    """A 64-bit floating-point number; None where there is none, or something else."""
    field = last(fields, number)
    if field is None or field.kind != FIXED64 or not isinstance(field.value, int):
        return None
    return struct.unpack("<d", field.value.to_bytes(8, "little"))[0]


def raw(fields: Iterable[Field], number: int) -> bytes | None:
    """Bytes; None where there are none, or something else."""
    field = last(fields, number)
    return field.value if field and isinstance(field.value, bytes) else None


def text(fields: Iterable[Field], number: int) -> str | None:
    """Text, what is no UTF-8 in it replaced; None where there is none, or something else."""
    value = raw(fields, number)
    return None if value is None else value.decode("utf-8", "replace")


def inner(fields: Iterable[Field], number: int) -> tuple[Field, ...] | None:
    """The fields of a message in the message; None where there is none.

    Raises:
        ProtobufError: its bytes are no message.
    """
    value = raw(fields, number)
    return None if value is None else read_message(value)
