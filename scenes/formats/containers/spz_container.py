"""SPZ as a container: its header, and its attributes unpacked side by side; all distrusted.

Version 4: 32-byte header, optional extension records, a table of (packed, plain) sizes, then one
zstd stream an attribute. Versions 2 and 3: a 16-byte header and the same attributes in one gzip
stream. Attributes follow each other in the file, splats come in blocks: so every attribute is
unpacked by a stream of its own, which goes on where the last block ended.
"""

from __future__ import annotations

import gzip
import struct
import zlib
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Protocol

import numpy as np
import zstandard
from numpy.typing import NDArray

from scenes.formats.storage.blocks import extents
from scenes.formats.storage.error import FormatError, refusal

MAGIC = b"NGSP"
GZIP_MAGIC = b"\x1f\x8b"
MAX_SPLATS = 50_000_000
COEFFICIENTS = (0, 3, 8, 15, 24)
"""Above degree 0, by degree."""

MAX_INFLATED = 1032
"""Bytes that one byte of a deflate stream can become, by its definition."""

MAX_UNPACKED = 32_768
"""Bytes that one byte of a zstd stream can become: a block of 128 KiB takes 4 bytes at least."""

MAX_WINDOW_BYTES = 1 << 26
"""Window that a zstd stream may look back over, bytes; no level below 22 asks for more."""

MAX_EXTENSION_BYTES = 1 << 18

_SKIP_BYTES = 1 << 20
_FRAME_HEADER_BYTES = 18
_HEADER = struct.Struct("<4sIIBBBB")
_HEADER_4 = struct.Struct("<4sIIBBBBI12x")
_ENTRY = struct.Struct("<QQ")
_EXTENSION = struct.Struct("<II")
_HAS_EXTENSIONS = 0x2
_AXES_EXTENSION = 0xADBE0003
_AXES_UNSTATED_OR_RUB = (0, 4)
_NAMES = ("positions", "alphas", "colors", "scales", "rotations", "sh")

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class SpzFile:
    """Header of an SPZ file.

    Attributes:
        path: the file.
        version: 2 to 4.
        count: splats.
        degree: 0 to 4.
        fractional_bits: of positions.
        flags: 1 antialiased, 2 with extensions.
        streams: first byte and packed size of each attribute's stream; none before version 4.
    """

    path: Path
    version: int
    count: int
    degree: int
    fractional_bits: int
    flags: int
    streams: tuple[tuple[int, int], ...] = ()

    def widths(self) -> tuple[int, ...]:
        """Bytes a splat: positions, alphas, colours, scales, rotations, SH, as in the file."""
        rotation = 3 if self.version == 2 else 4
        return (9, 1, 3, 3, rotation, 3 * COEFFICIENTS[self.degree])


class _Plain(Protocol):
    """Unpacked bytes of one attribute."""

    def read(self, size: int, /) -> bytes: ...


class _Stretch:
    """A stretch of a file, as something to read from."""

    def __init__(self, file: IO[bytes], start: int, size: int) -> None:
        file.seek(start)
        self._file = file
        self._left = size

    def read(self, size: int = -1, /) -> bytes:
        """At most `size` bytes, all that are left by default."""
        data = self._file.read(self._left if size < 0 else min(size, self._left))
        self._left -= len(data)
        return data


