"""Gaussian-splat PLY as the 3DGS trainer writes it (Kerbl et al. 2023), in and out.

Stored per splat: position, f_dc_0..2, f_rest_* (channel-major: all red, then green, then blue),
opacity as a logit, scale_0..2 as natural logarithms, rot_0..3 as a free quaternion (w, x, y, z).
The file's axes are kept: trainers write the frame of the reconstruction (x right, y down, z
forward).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.formats.compressed_ply import is_compressed, read_compressed_ply_blocks
from scenes.formats.containers.ply_header import PlyElement, read_header, read_rows, require_rows
from scenes.formats.storage.activation import (
    cloud_from_file,
    damaged_values_are_quiet,
    exponential,
    logarithm,
    logit,
    sigmoid,
)
from scenes.formats.storage.atomic import write_file
from scenes.formats.storage.bad_rows import intact, without_bad_rows
from scenes.formats.storage.blocks import ROWS_PER_BLOCK, SplatBlocks, extents, in_blocks
from scenes.formats.storage.error import refusal
from scenes.splats import SH_C0, SH_COUNTS, SplatCloud

FLAT_SCALE = 1e-3
"""Thickness of a 2D splat (no scale_2) as a share of its smaller width."""

WORLD_COMMENT = "frame: world, right-handed, Z up, metres"
"""Header line of PLY files that are in the world frame and not in a reconstruction's."""

_MEANS = ("x", "y", "z")
_COLOURS = ("f_dc_0", "f_dc_1", "f_dc_2")
_PLAIN_COLOURS = (("red", "green", "blue"), ("r", "g", "b"))
"""Colours as they are, which some exporters write instead of f_dc_*: bytes, or 0..1."""
_SCALES = ("scale_0", "scale_1", "scale_2")
_ROTATIONS = ("rot_0", "rot_1", "rot_2", "rot_3")


def read_ply(path: Path) -> SplatCloud:
    """Read a Gaussian-splat PLY, plain or compressed, in the file's own frame and unit.

    Properties may come in any order and of any scalar type; normals, f_rest and scale_2 may be
    missing; other properties, elements and comments are ignored. Quaternions are normalised.

    Raises:
        FormatError: the file is truncated, foreign, or holds values that no scan can have.
        OSError: the file cannot be read.
    """
    return intact(path, read_ply_blocks(path))


