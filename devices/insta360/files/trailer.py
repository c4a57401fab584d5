"""Trailer that Insta360 cameras append to files (.insv: MP4, .insp: JPEG): read and written.

From the end backwards: 32 characters of magic, `u32` version, `u32` size of the trailer, 32
reserved bytes; before them the records, each `data, u8 format, u8 id, u32 size`. Newer cameras put
an index (record 0) last and leave gaps between the others. Every byte that is not understood is
kept.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

from scenes.formats.storage.atomic import write_file

MAGIC = b"8db42d694ccc418790edff439fe026bf"
"""The last 32 bytes of a file with a trailer, as text."""

INDEX, METADATA, THUMBNAIL, GYRO, EXPOSURE = 0, 1, 2, 3, 4
"""Ids of records; 0 lists the others."""

BINARY, PROTOBUF, JSON = 0, 1, 2
"""Formats of records."""

MAX_TRAILER_BYTES = 1 << 29
"""Limit of a trailer that is read. Gyro samples at 1 kHz are 72 MB an hour."""

MAX_RECORDS = 4096
"""Limit of records; cameras write about twenty."""

_FOOTER = struct.Struct("<32sII32s")
_HEAD = struct.Struct("<BBI")
_SLOT = struct.Struct("<BBII")
_BOX = b"inst"
_COPY_BYTES = 1 << 20


class TrailerError(ValueError):
    """A trailer that cannot be used: names the file, what is wrong, what to do."""


@dataclass(frozen=True, slots=True)
class Record:
    """One record.

    Attributes:
        record_id: what it holds.
        record_format: `BINARY`, `PROTOBUF` or `JSON`.
        data: its bytes.
        before: what an indexed trailer has between the record before and this one.
    """

    record_id: int
    record_format: int
    data: bytes
    before: bytes = b""


@dataclass(frozen=True, slots=True)
class Trailer:
    """All records in the order of the file.

    Attributes:
        records: without the index.
        version: of the trailer; 3 on every camera documented.
        slots: ids of the index's entries in their order, -1 for an empty one; None without index.
        after: what an indexed trailer has between the last record and the index.
        boxed: whether the trailer is in an MP4 box of its own.
        index_format: as a record's; 0 wherever it was seen.
        reserved: 32 bytes of the footer.
    """

    records: tuple[Record, ...] = ()
    version: int = 3
    slots: tuple[int, ...] | None = None
    after: bytes = b""
    boxed: bool = False
    reserved: bytes = bytes(32)
    index_format: int = BINARY

    def data(self, record_id: int) -> bytes | None:
        """Bytes of the first record of that id; None if there is none."""
        found = (record.data for record in self.records if record.record_id == record_id)
        return next(found, None)

    def with_record(self, record_id: int, record_format: int, data: bytes) -> Trailer:
        """The trailer with that record replaced, or appended if there was none."""
        for at, record in enumerate(self.records):
            if record.record_id == record_id:
                new = replace(record, record_format=record_format, data=data)
                return replace(self, records=(*self.records[:at], new, *self.records[at + 1 :]))
        slots = self.slots
        if slots is not None and record_id not in slots:
            at = record_id if record_id < len(slots) and slots[record_id] < 0 else len(slots)
            slots = (*slots[:at], record_id, *slots[at + 1 :])
        added = Record(record_id, record_format, data)
        return replace(self, records=(*self.records, added), slots=slots)


def read_trailer(path: Path) -> Trailer | None:
    """The trailer of a file; None where it has none.

    Raises:
        TrailerError: there is one, but it is damaged.
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        try:
            return read_trailer_of(file)
        except TrailerError as error:
            raise TrailerError(f"{path}: {error}; copy it from the camera again") from None


def read_trailer_of(file: BinaryIO) -> Trailer | None:
    """As `read_trailer`, of an open file.

    Raises:
        TrailerError: damaged; does not name the file.
    """
    found = _footer(file)
    if found is None:
        return None
    size, version, reserved, boxed, start = found
    file.seek(start)
    body = file.read(size - _FOOTER.size)
    last = _HEAD.unpack_from(body, len(body) - _HEAD.size) if len(body) >= _HEAD.size else None
    if last is not None and last[1] == INDEX and last[2] and last[2] % _SLOT.size == 0:
        return _index(body, version, reserved, boxed=boxed)
    records = tuple(_walk_back(body))[::-1]
    return Trailer(records, version, boxed=boxed, reserved=reserved)


def media_size(file: BinaryIO) -> int:
    """Bytes of the file before its trailer (and the box around that); all of it without one.

    Raises:
        TrailerError: the trailer's size cannot be.
    """
    end = file.seek(0, 2)
    found = _footer(file)
    return end if found is None else found[4] - (8 if found[3] else 0)


def _footer(file: BinaryIO) -> tuple[int, int, bytes, bool, int] | None:
    """Size, version, reserved bytes, boxed?, start of the trailer."""
    end = file.seek(0, 2)
    if end < _FOOTER.size:
        return None
    file.seek(end - _FOOTER.size)
    reserved, size, version, magic = _FOOTER.unpack(file.read(_FOOTER.size))
    if magic != MAGIC:
        return None
    if not _FOOTER.size <= size <= min(end, MAX_TRAILER_BYTES):
        raise TrailerError(
            f"trailer of {size} bytes in a file of {end}, wanted {_FOOTER.size} to "
            f"{min(end, MAX_TRAILER_BYTES)}"
        )
    start = end - size
    file.seek(max(0, start - 8))
    boxed = start >= 8 and file.read(8) == (size + 8).to_bytes(4, "big") + _BOX
    return size, version, reserved, boxed, start


