"""Lens of a simulated HoloLens's camera, which breathes with the focus."""

from __future__ import annotations

import math

import numpy as np

from devices.hololens.wire.personal_video import VideoTrailer
from devices.hololens.wire.video_formats import Calibration
from scenes.cameras import Pinhole
from sim.hololens.axes import rows_of
from sim.hololens.world import HEAD_FROM_CAMERA

HALF_FOV_RAD = math.radians(32.35)
"""Half the horizontal field of view: 64.7° as the headset's data sheet has it."""

BREATH, BREATH_S = 0.004, 7.0
"""Share by which the focal length goes up and down with the focus, and the time of that."""

ASIDE = (0.006, -0.004)
"""How far the principal point is from the middle, shares of the width."""

FIRST_PIXEL = 0.5
"""Middle of the first pixel in the studio's counting; on the wire it is 0."""

EXPOSURE_TICKS, ISO, KELVIN = 100_000, 400, 4600
"""Exposure of a lit room: 10 ms, its ISO, and its light."""


def lens_at(t_s: float, width_px: int, *, height_px: int) -> Pinhole:
    """Return the camera as it is at a moment."""
    focal = 0.5 * width_px / math.tan(HALF_FOV_RAD)
    focal *= 1.0 + BREATH * math.sin(2.0 * math.pi * t_s / BREATH_S)
    cx, cy = 0.5 * width_px + ASIDE[0] * width_px, 0.5 * height_px + ASIDE[1] * width_px
    return Pinhole(width_px, height_px, focal, focal, cx, cy)


def trailer_of(lens: Pinhole, t_s: float) -> VideoTrailer:
    """Return what the headset says of a picture."""
    position = 300 + round(40 * math.sin(2.0 * math.pi * t_s / BREATH_S))
    return VideoTrailer(
        focal=(lens.fx, lens.fy),
        principal=(lens.cx - FIRST_PIXEL, lens.cy - FIRST_PIXEL),
        width_px=lens.width_px,
        height_px=lens.height_px,
        exposure_time=EXPOSURE_TICKS,
        lens_position=position,
        focus_state=1,
        iso_speed=ISO,
        white_balance=KELVIN,
        white_balance_gains=(1.9, 1.0, 1.7),
    )


def calibration_of(lens: Pinhole) -> Calibration:
    """Return what the headset knows of the lens; x of its projection counts to the left."""
    cx, cy = lens.cx - FIRST_PIXEL, lens.cy - FIRST_PIXEL
    projection = np.array(
        [[-lens.fx, 0, 0, 0], [0, lens.fy, 0, 0], [cx, cy, 1, 0], [0, 0, 0, 1]], np.float32
    )
    return Calibration(
        np.array([lens.fx, lens.fy], np.float32),
        np.array([cx, cy], np.float32),
        np.zeros(3, np.float32),
        np.zeros(2, np.float32),
        projection,
        rows_of(HEAD_FROM_CAMERA),
        np.array([lens.fx, lens.fy, cx, cy], np.float32),
        np.array([*HEAD_FROM_CAMERA.translation, 0.0, 0.0, 0.0, 1.0], np.float32),
    )
