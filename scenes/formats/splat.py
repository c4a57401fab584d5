"""The `.splat` format of antimatter15's viewer, in and out: 32 bytes a splat and no header.

Position and linear scale as 3 float32 each, RGB and opacity as bytes, quaternion (w, x, y, z) as
bytes `128 + 128·q`. View-dependent colour does not fit. The file's axes are kept: x right, y down,
z forward as in the PLY files it is made from.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.formats.storage.activation import cloud_from_file, damaged_values_are_quiet
from scenes.formats.storage.atomic import write_file
from scenes.formats.storage.bad_rows import intact, without_bad_rows
from scenes.formats.storage.blocks import ROWS_PER_BLOCK, SplatBlocks, extents, in_blocks
from scenes.formats.storage.error import refusal
from scenes.splats import SH_C0, SplatCloud

ROW = np.dtype(
    [("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quaternion", "u1", 4)]
)


def read_splat(path: Path) -> SplatCloud:
    """Read a `.splat` file in its own frame and unit; colour has degree 0.

    The format has neither header nor length: a file cut at a multiple of 32 bytes looks whole.

    Raises:
        FormatError: the size is no multiple of 32 bytes, or a value is not finite, a scale not
            positive or a quaternion zero.
        OSError: the file cannot be read.
    """
    return intact(path, read_splat_blocks(path))


def read_splat_blocks(path: Path, rows: int = ROWS_PER_BLOCK) -> SplatBlocks:
    """As `read_splat`, `rows` splats at a time; bad values are found when their block is read."""
    size = path.stat().st_size
    if size == 0 or size % ROW.itemsize:
        raise refusal(
            path,
            f"byte {size - size % ROW.itemsize} (splat {size // ROW.itemsize})",
            f"{size} bytes, wanted a multiple of {ROW.itemsize} above 0",
            "it is truncated or no .splat file, copy or export it again",
        )
    count = size // ROW.itemsize
    return without_bad_rows(path, SplatBlocks(count, 0, _read(path, count, rows)))


def write_splat(path: Path, cloud: SplatCloud) -> int:
    """Write a `.splat` file, atomic. View-dependent colour is left out, colour is clipped to 0..1.

    Returns:
        The size of the file in bytes.

    Raises:
        FormatError: the cloud is empty, which this format cannot say.
        WriteError: the disk is full or the folder is not writable; nothing is left behind.
    """
    return write_splat_blocks(path, in_blocks(cloud))


def write_splat_blocks(path: Path, splats: SplatBlocks) -> int:
    """As `write_splat`, with one block in memory at a time."""
    if not splats.count:
        raise refusal(path, "", "no splats to write, .splat cannot be empty", "write a PLY instead")
    return write_file(path, map(_encode, splats.blocks))


def _read(path: Path, count: int, rows: int) -> Iterator[SplatCloud]:
    with path.open("rb") as file:
        for start, stop in extents(count, rows):
            yield _decode(np.fromfile(file, dtype=ROW, count=stop - start))


@damaged_values_are_quiet
def _decode(rows: NDArray[np.void]) -> SplatCloud:
    rgba = rows["rgba"].astype(np.float32) / np.float32(255.0)
    return cloud_from_file(
        means=rows["mean"],
        scales=rows["scale"],
        quaternions=(rows["quaternion"].astype(np.float32) - 128.0) / np.float32(128.0),
        opacities=rgba[:, 3],
        sh=((rgba[:, None, :3] - np.float32(0.5)) / np.float32(SH_C0)).astype(np.float32),
    )


def _encode(cloud: SplatCloud) -> bytes:
    rgb = 0.5 + SH_C0 * cloud.sh[:, 0].astype(np.float64)
    rgba = np.concatenate([rgb, cloud.opacities[:, None]], axis=1)
    rows = np.empty(len(cloud), dtype=ROW)
    rows["mean"] = cloud.means
    rows["scale"] = cloud.scales
    rows["rgba"] = np.clip(np.rint(255.0 * rgba), 0, 255)
    rows["quaternion"] = np.clip(np.rint(128.0 + 128.0 * cloud.rotations), 0, 255)
    return rows.tobytes()
