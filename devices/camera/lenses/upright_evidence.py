"""Up direction of lens pictures of a room, in nats: light, texture, lamps above and below.

Rooms are lit from above and furnished below: ceilings are brighter and plainer than floors, and
lamps hang high. Two lenses share what is between them: the rims of their pictures must agree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, pixel_centres

Luma = NDArray[np.float32]

SIZE_PX = 192
"""Side at which a lens picture is looked at, pixels."""

FOV_DEG = 200.0
"""Field of view that is assumed, degrees: that of the X3's and X4's lenses."""

SEEN_SHARE = 0.93
"""Share of the lens circle that is looked at: the rim is vignetted, and cropped by real cameras."""

BAND_DEG = 20.0
"""Elevation, degrees, beyond which a direction counts as above or below."""

LAMP_ELEVATION_DEG = 5.0
"""Elevation, degrees, beyond which a lamp counts as above or below; lamps may be far away."""

LAMP_PX = 19
"""Size of the largest lamp, pixels of the small picture: 20°, a ceiling lamp 3 m away."""

WEIGHTS = (1.75, 2.08, 1.20, 0.71, 0.82)
"""Nats per unit of light, texture, vertical edges, bright share and lamps.

Maximum likelihood on random rooms 5000 to 5039 under two random lights each, of six ways to turn
two lenses; a normal prior of variance 2.
"""

RIM_WEIGHT = 0.74
"""Nats per unit of the rims' correlation, fitted with `WEIGHTS`."""

RIM_RADII = (0.84, 0.88, 0.90, 0.92, 0.95)
"""Shares of the lens circle at which lenses of 190° to 214° see what is 90° off axis."""


@dataclass(frozen=True, slots=True, eq=False)
class _Directions:
    inside: NDArray[np.bool_]
    above: NDArray[np.bool_]
    below: NDArray[np.bool_]
    elevation_deg: NDArray[np.float64]
    rays: NDArray[np.float64]
    rays_by_x: NDArray[np.float64]
    rays_by_y: NDArray[np.float64]


@lru_cache(maxsize=1)
def _directions() -> _Directions:
    """Directions of the pixels of a small lens picture; y is down."""
    lens = Fisheye.from_fov(SIZE_PX, math.radians(FOV_DEG))
    rays = lens.unproject(pixel_centres(lens)).reshape(SIZE_PX, SIZE_PX, 3)
    angles = np.arccos(np.clip(rays[..., 2], -1.0, 1.0))
    inside = angles < SEEN_SHARE * lens.max_angle
    elevation = np.degrees(np.arcsin(np.clip(-rays[..., 1], -1.0, 1.0)))
    return _Directions(
        inside,
        inside & (elevation > BAND_DEG),
        inside & (elevation < -BAND_DEG),
        elevation,
        rays,
        np.asarray(np.gradient(rays, axis=1), np.float64),
        np.asarray(np.gradient(rays, axis=0), np.float64),
    )


def small_lens_picture(luma: NDArray[np.uint8]) -> Luma:
    """A square lens picture's Y plane at the size at which it is looked at."""
    shrunk = cv2.resize(luma, (SIZE_PX, SIZE_PX), interpolation=cv2.INTER_AREA)
    return np.asarray(shrunk, np.float32)


def turned_back(picture: Luma, turn: int) -> Luma:
    """A picture without the quarter turns clockwise that it has."""
    return np.ascontiguousarray(np.rot90(picture, turn))


def upright_nats(picture: Luma) -> float:
    """How much a small lens picture speaks for being upright, nats, from any origin.

    Only differences between the turns of one picture mean anything.
    """
    return float(upright_features(picture) @ np.array(WEIGHTS))


def upright_features(picture: Luma) -> NDArray[np.float64]:
    """(5,) what `WEIGHTS` weighs; all change sign when the picture is turned by half."""
    at = _directions()
    blurred, gradient_x, gradient_y = _gradients(picture)
    relative = np.hypot(gradient_x, gradient_y) / (cv2.GaussianBlur(picture, (0, 0), 4.0) + 8.0)
    level = float(picture[at.inside].mean()) + 4.0
    light = float(picture[at.above].mean() - picture[at.below].mean()) / level
    above, below = float(relative[at.above].mean()), float(relative[at.below].mean())
    texture = math.log((below + 1e-3) / (above + 1e-3))
    bright = picture >= np.percentile(picture[at.inside], 97)
    bright_share = float(bright[at.above].mean() - bright[at.below].mean())
    return np.array(
        [
            math.tanh(light),
            math.tanh(texture),
            _vertical_edges(np.asarray(relative, np.float64), gradient_x, gradient_y),
            bright_share,
            _lamps(picture, blurred),
        ]
    )