def read_ply_blocks(path: Path, rows: int = ROWS_PER_BLOCK) -> SplatBlocks:
    """As `read_ply`, `rows` splats at a time; bad values are found when their block is read."""
    header = read_header(path)
    if is_compressed(header):
        return read_compressed_ply_blocks(path, header, rows)
    element = require_rows(path, header, "vertex")
    assert element.dtype is not None
    rest = _rest_columns(path, element)
    scales = _scale_columns(element)
    colours = _colour_columns(element)
    wanted = [*_MEANS, *colours, "opacity", *scales, *_ROTATIONS, *rest]
    missing = [name for name in wanted if name not in (element.dtype.names or ())]
    if missing:
        raise refusal(
            path,
            "element 'vertex'",
            f"no property {', '.join(missing)}",
            "a point cloud or mesh has no splats: train some with nexus prepare, or give a "
            "Gaussian-splat PLY",
        )
    blocks = (
        _decode(read_rows(path, element, *extent), colours, scales, rest)
        for extent in extents(element.count, rows)
    )
    degree = SH_COUNTS.index(1 + len(rest) // 3)
    return without_bad_rows(path, SplatBlocks(element.count, degree, blocks))


def write_ply(path: Path, cloud: SplatCloud, *, comments: Sequence[str] = ()) -> int:
    """Write a Gaussian-splat PLY (binary little endian, without normals); atomic.

    Means, rotations and colours come back bit by bit, scales and opacities within 1e-6 relative
    (they are stored as logarithms and logits); what was read once is written and read unchanged.

    Args:
        path: the file to make or replace.
        cloud: the splats, in whatever frame the file shall have.
        comments: header comment lines, ASCII.

    Returns:
        The size of the file in bytes.

    Raises:
        WriteError: the disk is full or the folder is not writable; nothing is left behind.
    """
    return write_ply_blocks(path, in_blocks(cloud), comments=comments)


def write_ply_blocks(path: Path, splats: SplatBlocks, *, comments: Sequence[str] = ()) -> int:
    """As `write_ply`, with one block in memory at a time."""
    return write_file(path, _encode(splats, comments))


def ply_comments(path: Path) -> tuple[str, ...]:
    """The comment lines of a PLY file.

    Raises:
        FormatError: it is not a PLY file.
        OSError: the file cannot be read.
    """
    return read_header(path).comments


@damaged_values_are_quiet
def _decode(
    rows: NDArray[np.void], colours: Sequence[str], scales: Sequence[str], rest: Sequence[str]
) -> SplatCloud:
    widths = exponential(_columns(rows, scales))
    if len(scales) == 2:
        thickness = FLAT_SCALE * widths.min(axis=1, keepdims=True)
        widths = np.concatenate([widths, thickness], axis=1)
    k = 1 + len(rest) // 3
    sh = np.empty((len(rows), k, 3), dtype=np.float32)
    sh[:, 0] = _harmonics(rows, colours)
    for i, name in enumerate(rest):
        channel, above = divmod(i, k - 1)
        sh[:, 1 + above, channel] = rows[name]
    return cloud_from_file(
        means=_columns(rows, _MEANS),
        scales=widths,
        quaternions=_columns(rows, _ROTATIONS),
        opacities=sigmoid(_columns(rows, ("opacity",))[:, 0]),
        sh=sh,
    )


def _colour_columns(element: PlyElement) -> tuple[str, ...]:
    assert element.dtype is not None
    names = element.dtype.names or ()
    if "f_dc_0" not in names:
        for plain in _PLAIN_COLOURS:
            if all(name in names for name in plain):
                return plain
    return _COLOURS


def _harmonics(rows: NDArray[np.void], names: Sequence[str]) -> NDArray[np.float32]:
    """(N, 3) coefficients of degree 0."""
    values = _columns(rows, names)
    if tuple(names) == _COLOURS:
        return values
    kind = rows.dtype[names[0]]
    largest = np.float32(np.iinfo(kind).max) if kind.kind in "iu" else np.float32(1.0)
    return (values / largest - np.float32(0.5)) / np.float32(SH_C0)


def _columns(rows: NDArray[np.void], names: Sequence[str]) -> NDArray[np.float32]:
    """(N, len(names)) float32."""
    values = np.empty((len(rows), len(names)), dtype=np.float32)
    for i, name in enumerate(names):
        values[:, i] = rows[name]
    return values


def _encode(splats: SplatBlocks, comments: Sequence[str]) -> Iterator[bytes]:
    n_rest = 3 * (SH_COUNTS[splats.sh_degree] - 1)
    names = [
        *_MEANS,
        *_COLOURS,
        *(f"f_rest_{i}" for i in range(n_rest)),
        "opacity",
        *_SCALES,
        *_ROTATIONS,
    ]
    lines = ["ply", "format binary_little_endian 1.0", *(f"comment {c}" for c in comments)]
    lines += [f"element vertex {splats.count}", *(f"property float {name}" for name in names)]
    yield ("\n".join([*lines, "end_header"]) + "\n").encode("ascii")
    for cloud in splats.blocks:
        table = np.concatenate(
            [
                cloud.means,
                cloud.sh[:, 0],
                cloud.sh[:, 1:].swapaxes(1, 2).reshape(len(cloud), n_rest),
                logit(cloud.opacities)[:, None],
                logarithm(cloud.scales),
                cloud.rotations,
            ],
            axis=1,
        )
        yield table.astype("<f4").tobytes()


def _scale_columns(element: PlyElement) -> tuple[str, ...]:
    assert element.dtype is not None
    return _SCALES if "scale_2" in (element.dtype.names or ()) else _SCALES[:2]


def _rest_columns(path: Path, element: PlyElement) -> list[str]:
    assert element.dtype is not None
    count = sum(name.startswith("f_rest_") for name in element.dtype.names or ())
    wanted = [3 * (k - 1) for k in SH_COUNTS]
    if count not in wanted:
        raise refusal(
            path,
            "element 'vertex'",
            f"{count} properties f_rest_*, wanted one of {wanted} (degree 0 to 3)",
            "export it with a whole degree of spherical harmonics",
        )
    return [f"f_rest_{i}" for i in range(count)]
