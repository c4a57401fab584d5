"""Positions of the messages of an MCAP file, whether or not the file says so itself.

Source: the MCAP specification. Its summary with all indexes is optional, and so is every checksum
(0 means there is none). A file that was cut off has no end: what is in its whole records is read.
"""

from __future__ import annotations

import heapq
import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, ChunkIndex, Message, Metadata, Schema, Statistics
from mcap.stream_reader import breakup_chunk
from mcap.summary import Summary

MAGIC = b"\x89MCAP0\r\n"
_FOOTER = struct.Struct("<BQQQI")
_RECORD = struct.Struct("<BQ")

DAMAGE = (
    McapError,
    struct.error,
    zstandard.ZstdError,
    ValueError,
    KeyError,
    TypeError,
    IndexError,
    OverflowError,
    MemoryError,
    EOFError,
    AssertionError,
)
"""Errors that the MCAP reader raises on damaged input."""


class RecordingError(ValueError):
    """A recording that cannot be read: the message names the file and what is wrong with it."""


def open_reader(path: Path, file: IO[bytes]) -> SeekingReader:
    """A reader of an open file, by its own index or, where there is none, by one made here.

    Raises:
        RecordingError: it is no MCAP file, or damaged.
    """
    size = os.fstat(file.fileno()).st_size
    head = file.read(len(MAGIC))
    if head != MAGIC:
        found = "an empty file" if not size else f"a file that begins with {head!r}"
        raise RecordingError(f"{path}: not a recording (MCAP): it is {found}")
    if not is_whole(path) or _summary_start(path, file, size) == 0:
        return _scan(path, file, size)
    file.seek(0)
    reader = SeekingReader(file, validate_crcs=True, record_size_limit=size)
    try:
        summary = reader.get_summary()
    except DAMAGE as error:
        raise damaged(path, error) from None
    parts = summary and (summary.chunk_indexes, summary.metadata_indexes, summary.channels)
    if summary is None or parts is None or not all(parts) or summary.statistics is None:
        return _scan(path, file, size)
    return reader


def is_whole(path: Path) -> bool:
    """Whether a recording was finished; one that was cut off is read to its last whole chunk.

    Raises:
        OSError: it cannot be opened.
    """
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size < _FOOTER.size + 2 * len(MAGIC):
            return False
        file.seek(size - len(MAGIC))
        return file.read() == MAGIC


def damaged(path: Path, error: BaseException) -> RecordingError:
    """Return the error to raise for one of the MCAP reader."""
    if isinstance(error, RecordingError):
        return error
    reason = str(error) or type(error).__name__
    return RecordingError(f"{path}: damaged recording: {reason.splitlines()[0]}")


def _summary_start(path: Path, file: IO[bytes], size: int) -> int:
    """The byte of the summary, 0 without one; one that is damaged would hide messages."""
    file.seek(size - _FOOTER.size - len(MAGIC))
    footer = file.read(_FOOTER.size)
    opcode, _length, start, _offsets, crc = _FOOTER.unpack(footer)
    if opcode != Opcode.FOOTER or not (start == 0 or len(MAGIC) <= start < size):
        raise RecordingError(f"{path}: damaged recording: its index is said to be at byte {start}")
    if start and crc:
        file.seek(start)
        if zlib.crc32(file.read(size - len(MAGIC) - 4 - start)) != crc:
            raise RecordingError(f"{path}: damaged recording: checksum of its index is wrong")
    return int(start)


def _scan(path: Path, file: IO[bytes], size: int) -> SeekingReader:
    """A reader whose index was made by going through the file once."""
    reader = _ScannedReader(file, size)
    try:
        reader.scan()
    except DAMAGE as error:
        raise damaged(path, error) from None
    if not reader.is_found and not is_whole(path):
        raise RecordingError(f"{path}: ends early after {size} bytes, before its first message")
    return reader


