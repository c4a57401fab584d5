"""SPZ, Niantic's compressed splats (MIT, github.com/nianticlabs/spz): versions 2 to 4 in, 4 out.

Version 4: 32-byte header, optional extension records, a table of (compressed, plain) sizes, then
one zstd stream an attribute. Versions 2 and 3: a 16-byte header and the same attributes in one
gzip stream. Attributes: positions 24-bit fixed point, alphas, colours, log scales at 1/16,
rotations (version 2: x, y, z as bytes; later the three smallest of x, y, z, w in 10 bits each), SH
bytes with the colour channel innermost.

The file's axes are x right, y up, z back; clouds come out, and go in, with x right, y down,
z forward as in PLY files (`scenes.frames.RDF_FROM_RUB`), so that the same scene read from either is
the same cloud. Degree 4 is read without its last band, which no renderer here evaluates.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

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
from scenes.formats.error import refusal
from scenes.frames import RDF_FROM_RUB
from scenes.harmonics import turning_matrix
from scenes.splats import SplatCloud

MAGIC = b"NGSP"
GZIP_MAGIC = b"\x1f\x8b"
MAX_SPLATS = 50_000_000
COLOUR_SCALE = 0.15
FRACTIONAL_BITS = 12
ZSTD_LEVEL = 9
LONGEST_XYZ = 1.02
"""Norm of a version 2 rotation's x, y, z: 1 and the rounding of three bytes."""

_HEADER = struct.Struct("<4sIIBBBB")
_HEADER_4 = struct.Struct("<4sIIBBBBI12x")
_ENTRY = struct.Struct("<QQ")
_EXTENSION = struct.Struct("<II")
_HAS_EXTENSIONS = 0x2
_AXES_EXTENSION = 0xADBE0003
_AXES_UNSTATED_OR_RUB = (0, 4)
_COEFFICIENTS = (0, 3, 8, 15, 24)
_NAMES = ("positions", "alphas", "colors", "scales", "rotations", "sh")

_SIGNS = np.diag(RDF_FROM_RUB.rotation).astype(np.float32)
_SH_SIGNS = np.diag(turning_matrix(RDF_FROM_RUB.rotation, 3)).astype(np.float32)
# R' = F R F for a flip F of two axes; wxyz.
_QUATERNION_SIGNS = np.concatenate([[1.0], _SIGNS]).astype(np.float32)


@dataclass(frozen=True, slots=True)
class _Header:
    version: int
    count: int
    degree: int
    fractional_bits: int
    flags: int

    def sizes(self) -> tuple[int, ...]:
        """Bytes per attribute, in the order of the file."""
        rotation = 3 if self.version == 2 else 4
        return tuple(
            self.count * each for each in (9, 1, 3, 3, rotation, 3 * _COEFFICIENTS[self.degree])
        )


@damaged_values_are_quiet
def read_spz(path: Path) -> SplatCloud:
    """Read an SPZ file of version 2, 3 or 4; axes x right, y down, z forward, the file's unit.

    Raises:
        FormatError: the file is truncated, damaged, foreign or of another version.
        OSError: the file cannot be read.
    """
    data = path.read_bytes()
    if data.startswith(GZIP_MAGIC):
        header, parts = _unzip(path, data)
    elif data.startswith(MAGIC):
        header, parts = _unpack_streams(path, data)
    else:
        raise refusal(path, "byte 0", "neither 'NGSP' nor gzip", "give an SPZ file")
    return _decode(path, header, [np.frombuffer(part, dtype=np.uint8) for part in parts])


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
    bits = _fractional_bits(path, cloud)
    streams = [stream.tobytes() for stream in _encode(cloud, bits) if stream.size]
    packed = [zstandard.ZstdCompressor(level=ZSTD_LEVEL).compress(stream) for stream in streams]
    header = _HEADER_4.pack(
        MAGIC, 4, len(cloud), cloud.sh_degree, bits, 0, len(streams), _HEADER_4.size
    )
    table = [_ENTRY.pack(len(p), len(s)) for p, s in zip(packed, streams, strict=True)]
    return write_file(path, [header, *table, *packed])


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


