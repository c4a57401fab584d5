"""PlayCanvas compressed PLY: chunks of 256 splats with bounds and 16 bytes a splat. Read only.

Layout from the public splat-transform sources: element `chunk` holds the bounds of position, log
scale and (optionally) colour; element `vertex` packs position and scale as 11-10-11 bits, rotation
as 2 + 3·10 bits (index of the largest of w, x, y, z, then the others / √2), colour and opacity as 8
bits each; an optional element `sh` holds one byte a coefficient, channel-major. The file's axes are
kept, as with plain splat PLY.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.formats.containers.ply_header import PlyElement, PlyHeader, read_rows, require_rows
from scenes.formats.storage.activation import (
    cloud_from_file,
    damaged_values_are_quiet,
    exponential,
    rotations_from_three,
)
from scenes.formats.storage.bad_rows import without_bad_rows
from scenes.formats.storage.blocks import SplatBlocks, extents
from scenes.formats.storage.error import refusal
from scenes.splats import SH_C0, SH_COUNTS, SplatCloud

CHUNK_SPLATS = 256
SH_RANGE = 8.0
"""Coefficients are stored over -4..4."""

_PACKED = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
_POSITION = ("min_x", "min_y", "min_z", "max_x", "max_y", "max_z")
_SCALE = tuple(name.replace("_", "_scale_") for name in _POSITION)
_COLOUR = ("min_r", "min_g", "min_b", "max_r", "max_g", "max_b")


def is_compressed(header: PlyHeader) -> bool:
    """Whether the vertices of this PLY file are packed words."""
    vertex = header.elements.get("vertex")
    return (
        vertex is not None and vertex.dtype is not None and _PACKED[0] in (vertex.dtype.names or ())
    )


def read_compressed_ply_blocks(path: Path, header: PlyHeader, rows: int) -> SplatBlocks:
    """Read a compressed PLY whose header has been parsed, in the file's own frame and unit.

    Raises:
        FormatError: the file is truncated, damaged or of another layout; bad values are found when
            their block is read.
        OSError: the file cannot be read.
    """
    words = _table(path, header, "vertex", _PACKED, "u4")
    chunk = header.elements["chunk"].dtype if "chunk" in header.elements else None
    coloured = chunk is not None and "min_r" in (chunk.names or ())
    bounds = _table(path, header, "chunk", (*_POSITION, *_SCALE, *_COLOUR * coloured), "f4")
    if bounds.count * CHUNK_SPLATS < words.count:
        raise refusal(
            path,
            "element 'chunk'",
            f"{bounds.count} chunks for {words.count} splats, "
            f"wanted {-(-words.count // CHUNK_SPLATS)}",
            "the file is damaged, export it again",
        )
    higher = _higher(path, header, words.count)
    blocks = (_decode(words, bounds, higher, extent) for extent in extents(words.count, rows))
    degree = SH_COUNTS.index(1 + (len(higher.columns) // 3 if higher else 0))
    return without_bad_rows(path, SplatBlocks(words.count, degree, blocks))


@dataclass(frozen=True, slots=True)
class _Table:
    """The columns of one type of an element all of whose rows are in the file."""

    path: Path
    element: PlyElement
    columns: tuple[str, ...]
    kind: str

    @property
    def count(self) -> int:
        return self.element.count

    def rows(self, start: int, stop: int) -> NDArray[np.number]:
        """(stop - start, columns)."""
        rows = read_rows(self.path, self.element, start, stop)
        return np.stack([rows[c] for c in self.columns], axis=1).astype(f"={self.kind}")


def _table(path: Path, header: PlyHeader, name: str, columns: tuple[str, ...], kind: str) -> _Table:
    """Named columns of an element, which must all be of one type."""
    element = require_rows(path, header, name)
    assert element.dtype is not None
    kinds = {c: element.dtype[i].str[1:] for i, c in enumerate(element.dtype.names or ())}
    wrong = [c for c in columns if kinds.get(c) != kind]
    if wrong:
        raise refusal(
            path,
            f"element {name!r}",
            f"property {', '.join(wrong)} is missing or not of type {kind}",
            "the file is damaged or of another layout, export it again",
        )
    return _Table(path, element, columns, kind)


def _higher(path: Path, header: PlyHeader, n: int) -> _Table | None:
    """The coefficients above degree 0, one byte each, channel-major."""
    if "sh" not in header.elements:
        return None
    dtype = header.elements["sh"].dtype
    count = len(dtype.names or ()) if dtype is not None else 0
    rows = header.elements["sh"].count
    if count % 3 or count // 3 + 1 not in SH_COUNTS[1:] or rows != n:
        raise refusal(
            path,
            "element 'sh'",
            f"{rows} rows of {count} coefficients for {n} splats",
            "the file is damaged or of another layout, export it again",
        )
    return _table(path, header, "sh", tuple(f"f_rest_{i}" for i in range(count)), "u1")


@damaged_values_are_quiet
def _decode(
    words: _Table, bounds: _Table, higher: _Table | None, extent: tuple[int, int]
) -> SplatCloud:
    start, stop = extent
    packed = words.rows(start, stop).astype(np.uint32)
    first_chunk = start // CHUNK_SPLATS
    of_chunk = bounds.rows(first_chunk, -(-stop // CHUNK_SPLATS)).astype(np.float64)
    of_splat = of_chunk[np.arange(start, stop) // CHUNK_SPLATS - first_chunk]
    position = _between(of_splat[:, 0:3], of_splat[:, 3:6], _unpack_11_10_11(packed[:, 0]))
    log_scale = _between(of_splat[:, 6:9], of_splat[:, 9:12], _unpack_11_10_11(packed[:, 2]))
    rgba = _bits(packed[:, 3], (24, 16, 8, 0), 8)
    colour = rgba[:, :3]
    if of_splat.shape[1] > 12:
        colour = _between(of_splat[:, 12:15], of_splat[:, 15:18], colour)
    sh = ((colour - 0.5) / SH_C0)[:, None, :]
    if higher is not None:
        sh = np.concatenate([sh, _unpack_harmonics(higher.rows(start, stop))], axis=1)
    three = (_bits(packed[:, 1], (20, 10, 0), 10) - 0.5) * np.sqrt(2.0)
    largest = (packed[:, 1] >> np.uint32(30)).astype(np.intp)
    return cloud_from_file(
        means=position.astype(np.float32),
        scales=exponential(log_scale.astype(np.float32)),
        quaternions=rotations_from_three(three, largest),
        opacities=rgba[:, 3].astype(np.float32),
        sh=sh.astype(np.float32),
    )


def _unpack_harmonics(stored: NDArray[np.number]) -> NDArray[np.float64]:
    """(N, K - 1, 3) coefficients of (N, 3 (K - 1)) bytes."""
    wide = stored.astype(np.float64)
    share = np.select([wide == 0, wide == 255], [0.0, 1.0], (wide + 0.5) / 256.0)
    return (SH_RANGE * (share - 0.5)).reshape(len(wide), 3, wide.shape[1] // 3).swapaxes(1, 2)


def _bits(words: NDArray[np.uint32], shifts: tuple[int, ...], width: int) -> NDArray[np.float64]:
    """(N, len(shifts)) fields of `width` bits as 0..1."""
    mask = (1 << width) - 1
    shifted = words[:, None] >> np.array(shifts, dtype=np.uint32)
    return (shifted & np.uint32(mask)).astype(np.float64) / mask


def _unpack_11_10_11(words: NDArray[np.uint32]) -> NDArray[np.float64]:
    outer, inner = _bits(words, (21, 0), 11), _bits(words, (11,), 10)
    return np.stack([outer[:, 0], inner[:, 0], outer[:, 1]], axis=1)


def _between(
    low: NDArray[np.float64], high: NDArray[np.float64], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    return low * (1.0 - share) + high * share