def _walk_back(body: bytes) -> Iterator[Record]:
    """Records from the last to the first; they must fill the trailer exactly."""
    at, count = len(body), 0
    while at:
        count += 1
        if at < _HEAD.size or count > MAX_RECORDS:
            raise TrailerError(f"trailer: {at} bytes before record {count} from the end are none")
        record_format, record_id, size = _HEAD.unpack_from(body, at - _HEAD.size)
        begin = at - _HEAD.size - size
        if begin < 0:
            raise TrailerError(
                f"trailer: record {count} from the end (id {record_id}) wants {size} bytes, "
                f"{at - _HEAD.size} are there"
            )
        yield Record(record_id, record_format, body[begin : at - _HEAD.size])
        at = begin


def _index(body: bytes, version: int, reserved: bytes, *, boxed: bool) -> Trailer:
    """Records where the index says they are; it must not let them overlap."""
    index_format, _id, index_bytes = _HEAD.unpack_from(body, len(body) - _HEAD.size)
    index_at = len(body) - _HEAD.size - index_bytes
    if index_at < 0:
        raise TrailerError(f"trailer: index of {index_bytes} bytes in {len(body)}")
    slots: list[int] = []
    places: list[tuple[int, int, int, int]] = []
    for at in range(index_at, index_at + index_bytes, _SLOT.size):
        record_id, record_format, size, offset = _SLOT.unpack_from(body, at)
        empty = (record_id, record_format, size, offset) == (0, 0, 0, 0)
        slots.append(-1 if empty else record_id)
        if not empty:
            places.append((offset, size, record_id, record_format))
    if len(slots) > MAX_RECORDS or len({place[2] for place in places}) < len(places):
        raise TrailerError(f"trailer: index of {len(slots)} entries, or two of one id")
    records: list[Record] = []
    end = 0
    for offset, size, record_id, record_format in sorted(places):
        if not end <= offset <= index_at - size:
            raise TrailerError(
                f"trailer: record {record_id} at {offset} to {offset + size}, wanted within {end} "
                f"to {index_at}"
            )
        data = body[offset : offset + size]
        records.append(Record(record_id, record_format, data, body[end:offset]))
        end = offset + size
    after = body[end:index_at]
    return Trailer(tuple(records), version, tuple(slots), after, boxed, reserved, index_format)


def trailer_bytes(trailer: Trailer) -> bytes:
    """A trailer as it is in a file, its box included; inverse of `read_trailer_of`.

    Raises:
        TrailerError: it would be longer than `MAX_TRAILER_BYTES`, a number has no room in its
            bytes, or an index lacks a record.
    """
    try:
        body = (
            _contiguous(trailer) if trailer.slots is None else _with_index(trailer, trailer.slots)
        )
        size = len(body) + _FOOTER.size
        if size > MAX_TRAILER_BYTES or len(trailer.reserved) != 32:
            raise TrailerError(
                f"trailer of {size} bytes, at most {MAX_TRAILER_BYTES}; "
                f"{len(trailer.reserved)} reserved bytes, wanted 32"
            )
        footer = _FOOTER.pack(trailer.reserved, size, trailer.version, MAGIC)
    except struct.error as error:
        raise TrailerError(f"trailer: a number has no room ({error})") from None
    box = (size + 8).to_bytes(4, "big") + _BOX if trailer.boxed else b""
    return box + body + footer


def _contiguous(trailer: Trailer) -> bytes:
    return b"".join(
        record.data + _HEAD.pack(record.record_format, record.record_id, len(record.data))
        for record in trailer.records
    )


def _with_index(trailer: Trailer, slots: tuple[int, ...]) -> bytes:
    body = bytearray()
    places: dict[int, bytes] = {}
    for record in trailer.records:
        body += record.before
        place = (record.record_id, record.record_format, len(record.data), len(body))
        places[record.record_id] = _SLOT.pack(*place)
        body += record.data
    if len(places) < len(trailer.records) or set(places) != {s for s in slots if s >= 0}:
        raise TrailerError(f"trailer: index of {slots} for records {sorted(places)}")
    index = b"".join(bytes(_SLOT.size) if slot < 0 else places[slot] for slot in slots)
    return bytes(body + trailer.after + index) + _HEAD.pack(trailer.index_format, INDEX, len(index))


def write_trailer(media: Path, target: Path, trailer: Trailer) -> int:
    """Write a copy of a video or picture with this trailer instead of the one it has, if any.

    `target` appears whole or not at all; it may be `media` itself.

    Returns:
        The size of `target` in bytes.

    Raises:
        TrailerError: the trailer cannot be written, or the file's own is damaged.
        OSError: a file cannot be read or written.
    """
    end = trailer_bytes(trailer)
    with media.open("rb") as file:
        size = media_size(file)
        return write_file(target, _copy(file, size, end))


def _copy(file: BinaryIO, size: int, end: bytes) -> Iterator[bytes]:
    file.seek(0)
    while size > 0:
        block = file.read(min(size, _COPY_BYTES))
        if not block:
            break
        size -= len(block)
        yield block
    yield end
