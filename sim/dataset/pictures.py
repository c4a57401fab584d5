"""Pictures on disk: 8-bit colour, labels, and 16-bit lengths; a failed write is an OSError."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

PictureFormat = Literal["png", "jpg"]

JPEG_QUALITY = 95
"""Of 0..100: far above what the camera's own codec has left."""

PNG_LEVEL = 3
"""Of 0..9: a third of the time of the default for 3 % more bytes."""

DEEPEST = 65_535
"""Largest value of a 16-bit picture."""


def write_rgb(path: Path, rgb: NDArray[np.uint8]) -> None:
    """(H, W, 3) sRGB; the path's ending decides the format."""
    _write(path, np.ascontiguousarray(rgb[..., ::-1]))


def write_labels(path: Path, labels: NDArray[np.uint8]) -> None:
    """(H, W) 8-bit PNG."""
    _write(path, labels)


def write_lengths(path: Path, lengths_m: NDArray[np.float32], unit_m: float) -> None:
    """(H, W) 16-bit PNG in steps of `unit_m`; 0 where nothing is or it is too far to be written."""
    steps = np.rint(np.where(np.isfinite(lengths_m), lengths_m, 0.0) / unit_m)
    _write(path, np.where(steps <= DEEPEST, steps, 0.0).astype(np.uint16))


def read_picture(path: Path) -> NDArray[np.generic]:
    """A picture as it was written, colour as RGB.

    Raises:
        ValueError: it is missing or cannot be decoded.
    """
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if picture is None:
        raise ValueError(f"{path}: no picture there that can be decoded; write the data set again")
    return np.asarray(picture[..., ::-1] if picture.ndim == 3 else picture)


def _write(path: Path, picture: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    options = (
        [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY]
        if path.suffix == ".jpg"
        else [cv2.IMWRITE_PNG_COMPRESSION, PNG_LEVEL]
    )
    done, data = cv2.imencode(path.suffix, picture, options)
    if not done:
        raise OSError(errno.EIO, "the picture could not be encoded", str(path))
    # OpenCV's own writer says nothing about a full disk.
    path.write_bytes(data.tobytes())