def open_spz(path: Path) -> SpzFile:
    """Parse the header, and from version 4 on the table of streams.

    Raises:
        FormatError: the file is truncated, foreign or of another version, or announces more than
            can be in it.
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        start = file.read(_HEADER_4.size)
    if start.startswith(GZIP_MAGIC):
        return _unzip_header(path)
    if start.startswith(MAGIC):
        header = _parse(path, start, (4,))
        return replace(header, streams=_streams(path, header, start))
    raise refusal(path, "byte 0", "neither 'NGSP' nor gzip", "give an SPZ file")


def unpacked(file: SpzFile, rows: int) -> Iterator[tuple[int, list[Bytes]]]:
    """Number of the first splat and the bytes of each attribute, `rows` splats at a time.

    Raises:
        FormatError: the packed data is truncated or damaged, or is more than was announced.
    """
    with ExitStack() as stack:
        columns = (_unpack_columns if file.version == 4 else _unzip_columns)(file, stack)
        for start, stop in extents(file.count, rows):
            parts = [
                np.frombuffer(_take(file.path, column, name, (stop - start) * width), np.uint8)
                for name, column, width in zip(_NAMES, columns, file.widths(), strict=False)
            ]
            yield start, parts + [np.zeros(0, np.uint8)] * (len(_NAMES) - len(parts))
        # What comes after the last splat is read too, and with it a checksum.
        ends = columns if file.version == 4 else columns[-1:]
        more = [_take(file.path, column, "the end", 1, short=True) for column in ends]
        if any(more) and (file.version == 4 or not file.flags & ~1):
            raise refusal(
                file.path,
                "the end",
                "there are more bytes than announced",
                "the file is damaged or foreign",
            )


def spz_start(*, count: int, degree: int, fractional_bits: int, packed: Sequence[int]) -> bytes:
    """Header and table of a file of version 4 whose streams have these packed sizes."""
    header = _HEADER_4.pack(
        MAGIC, 4, count, degree, fractional_bits, 0, len(packed), _HEADER_4.size
    )
    widths = SpzFile(Path(), 4, count, degree, fractional_bits, 0).widths()
    table = [_ENTRY.pack(size, count * w) for size, w in zip(packed, widths, strict=False)]
    return b"".join([header, *table])


def _parse(path: Path, data: bytes, versions: tuple[int, ...]) -> SpzFile:
    if len(data) < _HEADER.size or not data.startswith(MAGIC):
        raise refusal(
            path,
            "byte 0",
            f"no SPZ header ('NGSP' and {_HEADER.size} bytes)",
            "it is truncated or foreign, copy or export it again",
        )
    _, version, count, degree, bits, flags, _ = _HEADER.unpack_from(data)
    if version not in versions:
        raise refusal(
            path,
            "byte 4",
            f"SPZ version {version}, wanted one of {list(versions)}",
            "export it with a current program, or update this one if the file is newer",
        )
    if degree >= len(COEFFICIENTS) or bits > 24 or count > MAX_SPLATS:
        raise refusal(
            path,
            "byte 8",
            f"{count} splats of degree {degree} with {bits} fractional bits, "
            f"limits {MAX_SPLATS}, {len(COEFFICIENTS) - 1} and 24",
            "the file is damaged, export it again",
        )
    return SpzFile(path, version, count, degree, bits, flags)


def _unzip_header(path: Path) -> SpzFile:
    """Versions 2 and 3."""
    with gzip.open(path) as stream:
        header = _parse(path, _take(path, stream, "header", _HEADER.size), (2, 3))
    wanted, size = header.count * sum(header.widths()), path.stat().st_size
    if wanted > MAX_INFLATED * size:
        raise refusal(
            path,
            f"byte {size}",
            f"the file ends there, {wanted} bytes cannot be unpacked from it",
            "it is truncated, copy or export it again",
        )
    return header


def _unzip_columns(file: SpzFile, stack: ExitStack) -> list[_Plain]:
    """Versions 2 and 3: the one stream, unpacked for each attribute from its place on."""
    columns: list[_Plain] = []
    at = _HEADER.size
    for name, width in zip(_NAMES, file.widths(), strict=True):
        stream = stack.enter_context(gzip.GzipFile(file.path))
        for start, stop in extents(at, _SKIP_BYTES):
            _take(file.path, stream, name, stop - start)
        columns.append(stream)
        at += file.count * width
    return columns


def _unpack_columns(file: SpzFile, stack: ExitStack) -> list[_Plain]:
    """Version 4: a stream for each attribute."""
    columns: list[_Plain] = []
    for place in file.streams:
        packed = _Stretch(stack.enter_context(file.path.open("rb")), *place)
        # The stubs ask for a whole file object, the stream reader for `read` only.
        unpacker = zstandard.ZstdDecompressor(max_window_size=MAX_WINDOW_BYTES)
        columns.append(unpacker.stream_reader(packed))  # pyright: ignore
    return columns


def _streams(path: Path, header: SpzFile, start: bytes) -> tuple[tuple[int, int], ...]:
    """Version 4: the first byte and the packed size of each attribute's stream."""
    widths = [width for width in header.widths() if width * header.count]
    file_size = path.stat().st_size
    if len(start) < _HEADER_4.size:
        raise refusal(
            path, f"byte {len(start)}", "the file ends inside the header", "copy or export it again"
        )
    *_, streams, offset = _HEADER_4.unpack(start)
    end = offset + streams * _ENTRY.size
    latest = min(file_size - streams * _ENTRY.size, _HEADER_4.size + MAX_EXTENSION_BYTES)
    if streams != len(widths) or not _HEADER_4.size <= offset <= latest:
        raise refusal(
            path,
            "byte 15",
            f"{streams} streams with a table at byte {offset}, "
            f"wanted {len(widths)} streams and at most byte {latest}",
            "the file is truncated or damaged, copy or export it again",
        )
    found: list[tuple[int, int]] = []
    with path.open("rb") as file:
        file.seek(_HEADER_4.size)
        if header.flags & _HAS_EXTENSIONS:
            _refuse_other_axes(path, file.read(offset - _HEADER_4.size))
        file.seek(offset)
        table = list(_ENTRY.iter_unpack(file.read(streams * _ENTRY.size)))
        for name, width, (packed, plain) in zip(_NAMES, widths, table, strict=False):
            size = width * header.count
            if plain != size or not size <= MAX_UNPACKED * packed <= MAX_UNPACKED * (
                file_size - end
            ):
                raise refusal(
                    path,
                    f"byte {end} ({name})",
                    f"{packed} bytes for {plain}, wanted {size} out of at most {file_size - end}",
                    "the file is truncated or damaged, copy or export it again",
                )
            _check_frame(path, name, _Stretch(file, end, packed).read(_FRAME_HEADER_BYTES), size)
            found.append((end, packed))
            end += packed
    return tuple(found)