def _gradients(picture: Luma) -> tuple[Luma, Luma, Luma]:
    blurred = cv2.GaussianBlur(picture, (0, 0), 0.8)
    x = cv2.Sobel(blurred, cv2.CV_32F, 1, 0, ksize=3, scale=0.125)
    y = cv2.Sobel(blurred, cv2.CV_32F, 0, 1, ksize=3, scale=0.125)
    return np.asarray(blurred, np.float32), np.asarray(x, np.float32), np.asarray(y, np.float32)


def _lamps(picture: Luma, blurred: Luma) -> float:
    """Small, very bright spots above, less those below; -1 to 1."""
    at = _directions()
    shape = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (LAMP_PX, LAMP_PX))
    spots = np.maximum(blurred - cv2.morphologyEx(blurred, cv2.MORPH_OPEN, shape), 0.0)
    brightest = np.percentile(picture[at.inside], 99.9)
    energy = np.where(at.inside & (blurred > 0.85 * brightest), spots, 0.0) ** 2
    above = float(energy[at.elevation_deg > LAMP_ELEVATION_DEG].sum())
    below = float(energy[at.elevation_deg < -LAMP_ELEVATION_DEG].sum())
    # Without lamps the sum is small against that of 2 % of the picture at 14 levels.
    return (above - below) / (float(energy.sum()) + 4.0 * float(at.inside.sum()))


def _vertical_edges(relative: NDArray[np.float64], gradient_x: Luma, gradient_y: Luma) -> float:
    """Edges along vertical lines of the room against edges along the picture's x axis, log ratio.

    A straight line of the room lies in a plane through the lens. All planes of vertical lines hold
    the direction up; long edges make peaks among those planes.
    """
    at = _directions()
    tangents = -gradient_y[..., None] * at.rays_by_x + gradient_x[..., None] * at.rays_by_y
    normals = np.cross(at.rays, tangents)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True) + 1e-9
    strength = np.where(at.inside & (relative > 0.03), np.minimum(relative, 0.1), 0.0)
    peaks = [_peaks(normals, strength, axis) for axis in (1, 0)]
    return math.log((peaks[0] + 1.0) / (peaks[1] + 1.0))


def _peaks(normals: NDArray[np.float64], strength: NDArray[np.float64], axis: int) -> float:
    """How strong and how peaked the edges are whose planes hold an axis."""
    chosen = (np.abs(normals[..., axis]) < math.sin(math.radians(3.0))) & (strength > 0)
    first, second = (k for k in range(3) if k != axis)
    around = np.arctan2(normals[chosen][:, first], normals[chosen][:, second]) % math.pi
    counts, _ = np.histogram(around, bins=60, range=(0.0, math.pi), weights=strength[chosen])
    return float(np.sqrt(np.sum(counts**2)))


def rim_agreement(front: Luma, back: Luma) -> float:
    """Correlation of what two upright lenses, back to back, see 90° off their axes; -1 to 1."""
    return max(_rim_correlation(front, back, radius) for radius in RIM_RADII)


def _rim_correlation(front: Luma, back: Luma, radius: float) -> float:
    around = np.radians(np.arange(0.0, 360.0, 1.5))
    middle, reach = 0.5 * SIZE_PX - 0.5, 0.5 * SIZE_PX * radius
    x = np.asarray(reach * np.cos(around), np.float32)[None]
    y = np.asarray(middle + reach * np.sin(around), np.float32)[None]
    # What is at the right of one lens is at the left of the other.
    rims = [
        cv2.remap(cv2.GaussianBlur(lens, (0, 0), 1.5), middle + side * x, y, cv2.INTER_LINEAR)[0]
        for lens, side in ((front, 1), (back, -1))
    ]
    first, second = (rim - rim.mean() for rim in rims)
    return float(first @ second / (np.linalg.norm(first) * np.linalg.norm(second) + 1e-6))
