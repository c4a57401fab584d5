"""Pictures of personal video without a codec, and what is known of its lens."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.personal_video import CALIBRATION_FLOATS, RAW_ALIGNMENT
from devices.hololens.wire.taking import Take, WireError

Floats = NDArray[np.float32]


def raw_stride(width_px: int) -> int:
    """Return the bytes of a row of a raw picture."""
    return -(-width_px // RAW_ALIGNMENT) * RAW_ALIGNMENT


def encode_raw(nv12: NDArray[np.uint8]) -> bytes:
    """Return the bytes of a raw picture.

    Args:
        nv12: (H·3/2, W): rows of Y, then rows of U and V in turn.
    """
    rows, width = nv12.shape
    padded = np.zeros((rows, raw_stride(width)), np.uint8)
    padded[:, :width] = nv12
    return padded.tobytes()


def read_raw(data: bytes, width_px: int, *, height_px: int) -> NDArray[np.uint8]:
    """Return (H·3/2, W) of a raw picture's bytes.

    Raises:
        WireError: there are fewer or more bytes than its size asks for, or the size is odd.
    """
    stride = raw_stride(width_px)
    wanted = stride * height_px * 3 // 2
    if len(data) != wanted or width_px % 2 or height_px % 2 or not wanted:
        raise WireError(
            f"raw picture of {width_px}×{height_px} px: {len(data)} bytes, wanted {wanted}"
        )
    return np.frombuffer(data, np.uint8).reshape(height_px * 3 // 2, stride)[:, :width_px]


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Lens of the headset's camera at a size, all float32, its own axes.

    Attributes:
        focal: (2,) pixels.
        principal: (2,) pixels.
        radial: (3,) distortion.
        tangential: (2,) distortion.
        projection: (4, 4) without distortion, for row vectors.
        extrinsics: (4, 4) for row vectors.
        frame_intrinsics: (4,) of the media frame.
        frame_extrinsics: (7,) of the media frame.
    """

    focal: Floats
    principal: Floats
    radial: Floats
    tangential: Floats
    projection: Floats
    extrinsics: Floats
    frame_intrinsics: Floats
    frame_extrinsics: Floats


SPLITS = (2, 4, 7, 9, 25, 41, 45)
"""Places in the 52 numbers at which each part of a calibration ends but the last."""


def encode_calibration(calibration: Calibration) -> bytes:
    """Return the 208 bytes of a calibration."""
    parts = (
        calibration.focal,
        calibration.principal,
        calibration.radial,
        calibration.tangential,
        calibration.projection,
        calibration.extrinsics,
        calibration.frame_intrinsics,
        calibration.frame_extrinsics,
    )
    return np.concatenate([np.asarray(part, "<f4").ravel() for part in parts]).tobytes()


def read_calibration(take: Take) -> Calibration:
    """Read a calibration."""
    numbers = np.frombuffer(take(4 * CALIBRATION_FLOATS), "<f4")
    parts = np.split(numbers, SPLITS)
    parts[4], parts[5] = parts[4].reshape(4, 4), parts[5].reshape(4, 4)
    return Calibration(*parts)