def _unzip(path: Path, data: bytes) -> tuple[_Header, list[memoryview]]:
    """Versions 2 and 3. Memory is bounded by what the header announces."""
    stream = zlib.decompressobj(wbits=16 + zlib.MAX_WBITS)
    try:
        start = stream.decompress(data, _HEADER.size)
        header = _parse(path, start, (2, 3))
        wanted = sum(header.sizes())
        plain = stream.decompress(stream.unconsumed_tail, wanted) if wanted else b""
        # One byte more forces the end of the stream, and with it the checksum, to be read.
        more = stream.decompress(stream.unconsumed_tail, 1)
    except zlib.error as error:
        raise refusal(
            path, "", f"gzip: {error}", "the file is damaged, copy or export it again"
        ) from None
    if len(plain) < wanted or not (stream.eof or more):
        raise refusal(
            path,
            f"byte {len(data)}",
            f"the file ends there after {len(plain)} of {wanted} unpacked bytes",
            "it is truncated, copy or export it again",
        )
    if more and not header.flags & ~1:
        raise refusal(
            path, "", f"more than the {wanted} announced bytes", "the file is damaged or foreign"
        )
    return header, _split(plain, header.sizes())


def _unpack_streams(path: Path, data: bytes) -> tuple[_Header, list[memoryview]]:
    """Version 4."""
    header = _parse(path, data, (4,))
    sizes = [size for size in header.sizes() if size]
    if len(data) < _HEADER_4.size:
        raise refusal(
            path, f"byte {len(data)}", "the file ends inside the header", "copy or export it again"
        )
    *_, streams, offset = _HEADER_4.unpack_from(data)
    end = offset + streams * _ENTRY.size
    if streams != len(sizes) or offset < _HEADER_4.size or end > len(data):
        raise refusal(
            path,
            "byte 15",
            f"{streams} streams with a table at byte {offset} of {len(data)}, "
            f"wanted {len(sizes)} streams",
            "the file is truncated or damaged, copy or export it again",
        )
    if header.flags & _HAS_EXTENSIONS:
        _refuse_other_axes(path, data[_HEADER_4.size : offset])
    parts: list[memoryview] = []
    whole = memoryview(data)
    for i, size in enumerate(sizes):
        packed, plain = _ENTRY.unpack_from(data, offset + i * _ENTRY.size)
        name = _NAMES[i]
        if plain != size or packed > len(data) - end:
            raise refusal(
                path,
                f"byte {end} ({name})",
                f"{packed} bytes for {plain}, wanted {size} out of at most {len(data) - end}",
                "the file is truncated or damaged, copy or export it again",
            )
        parts.append(memoryview(_decompress(path, name, whole[end : end + packed], size)))
        end += packed
    parts += [memoryview(b"")] * (len(_NAMES) - len(parts))
    return header, parts


def _decompress(path: Path, name: str, packed: memoryview, size: int) -> bytes:
    try:
        announced = zstandard.frame_content_size(packed)
        if announced not in (size, -1):
            raise refusal(
                path, name, f"zstd frame of {announced} bytes, wanted {size}", "export it again"
            )
        plain = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    except zstandard.ZstdError as error:
        raise refusal(
            path, name, f"zstd: {error}", "the file is damaged, export it again"
        ) from None
    if len(plain) != size:
        raise refusal(path, name, f"{len(plain)} bytes, wanted {size}", "export it again")
    return plain


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


def _split(plain: bytes, sizes: tuple[int, ...]) -> list[memoryview]:
    whole, parts, at = memoryview(plain), [], 0
    for size in sizes:
        parts.append(whole[at : at + size])
        at += size
    return parts


