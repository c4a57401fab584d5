"""The `.splat` format of antimatter15's viewer, in and out: 32 bytes a splat and no header.

Position and linear scale as 3 float32 each, RGB and opacity as bytes, quaternion (w, x, y, z) as
bytes `128 + 128·q`. View-dependent colour does not fit. The file's axes are kept: x right, y down,
z forward as in the PLY files it is made from.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scenes.formats.activation import (
    cloud_from_file,
    damaged_values_are_quiet,
)
from scenes.formats.atomic import write_file
from scenes.formats.error import refusal
from scenes.splats import SH_C0, SplatCloud

ROWS_PER_BLOCK = 65_536
ROW = np.dtype(
    [("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quaternion", "u1", 4)]
)


@damaged_values_are_quiet
def read_splat(path: Path) -> SplatCloud:
    """Read a `.splat` file in its own frame and unit; colour has degree 0.

    The format has neither header nor length: a file cut at a multiple of 32 bytes looks whole.

    Raises:
        FormatError: the size is no multiple of 32 bytes, or a value is not finite, a scale not
            positive or a quaternion zero.
        OSError: the file cannot be read.
    """
    size = path.stat().st_size
    if size == 0 or size % ROW.itemsize:
        raise refusal(
            path,
            f"byte {size - size % ROW.itemsize} (splat {size // ROW.itemsize})",
            f"{size} bytes, wanted a multiple of {ROW.itemsize} above 0",
            "it is truncated or no .splat file, copy or export it again",
        )
    rows = np.fromfile(path, dtype=ROW)
    rgba = rows["rgba"].astype(np.float32) / np.float32(255.0)
    return cloud_from_file(
        path,
        means=rows["mean"],
        scales=rows["scale"],
        quaternions=(rows["quaternion"].astype(np.float32) - 128.0) / np.float32(128.0),
        opacities=rgba[:, 3],
        sh=((rgba[:, None, :3] - np.float32(0.5)) / np.float32(SH_C0)).astype(np.float32),
    )


def write_splat(path: Path, cloud: SplatCloud) -> int:
    """Write a `.splat` file, atomic. View-dependent colour is left out, colour is clipped to 0..1.

    Returns:
        The size of the file in bytes.

    Raises:
        FormatError: the cloud is empty, which this format cannot say.
        WriteError: the disk is full or the folder is not writable; nothing is left behind.
    """
    if not len(cloud):
        raise refusal(path, "", "no splats to write, .splat cannot be empty", "write a PLY instead")
    return write_file(path, _blocks(cloud))


def _blocks(cloud: SplatCloud) -> Iterator[bytes]:
    for start in range(0, len(cloud), ROWS_PER_BLOCK):
        part = slice(start, start + ROWS_PER_BLOCK)
        rgb = 0.5 + SH_C0 * cloud.sh[part, 0].astype(np.float64)
        rgba = np.concatenate([rgb, cloud.opacities[part, None]], axis=1)
        rows = np.empty(len(rgba), dtype=ROW)
        rows["mean"] = cloud.means[part]
        rows["scale"] = cloud.scales[part]
        rows["rgba"] = np.clip(np.rint(255.0 * rgba), 0, 255)
        rows["quaternion"] = np.clip(np.rint(128.0 + 128.0 * cloud.rotations[part]), 0, 255)
        yield rows.tobytes()
