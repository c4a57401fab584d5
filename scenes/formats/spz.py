"""SPZ, Niantic's compressed splats (MIT, github.com/nianticlabs/spz): versions 2 to 4 in, 4 out.

Version 4: 32-byte header, optional extension records, a table of (compressed, plain) sizes, then
one zstd stream an attribute. Versions 2 and 3: a 16-byte header and the same attributes in one
gzip stream. Attributes: positions 24-bit fixed point, alphas, colours, log scales at 1/16,
rotations (version 2: x, y, z as bytes; later the three smallest of x, y, z, w in 10 bits each), SH
bytes with the colour channel innermost.

The file's axes are x right, y up, z back; clouds come out, and go in, with x right, y down,
z forward as in PLY files (`scenes.formats.axes`), so that the same scene read from either is the
same cloud. Degree 4 is read without its last band, which no renderer here evaluates.

Attributes follow each other in the file, splats come in blocks: a reader unpacks all attributes at
once, each with a stream of its own, and a writer sets packed attributes aside on disk.
"""

from __future__ import annotations

import gzip
import struct
import zlib
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Protocol

import numpy as np
import zstandard
from numpy.typing import NDArray

from scenes.formats.activation import (
    cloud_from_file,
    damaged_values_are_quiet,
    exponential,
    logarithm,
    rotations_from_three,
)
from scenes.formats.atomic import write_file
from scenes.formats.axes import flipped
from scenes.formats.blocks import ROWS_PER_BLOCK, SplatBlocks, extents, in_blocks, whole
from scenes.formats.error import FormatError, refusal
from scenes.formats.spool import contents, spools
from scenes.splats import SplatCloud

MAGIC = b"NGSP"
GZIP_MAGIC = b"\x1f\x8b"
MAX_SPLATS = 50_000_000
COLOUR_SCALE = 0.15
FRACTIONAL_BITS = 12
ZSTD_LEVEL = 9
MOST_INFLATED = 1032
"""Bytes that one byte of a deflate stream can become, by its definition."""

LONGEST_XYZ = 1.02
"""Norm of a version 2 rotation's x, y, z: 1 and the rounding of three bytes."""

_SKIP_BYTES = 1 << 20
_FRAME_HEADER_BYTES = 18

_HEADER = struct.Struct("<4sIIBBBB")
_HEADER_4 = struct.Struct("<4sIIBBBBI12x")
_ENTRY = struct.Struct("<QQ")
_EXTENSION = struct.Struct("<II")
_HAS_EXTENSIONS = 0x2
_AXES_EXTENSION = 0xADBE0003
_AXES_UNSTATED_OR_RUB = (0, 4)
_COEFFICIENTS = (0, 3, 8, 15, 24)
_NAMES = ("positions", "alphas", "colors", "scales", "rotations", "sh")


@dataclass(frozen=True, slots=True)
class _Header:
    version: int
    count: int
    degree: int
    fractional_bits: int
    flags: int

    def widths(self) -> tuple[int, ...]:
        """Bytes a splat of each attribute, in the order of the file."""
        rotation = 3 if self.version == 2 else 4
        return (9, 1, 3, 3, rotation, 3 * _COEFFICIENTS[self.degree])


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


def read_spz(path: Path) -> SplatCloud:
    """Read an SPZ file of version 2, 3 or 4; axes x right, y down, z forward, the file's unit.

    Raises:
        FormatError: the file is truncated, damaged, foreign or of another version.
        OSError: the file cannot be read.
    """
    return whole(read_spz_blocks(path))


def read_spz_blocks(path: Path, rows: int = ROWS_PER_BLOCK) -> SplatBlocks:
    """As `read_spz`, `rows` splats at a time; damage is found where its block is read."""
    with path.open("rb") as file:
        start = file.read(_HEADER_4.size)
    if start.startswith(GZIP_MAGIC):
        header = _unzipped_header(path)
        blocks = _read_zipped(path, header, rows)
    elif start.startswith(MAGIC):
        header = _parse(path, start, (4,))
        blocks = _read_streams(path, header, _streams(path, header, start), rows)
    else:
        raise refusal(path, "byte 0", "neither 'NGSP' nor gzip", "give an SPZ file")
    return SplatBlocks(header.count, min(header.degree, 3), blocks)