class _ScannedReader(SeekingReader):
    """Reads a file with an index of its own making; chunks stay on the disk.

    Args:
        file: the open file.
        size: its bytes.
    """

    def __init__(self, file: IO[bytes], size: int) -> None:
        file.seek(0)
        super().__init__(file, validate_crcs=True, record_size_limit=size)
        self._size = size
        self._found = Summary()
        self._metadata: list[Metadata] = []
        self._loose: list[Message] = []
        self._times: list[int] = []
        self._count = 0

    @property
    def is_found(self) -> bool:
        """Whether anything was found."""
        return bool(self._metadata or self._count)

    def scan(self) -> None:
        """Go through the records as far as they are whole."""
        at = len(MAGIC)
        while at + _RECORD.size <= self._size:
            self._stream.seek(at)
            opcode, length = _RECORD.unpack(self._stream.read(_RECORD.size))
            end = at + _RECORD.size + length
            if end > self._size or opcode in (Opcode.DATA_END, Opcode.FOOTER):
                break
            self._take(opcode, at, length)
            at = end
        statistics = (self._count, min(self._times, default=0), max(self._times, default=0))
        self._found.statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._found.channels),
            channel_message_counts={},
            chunk_count=len(self._found.chunk_indexes),
            message_count=statistics[0],
            message_end_time=statistics[2],
            message_start_time=statistics[1],
            metadata_count=len(self._metadata),
            schema_count=len(self._found.schemas),
        )

    def _take(self, opcode: int, at: int, length: int) -> None:
        stream = ReadDataStream(self._stream)
        if opcode == Opcode.CHUNK:
            self._take_chunk(Chunk.read(stream), at, length)
        elif opcode == Opcode.SCHEMA:
            self._add(Schema.read(stream))
        elif opcode == Opcode.CHANNEL:
            self._add(Channel.read(stream))
        elif opcode == Opcode.MESSAGE:
            self._add(Message.read(stream, length), loose=True)
        elif opcode == Opcode.METADATA:
            self._metadata.append(Metadata.read(stream))

    def _take_chunk(self, chunk: Chunk, at: int, length: int) -> None:
        channels: dict[int, int] = {}
        first = len(self._times)
        for record in breakup_chunk(chunk, validate_crc=True):
            self._add(record)
            if isinstance(record, Message):
                channels[record.channel_id] = 0
        times = self._times[first:]
        # Of each chunk its first and last message count for the span of the file.
        self._times[first:] = [min(times), max(times)] if times else []
        if not times:
            return
        self._found.chunk_indexes.append(
            ChunkIndex(
                chunk_length=_RECORD.size + length,
                chunk_start_offset=at,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                message_end_time=max(times),
                message_index_length=0,
                message_index_offsets=channels,
                message_start_time=min(times),
                uncompressed_size=chunk.uncompressed_size,
            )
        )

    def _add(self, record: Any, *, loose: bool = False) -> None:
        if isinstance(record, Schema):
            self._found.schemas[record.id] = record
        elif isinstance(record, Channel):
            self._found.channels[record.id] = record
        elif isinstance(record, Message):
            self._count += 1
            self._times.append(record.log_time)
            if loose:
                self._loose.append(record)

    def get_summary(self) -> Summary:
        """Return the summary that `scan` found."""
        return self._found

    def iter_metadata(self) -> Iterator[Metadata]:
        """In the order of the file."""
        return iter(self._metadata)

    def iter_messages(
        self, topics: Iterable[str] | str | None = None, *args: Any, **bounds: Any
    ) -> Iterator[tuple[Schema | None, Channel, Message]]:
        """See `SeekingReader`; messages outside chunks are merged in."""
        in_chunks: Iterator[Any] = iter(())
        if self._found.chunk_indexes:
            in_chunks = super().iter_messages(topics, *args, **bounds)
        return heapq.merge(
            in_chunks, self._outside(topics, **bounds), key=lambda found: found[2].log_time
        )

    def _outside(
        self,
        topics: Iterable[str] | str | None,
        starting_at: int | None = None,
        ending_before: int | None = None,
    ) -> Iterator[tuple[Schema | None, Channel, Message]]:
        for message in sorted(self._loose, key=lambda message: message.log_time):
            channel = self._found.channels[message.channel_id]
            is_wanted = (
                (topics is None or channel.topic in topics)
                and (starting_at is None or message.log_time >= starting_at)
                and (ending_before is None or message.log_time < ending_before)
            )
            if is_wanted:
                yield self._found.schemas.get(channel.schema_id), channel, message