def _check_frame(path: Path, name: str, start: bytes, size: int) -> None:
    try:
        announced = zstandard.frame_content_size(start)
    except zstandard.ZstdError as error:
        raise _unpacking_failed(path, name, error) from None
    if announced not in (size, -1):
        raise refusal(
            path, name, f"zstd frame of {announced} bytes, wanted {size}", "export it again"
        )


def _take(path: Path, column: _Plain, name: str, size: int, *, short: bool = False) -> bytes:
    """The next `size` bytes; fewer are refused unless `short`."""
    try:
        data = column.read(size)
    except (zlib.error, gzip.BadGzipFile, EOFError, zstandard.ZstdError) as error:
        raise _unpacking_failed(path, name, error) from None
    if len(data) < size and not short:
        raise refusal(
            path,
            name,
            f"the file ends there, {len(data)} bytes unpacked where {size} are wanted",
            "it is truncated, copy or export it again",
        )
    return data


def _unpacking_failed(path: Path, name: str, error: Exception) -> FormatError:
    kind = "zstd" if isinstance(error, zstandard.ZstdError) else "gzip"
    return refusal(
        path,
        name,
        f"{kind}: {error}",
        "the file is truncated or damaged, copy or export it again",
    )


def _refuse_other_axes(path: Path, records: bytes) -> None:
    """Extensions are skipped, as the format allows, but for the one that changes the axes."""
    at = 0
    while at + _EXTENSION.size <= len(records):
        kind, size = _EXTENSION.unpack_from(records, at)
        axes = int.from_bytes(records[at + _EXTENSION.size :][: min(size, 4)], "little")
        if kind == _AXES_EXTENSION and axes not in _AXES_UNSTATED_OR_RUB:
            raise refusal(
                path,
                f"byte {_HEADER_4.size + at}",
                f"stored in axes number {axes}, wanted x right, y up, z back (4)",
                "export it without the coordinate-system extension",
            )
        at += _EXTENSION.size + size