def write_spz(path: Path, cloud: SplatCloud) -> int:
    """Write SPZ version 4, atomic; the cloud's axes are x right, y down, z forward.

    Lossy: positions to 2⁻¹² of the unit (coarser beyond ±2048), scales to 6 %, opacity and colour
    to 8 bits, SH to 5 bits (degree 1) and 4 bits (above) within ±1, as Niantic's own writer.

    Returns:
        The size of the file in bytes.

    Raises:
        FormatError: a position is beyond ±2²³ or there are too many splats.
        WriteError: the disk is full or the folder is not writable; nothing is left behind.
    """
    return write_spz_blocks(path, in_blocks(cloud))


def write_spz_blocks(path: Path, splats: SplatBlocks) -> int:
    """As `write_spz`, with one block in memory at a time and attributes set aside on disk."""
    if splats.count > MAX_SPLATS:
        raise refusal(path, "", f"{splats.count} splats, limit {MAX_SPLATS}", "write a PLY instead")
    return write_file(path, _packed(path, splats))


def _parse(path: Path, data: bytes, versions: tuple[int, ...]) -> _Header:
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
    if degree >= len(_COEFFICIENTS) or bits > 24 or count > MAX_SPLATS:
        raise refusal(
            path,
            "byte 8",
            f"{count} splats of degree {degree} with {bits} fractional bits, "
            f"limits {MAX_SPLATS}, {len(_COEFFICIENTS) - 1} and 24",
            "the file is damaged, export it again",
        )
    return _Header(version, count, degree, bits, flags)


def _unzipped_header(path: Path) -> _Header:
    """Versions 2 and 3."""
    with gzip.open(path) as stream:
        header = _parse(path, _take(path, stream, "header", _HEADER.size), (2, 3))
    wanted, size = header.count * sum(header.widths()), path.stat().st_size
    if wanted > MOST_INFLATED * size:
        raise refusal(
            path,
            f"byte {size}",
            f"the file ends there, {wanted} bytes cannot be unpacked from it",
            "it is truncated, copy or export it again",
        )
    return header


def _read_zipped(path: Path, header: _Header, rows: int) -> Iterator[SplatCloud]:
    """Versions 2 and 3: one gzip stream, unpacked once for each attribute and from its place on."""
    with ExitStack() as stack:
        columns: list[_Plain] = []
        at = _HEADER.size
        for name, width in zip(_NAMES, header.widths(), strict=True):
            stream = stack.enter_context(gzip.open(path))
            _skip(path, stream, name, at)
            columns.append(stream)
            at += header.count * width
        yield from _blocks(path, header, columns, rows)
        # What comes after the last attribute is read too, and with it the checksum.
        more = _take(path, columns[-1], "end", 1, short=True)
    if more and not header.flags & ~1:
        raise refusal(
            path, "", f"more than the {at} announced bytes", "the file is damaged or foreign"
        )


