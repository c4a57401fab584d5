# pyright: standard
"""SPZ, Niantic's compressed splats (MIT, github.com/nianticlabs/spz): versions 2 to 4 in, 4 out.

Attributes: positions 24-bit fixed point, alphas, colours, log scales at 1/16, rotations (version 2:
x, y, z as bytes; later the three smallest of x, y, z, w in 10 bits each), SH bytes with the colour
channel innermost. `scenes.formats.containers.spz_container` packs and unpacks them.

The file's axes are x right, y up, z back; clouds come out, and go in, with x right, y down,
z forward as in PLY files (`scenes.formats.storage.axes`): the same scene read from either is
the same cloud. Degree 4 is read without its last band, which no renderer here evaluates.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import zstandard
from numpy.typing import NDArray

from scenes.formats.containers.spz_container import (
    COEFFICIENTS,
    MAX_SPLATS,
    SpzFile,
    open_spz,
    spz_start,
    unpacked,
)
from scenes.formats.storage.activation import (
    cloud_from_file,
    damaged_values_are_quiet,
    exponential,
    logarithm,
    rotations_from_three,
)
from scenes.formats.storage.atomic import write_file
from scenes.formats.storage.axes import flipped
from scenes.formats.storage.bad_rows import intact, without_bad_rows
from scenes.formats.storage.blocks import ROWS_PER_BLOCK, SplatBlocks, in_blocks
from scenes.formats.storage.error import refusal
from scenes.formats.storage.spool import contents, spools
from scenes.splats import SplatCloud

COLOUR_SCALE = 0.15
FRACTIONAL_BITS = 12
ZSTD_LEVEL = 9
MAX_XYZ = 1.02
"""Norm of a version 2 rotation's x, y, z: 1 and the rounding of three bytes."""


def read_spz(path: Path) -> SplatCloud:
    """Read an SPZ file of version 2, 3 or 4; axes x right, y down, z forward, the file's unit.

    Raises:
        FormatError: the file is truncated, damaged, foreign or of another version.
        OSError: the file cannot be read.
    """
    return intact(path, read_spz_blocks(path))


def read_spz_blocks(path: Path, rows: int = ROWS_PER_BLOCK) -> SplatBlocks:
    """As `read_spz`, `rows` splats at a time; damage is found where its block is read."""
    file = open_spz(path)
    blocks = (flipped(_decode(file, parts)) for _, parts in unpacked(file, rows))
    return without_bad_rows(path, SplatBlocks(file.count, min(file.degree, 3), blocks))


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
    return write_file(path, _pack(path, splats))


@damaged_values_are_quiet
def _decode(file: SpzFile, parts: list[NDArray[np.uint8]]) -> SplatCloud:
    """Splats in the file's axes."""
    positions, alphas, colours, scales, rotations, sh = parts
    n = len(alphas)
    kept = min(COEFFICIENTS[file.degree], COEFFICIENTS[3])
    dc = (colours.reshape(n, 1, 3) / 255.0 - 0.5) / COLOUR_SCALE
    rest = (sh.reshape(n, COEFFICIENTS[file.degree], 3)[:, :kept].astype(np.float64) - 128) / 128
    fixed = np.zeros((n, 3, 4), dtype=np.uint8)
    fixed[:, :, 1:] = positions.reshape(n, 3, 3)
    # The three bytes fill the upper part of the word, so shifting back extends the sign.
    means = (fixed.view("<i4")[..., 0] >> 8) / float(1 << file.fractional_bits)
    return cloud_from_file(
        means=means.astype(np.float32),
        scales=exponential((scales.reshape(n, 3) / 16.0 - 10.0).astype(np.float32)),
        quaternions=_decode_rotations(file, rotations),
        opacities=alphas.astype(np.float32) / np.float32(255.0),
        sh=np.concatenate([dc, rest], axis=1).astype(np.float32),
    )


def _decode_rotations(file: SpzFile, packed: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(N, 4) wxyz in the file's axes."""
    if file.version == 2:
        xyz = packed.reshape(-1, 3) / 127.5 - 1.0
        squares = np.sum(xyz * xyz, axis=1, keepdims=True)
        squares[squares > MAX_XYZ**2] = np.nan
        w = np.sqrt(np.maximum(0.0, 1.0 - squares))
        return np.concatenate([w, xyz], axis=1).astype(np.float32)
    words = packed.reshape(-1, 4).view("<u4")
    fields = words >> np.array([20, 10, 0], dtype=np.uint32)
    sign = 1.0 - 2.0 * ((fields >> np.uint32(9)) & np.uint32(1))
    three = sign * (fields & np.uint32(511)) / 511.0 * np.sqrt(0.5)
    largest = (words[:, 0] >> np.uint32(30)).astype(np.intp)
    xyzw = rotations_from_three(three, largest)
    return np.roll(xyzw, 1, axis=1)


def _pack(path: Path, splats: SplatBlocks) -> Iterator[bytes]:
    """The file in order, once all blocks have been packed and set aside."""
    file = SpzFile(path, 4, splats.count, splats.sh_degree, FRACTIONAL_BITS, 0)
    widths = [width for width in file.widths() if width * splats.count]
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
        yield spz_start(
            count=splats.count,
            degree=splats.sh_degree,
            fractional_bits=bits,
            packed=[stream.tell() for stream in streams],
        )
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
