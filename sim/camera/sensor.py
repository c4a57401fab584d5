"""Model of lens and sensor: vignetting, exposure and colour drift, noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Rig
from sim.camera.lens_picture import lens_circle

NOISE_MARGIN_PX = 97
NOISE_SCALE = 32.0
BAND_PX = 96
"""Rows that are worked on at a time, pixels: what lies between two steps stays in the cache."""
LEVELS = np.arange(256, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class SensorOptions:
    """How good the camera is.

    Attributes:
        vignetting: light lost at the rim of the lens circle, 0..1.
        exposure_drift: standard deviation of the slow change of exposure (share).
        colour_drift: the same for red and blue against green.
        drift_time_s: how long a drift lasts.
        read_noise: standard deviation in the dark, levels of 255.
        shot_noise: added standard deviation at full white, levels of 255.
    """

    vignetting: float = 0.22
    exposure_drift: float = 0.025
    colour_drift: float = 0.008
    drift_time_s: float = 4.0
    read_noise: float = 0.9
    shot_noise: float = 1.7


class Sensor:
    """Turns clean pictures into what the camera delivers; keeps the drift from frame to frame.

    Args:
        rig: the lenses.
        rng: decides drift and noise.
        options: see `SensorOptions`.
    """

    def __init__(
        self,
        rig: Rig,
        rng: np.random.Generator,
        *,
        options: SensorOptions = SensorOptions(),
    ) -> None:
        self._options = options
        self._rng = rng
        self._drift = rng.standard_normal(3)
        self._falloff = [_falloff(lens, options.vignetting) for lens in rig.lenses]
        self._lit = [_lit_bands(falloff) for falloff in self._falloff]
        tallest = max(lens.height_px for lens in rig.lenses) + NOISE_MARGIN_PX
        widest = max(lens.width_px for lens in rig.lenses) + NOISE_MARGIN_PX
        noise = rng.standard_normal((tallest, widest, 3), dtype=np.float32)
        self._noise = np.clip(np.round(noise * NOISE_SCALE), -127, 127).astype(np.int16)
        read, shot = options.read_noise, options.shot_noise
        sigma = np.sqrt(read**2 + shot**2 * LEVELS / 255.0)
        # Signed words like the noise: OpenCV multiplies what is of one type ten times as fast.
        self._sigma = np.round(sigma * NOISE_SCALE).astype(np.uint8).astype(np.int16)
        # Cameras paint the corners outside the lens circle black; noise there would only cost bits.
        self._sigma[0] = 0

    def expose(
        self, pictures: Sequence[NDArray[np.uint8]], dt_s: float
    ) -> tuple[NDArray[np.uint8], ...]:
        """The pictures as delivered.

        Args:
            pictures: (H, W, 3) uint8, one per lens.
            dt_s: time since the frame before.
        """
        keep = math.exp(-dt_s / self._options.drift_time_s)
        step = math.sqrt(1.0 - keep * keep)
        self._drift = keep * self._drift + step * self._rng.standard_normal(3)
        exposure, red, blue = self._drift
        gain = 1.0 + self._options.exposure_drift * exposure
        colour = 1.0 + self._options.colour_drift * np.array([red, 0.0, blue])
        wanted: NDArray[np.float64] = np.round(LEVELS[:, None] * float(gain) * colour)
        curve = wanted.clip(0, 255).astype(np.uint8)
        return tuple(
            self._deliver(picture, lens_index, curve.reshape(256, 1, 3))
            for lens_index, picture in enumerate(pictures)
        )

    def _deliver(
        self, picture: NDArray[np.uint8], lens_index: int, curve: NDArray[np.uint8]
    ) -> NDArray[np.uint8]:
        falloff = self._falloff[lens_index]
        height, width = picture.shape[:2]
        row, column = self._rng.integers(0, NOISE_MARGIN_PX, size=2)
        noise = self._noise[row : row + height, column : column + width]
        delivered = np.zeros_like(picture)
        for band in self._lit[lens_index]:
            lit = cv2.multiply(cv2.LUT(picture[band], curve), falloff[band], scale=1.0 / 255.0)
            sigma = cv2.LUT(lit, self._sigma)
            scaled = cv2.multiply(noise[band], sigma, scale=1.0 / NOISE_SCALE**2)
            cv2.add(lit, scaled, delivered[band], dtype=cv2.CV_8U)
        return delivered


def _falloff(lens: Fisheye, strength: float) -> NDArray[np.uint8]:
    """(H, W, 3) uint8: share of light that arrives, 255 for all; black outside the lens circle."""
    y, x = np.mgrid[0 : lens.height_px, 0 : lens.width_px] + 0.5
    radius = np.hypot(x - lens.cx, y - lens.cy) / lens.circle_px
    share = 1.0 - strength * np.clip(radius, 0.0, 1.0) ** 2.5
    edge = np.clip((1.0 - radius) * 220.0, 0.0, 1.0)
    light = np.where(lens_circle(lens), share * edge, 0.0)
    grey = np.round(255.0 * light).astype(np.uint8)
    return np.ascontiguousarray(np.repeat(grey[:, :, None], 3, axis=2))


def _lit_bands(falloff: NDArray[np.uint8]) -> tuple[tuple[slice, slice], ...]:
    """Rows and columns that hold all pixels that light reaches, `BAND_PX` rows at a time."""
    bands: list[tuple[slice, slice]] = []
    for top in range(0, len(falloff), BAND_PX):
        rows = slice(top, top + BAND_PX)
        columns = np.flatnonzero(falloff[rows, :, 0].any(axis=0))
        if len(columns):
            bands.append((rows, slice(int(columns[0]), int(columns[-1]) + 1)))
    return tuple(bands)