def _streams(path: Path, header: _Header, start: bytes) -> list[tuple[int, int]]:
    """Version 4: the first byte and the packed size of each attribute's stream."""
    widths = [width for width in header.widths() if width * header.count]
    file_size = path.stat().st_size
    if len(start) < _HEADER_4.size:
        raise refusal(
            path, f"byte {len(start)}", "the file ends inside the header", "copy or export it again"
        )
    *_, streams, offset = _HEADER_4.unpack(start)
    end = offset + streams * _ENTRY.size
    if streams != len(widths) or offset < _HEADER_4.size or end > file_size:
        raise refusal(
            path,
            "byte 15",
            f"{streams} streams with a table at byte {offset} of {file_size}, "
            f"wanted {len(widths)} streams",
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
            if plain != size or packed > file_size - end:
                raise refusal(
                    path,
                    f"byte {end} ({name})",
                    f"{packed} bytes for {plain}, wanted {size} out of at most {file_size - end}",
                    "the file is truncated or damaged, copy or export it again",
                )
            _check_frame(path, name, _Stretch(file, end, packed).read(_FRAME_HEADER_BYTES), size)
            found.append((end, packed))
            end += packed
    return found


def _check_frame(path: Path, name: str, start: bytes, size: int) -> None:
    try:
        announced = zstandard.frame_content_size(start)
    except zstandard.ZstdError as error:
        raise _unpacking_failed(path, name, error) from None
    if announced not in (size, -1):
        raise refusal(
            path, name, f"zstd frame of {announced} bytes, wanted {size}", "export it again"
        )


def _read_streams(
    path: Path, header: _Header, places: list[tuple[int, int]], rows: int
) -> Iterator[SplatCloud]:
    """Version 4: a stream for each attribute."""
    with ExitStack() as stack:
        columns: list[_Plain] = []
        for place in places:
            packed = _Stretch(stack.enter_context(path.open("rb")), *place)
            # The stubs ask for a whole file object, the stream reader for `read` only.
            columns.append(zstandard.ZstdDecompressor().stream_reader(packed))  # pyright: ignore
        yield from _blocks(path, header, columns, rows)
        for name, column in zip(_NAMES, columns, strict=False):
            if _take(path, column, name, 1, short=True):
                raise refusal(path, name, "more bytes than announced", "export it again")


def _blocks(path: Path, header: _Header, columns: list[_Plain], rows: int) -> Iterator[SplatCloud]:
    widths = header.widths()
    for start, stop in extents(header.count, rows):
        parts = [
            np.frombuffer(_take(path, column, name, (stop - start) * width), dtype=np.uint8)
            for name, column, width in zip(_NAMES, columns, widths, strict=False)
        ]
        parts += [np.zeros(0, dtype=np.uint8)] * (len(_NAMES) - len(parts))
        yield flipped(_decode(path, header, start, stop - start, parts))


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


def _skip(path: Path, column: _Plain, name: str, size: int) -> None:
    for start, stop in extents(size, _SKIP_BYTES):
        _take(path, column, name, stop - start)


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


@damaged_values_are_quiet
def _decode(
    path: Path, header: _Header, start: int, n: int, parts: list[NDArray[np.uint8]]
) -> SplatCloud:
    """`n` splats in the file's axes."""
    positions, alphas, colours, scales, rotations, sh = parts
    kept = min(_COEFFICIENTS[header.degree], _COEFFICIENTS[3])
    dc = (colours.reshape(n, 1, 3) / 255.0 - 0.5) / COLOUR_SCALE
    rest = (sh.reshape(n, _COEFFICIENTS[header.degree], 3)[:, :kept].astype(np.float64) - 128) / 128
    fixed = np.zeros((n, 3, 4), dtype=np.uint8)
    fixed[:, :, 1:] = positions.reshape(n, 3, 3)
    # The three bytes fill the upper part of the word, so shifting back extends the sign.
    means = (fixed.view("<i4")[..., 0] >> 8) / float(1 << header.fractional_bits)
    return cloud_from_file(
        path,
        means=means.astype(np.float32),
        scales=exponential((scales.reshape(n, 3) / 16.0 - 10.0).astype(np.float32)),
        quaternions=_decode_rotations(path, header, start, rotations),
        opacities=alphas.astype(np.float32) / np.float32(255.0),
        sh=np.concatenate([dc, rest], axis=1).astype(np.float32),
        start=start,
    )


def _decode_rotations(
    path: Path, header: _Header, start: int, packed: NDArray[np.uint8]
) -> NDArray[np.float32]:
    """(N, 4) wxyz in the file's axes."""
    if header.version == 2:
        xyz = packed.reshape(-1, 3) / 127.5 - 1.0
        squares = np.sum(xyz * xyz, axis=1, keepdims=True)
        if (squares > LONGEST_XYZ**2).any():
            first = int(np.argmax(squares > LONGEST_XYZ**2))
            raise refusal(
                path,
                f"splat {start + first}",
                f"quaternion norm: x, y, z alone have norm {np.sqrt(squares[first, 0]):.3f}, "
                f"limit {LONGEST_XYZ}",
                "the file is damaged, export it again",
            )
        w = np.sqrt(np.maximum(0.0, 1.0 - squares))
        return np.concatenate([w, xyz], axis=1).astype(np.float32)
    words = packed.reshape(-1, 4).view("<u4")
    fields = words >> np.array([20, 10, 0], dtype=np.uint32)
    sign = 1.0 - 2.0 * ((fields >> np.uint32(9)) & np.uint32(1))
    three = sign * (fields & np.uint32(511)) / 511.0 * np.sqrt(0.5)
    largest = (words[:, 0] >> np.uint32(30)).astype(np.intp)
    xyzw = rotations_from_three(path, three, largest, start=start)
    return np.roll(xyzw, 1, axis=1)


def _packed(path: Path, splats: SplatBlocks) -> Iterator[bytes]:
    """The file in order, once all blocks have been packed and set aside."""
    header = _Header(4, splats.count, splats.sh_degree, FRACTIONAL_BITS, 0)
    widths = [width for width in header.widths() if width * splats.count]
    with spools(path, len(widths) + 1) as (means, *streams):
        packers = [
            zstandard.ZstdCompressor(level=ZSTD_LEVEL).compressobj(size=width * splats.count)
            for width in widths
        ]
        furthest = 0.0
        for cloud in map(flipped, splats.blocks):
            furthest = max(furthest, float(np.abs(cloud.means).max(initial=0.0)))
            means.write(cloud.means.astype("<f4").tobytes())
            for packer, stream, part in zip(packers[1:], streams[1:], _encode(cloud), strict=False):
                stream.write(packer.compress(part.tobytes()))
        # How finely positions are stored depends on the furthest, so they are packed last.
        bits = _fractional_bits(path, furthest)
        for raw in contents(means, 12 * ROWS_PER_BLOCK):
            streams[0].write(packers[0].compress(_encode_positions(raw, bits)))
        for packer, stream in zip(packers, streams, strict=True):
            stream.write(packer.flush())
        yield _HEADER_4.pack(
            MAGIC, 4, splats.count, splats.sh_degree, bits, 0, len(streams), _HEADER_4.size
        )
        for stream, width in zip(streams, widths, strict=True):
            yield _ENTRY.pack(stream.tell(), width * splats.count)
        for stream in streams:
            yield from contents(stream)


def _fractional_bits(path: Path, furthest: float) -> int:
    if not furthest < 2.0**23 - 1:
        raise refusal(
            path, "", f"a splat as far as {furthest:g}, limits ±2²³", "write a PLY instead"
        )
    bits = FRACTIONAL_BITS
    while round(furthest * 2.0**bits) >= 2**23:
        bits -= 1
    return bits


def _encode_positions(raw: bytes, bits: int) -> bytes:
    """24-bit fixed point of float32."""
    means = np.frombuffer(raw, dtype="<f4").astype(np.float64)
    fixed = np.rint(means * 2.0**bits).astype("<i4")
    return fixed[:, None].view(np.uint8)[:, :3].tobytes()


def _encode(cloud: SplatCloud) -> list[NDArray[np.uint8]]:
    """All attributes but the positions of a cloud in the file's axes."""
    bucket = np.where(np.arange(cloud.sh.shape[1] - 1) < 3, 8, 16)[:, None]
    steps = np.rint(cloud.sh[:, 1:] * 128.0).astype(np.int64)
    return [
        _bytes(cloud.opacities * 255.0),
        _bytes(cloud.sh[:, 0] * (COLOUR_SCALE * 255.0) + 127.5),
        _bytes((logarithm(cloud.scales) + 10.0) * 16.0),
        _encode_rotations(np.roll(cloud.rotations, -1, axis=1)),
        _bytes((steps + 128 + bucket // 2) // bucket * bucket),
    ]


def _encode_rotations(xyzw: NDArray[np.float32]) -> NDArray[np.uint8]:
    rows = np.arange(len(xyzw))
    largest = np.argmax(np.abs(xyzw), axis=1)
    signed = xyzw * np.where(xyzw[rows, largest] < 0, -1.0, 1.0)[:, None]
    words = largest.astype(np.uint32)
    others = np.array([[j for j in range(4) if j != i] for i in range(4)])[largest]
    for column in others.T:
        component = signed[rows, column]
        size = np.minimum(np.abs(component) * np.sqrt(2.0) * 511.0 + 0.5, 511.0).astype(np.uint32)
        words = (
            (words << np.uint32(10)) | ((component < 0).astype(np.uint32) << np.uint32(9)) | size
        )
    return words.astype("<u4").view(np.uint8)


def _bytes(values: NDArray[np.generic]) -> NDArray[np.uint8]:
    return np.clip(np.rint(values.astype(np.float64)), 0, 255).astype(np.uint8)