def _decode(path: Path, header: _Header, parts: list[NDArray[np.uint8]]) -> SplatCloud:
    positions, alphas, colours, scales, rotations, sh = parts
    n = header.count
    kept = min(_COEFFICIENTS[header.degree], _COEFFICIENTS[3])
    dc = (colours.reshape(n, 1, 3) / 255.0 - 0.5) / COLOUR_SCALE
    rest = (sh.reshape(n, _COEFFICIENTS[header.degree], 3)[:, :kept].astype(np.float64) - 128) / 128
    rest *= _SH_SIGNS[1 : 1 + kept, None]
    fixed = np.zeros((n, 3, 4), dtype=np.uint8)
    fixed[:, :, 1:] = positions.reshape(n, 3, 3)
    # The three bytes fill the upper part of the word, so shifting back extends the sign.
    means = (fixed.view("<i4")[..., 0] >> 8) / float(1 << header.fractional_bits) * _SIGNS
    return cloud_from_file(
        path,
        means=means.astype(np.float32),
        scales=exponential((scales.reshape(n, 3) / 16.0 - 10.0).astype(np.float32)),
        quaternions=_decode_rotations(path, header, rotations) * _QUATERNION_SIGNS,
        opacities=alphas.astype(np.float32) / np.float32(255.0),
        sh=np.concatenate([dc, rest], axis=1).astype(np.float32),
    )


def _decode_rotations(
    path: Path, header: _Header, packed: NDArray[np.uint8]
) -> NDArray[np.float32]:
    """(N, 4) wxyz in the file's axes."""
    if header.version == 2:
        xyz = packed.reshape(header.count, 3) / 127.5 - 1.0
        squares = np.sum(xyz * xyz, axis=1, keepdims=True)
        if (squares > LONGEST_XYZ**2).any():
            first = int(np.argmax(squares > LONGEST_XYZ**2))
            raise refusal(
                path,
                f"splat {first}",
                f"quaternion norm: x, y, z alone have norm {np.sqrt(squares[first, 0]):.3f}, "
                f"limit {LONGEST_XYZ}",
                "the file is damaged, export it again",
            )
        w = np.sqrt(np.maximum(0.0, 1.0 - squares))
        return np.concatenate([w, xyz], axis=1).astype(np.float32)
    words = packed.reshape(header.count, 4).view("<u4")
    fields = words >> np.array([20, 10, 0], dtype=np.uint32)
    sign = 1.0 - 2.0 * ((fields >> np.uint32(9)) & np.uint32(1))
    three = sign * (fields & np.uint32(511)) / 511.0 * np.sqrt(0.5)
    xyzw = rotations_from_three(path, three, (words[:, 0] >> np.uint32(30)).astype(np.intp))
    return np.roll(xyzw, 1, axis=1)


def _fractional_bits(path: Path, cloud: SplatCloud) -> int:
    furthest = float(np.abs(cloud.means).max(initial=0.0))
    if not furthest < 2.0**23 - 1 or len(cloud) > MAX_SPLATS:
        raise refusal(
            path,
            "",
            f"{len(cloud)} splats as far as {furthest:g}, limits {MAX_SPLATS} and 2²³",
            "write a PLY instead",
        )
    bits = FRACTIONAL_BITS
    while round(furthest * 2.0**bits) >= 2**23:
        bits -= 1
    return bits


def _encode(cloud: SplatCloud, bits: int) -> list[NDArray[np.uint8]]:
    fixed = np.rint(cloud.means.astype(np.float64) * _SIGNS * 2.0**bits).astype("<i4")
    sh = cloud.sh[:, 1:] * _SH_SIGNS[1 : cloud.sh.shape[1], None]
    bucket = np.where(np.arange(cloud.sh.shape[1] - 1) < 3, 8, 16)[:, None]
    levels = (np.rint(sh * 128.0).astype(np.int64) + 128 + bucket // 2) // bucket * bucket
    return [
        fixed[..., None].view(np.uint8)[..., :3],
        _bytes(cloud.opacities * 255.0),
        _bytes(cloud.sh[:, 0] * (COLOUR_SCALE * 255.0) + 127.5),
        _bytes((logarithm(cloud.scales) + 10.0) * 16.0),
        _encode_rotations(np.roll(cloud.rotations * _QUATERNION_SIGNS, -1, axis=1)),
        _bytes(levels),
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
