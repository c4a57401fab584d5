"""Plates that learn: where the live picture agrees with the scan, it is better than the scan.

A scan is blurred, speckled and lit as on the day it was made. Pixels that show the room beyond
doubt (outside every known object, and with no coherent difference over their surroundings) are
taken over into the plate at the plate's exposure. People and unknown things differ coherently and
are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from tracking.background import Exposure, Plates, plate_noise
from tracking.pictures import box_blurred, resized
from tracking.window import Layer

FloatArray = NDArray[np.float32]

COHERENT_SIDE = 1 / 110
"""Side of the surroundings that are averaged, as a share of the lens picture's."""

COHERENT_LEVEL = 0.07
"""A mean difference above this, of a 0..1 channel, is a thing and not the scan's roughness."""

CAUTIOUS_LEVEL = 0.03
"""The same while things may be anywhere: a pale mug before a pale wall differs by little more."""

RELIT_RATIO = (0.35, 1.9)
RELIT_HUE = 0.022
"""Brightness ratios, and the left-over difference of colour, of a place that is only relit."""

KEEP_AWAY_SIDE = 1 / 360
"""Distance kept from known objects, as a share of the lens picture's side."""

SHRINK = 4
"""What is coherent is told in a picture this much smaller."""

BLEND = 0.25
"""Share of the live picture in a pixel that was learned before."""

BANDS = 24
"""A lens is learned in so many bands, one at a time."""

MARGIN_SIDE = 1 / 90
"""Rows beside a band that are looked at with it, as a share of the lens picture's side."""

ROUGH_SIDE = 1 / 24
"""Surroundings over which the roughness of pixels not yet learned is estimated."""


@dataclass(frozen=True, slots=True)
class Band:
    """Whole rows of one lens's picture.

    Attributes:
        lens: index of the lens.
        top: first row.
        bottom: row after the last.
    """

    lens: int
    top: int
    bottom: int


def whole_lens(index: int, height_px: int) -> Band:
    """All rows of a lens."""
    return Band(index, 0, height_px)


def band_of(turn: int, heights_px: Sequence[int]) -> Band:
    """The band whose turn it is: every lens from top to bottom, one lens after the other."""
    lens, part = divmod(turn % (BANDS * len(heights_px)), BANDS)
    height = heights_px[lens]
    return Band(lens, height * part // BANDS, height * (part + 1) // BANDS)


def learn(
    plates: Plates,
    frame: Frame,
    exposures: Sequence[Exposure],
    taken: Sequence[Layer],
    band: Band,
    *,
    is_cautious: bool = False,
) -> Plates:
    """The plates with what this frame shows of the room in a band.

    Args:
        plates: so far.
        frame: live pictures.
        exposures: one per lens, of this frame.
        taken: movable objects as drawn into the band's lens; nothing is learned there.
        band: what to learn from.
        is_cautious: things may be anywhere; a grey one before a wall is no shadow on it.
    """
    images, noise, learned = list(plates.images), list(plates.noise), list(plates.learned)
    index = band.lens
    height, width = images[index].shape[:2]
    margin = max(SHRINK, round(MARGIN_SIDE * width)) // SHRINK * SHRINK
    top = max(band.top - margin, 0) // SHRINK * SHRINK
    bottom = min(band.bottom + margin, height)
    rows = slice(top, bottom)
    free = _free_of(taken, rows, width)
    image, rough, known = _learn_rows(
        frame.images[index][rows],
        images[index][rows],
        learned[index][rows],
        exposures[index],
        usable=free & (plates.coverage[index][rows] > 0.5),
        radius2=_radius2(height, width)[rows],
        is_cautious=is_cautious,
    )
    inner = slice(band.top - top, band.bottom - top)
    for pictures, part in ((images, image), (noise, rough), (learned, known)):
        pictures[index] = _with_rows(pictures[index], part[inner], band)
    return replace(plates, images=tuple(images), noise=tuple(noise), learned=tuple(learned))


def _with_rows(picture: NDArray[Any], part: NDArray[Any], band: Band) -> NDArray[Any]:
    if band.top == 0 and band.bottom == len(picture):
        return part
    changed = picture.copy()
    changed[band.top : band.bottom] = part
    return changed


def _free_of(taken: Sequence[Layer], rows: slice, width: int) -> NDArray[np.bool_]:
    """(rows, W) bool: away from all drawn objects."""
    shown = np.zeros((rows.stop - rows.start, width), np.uint8)
    for layer in taken:
        first, last = max(layer.top, rows.start), min(layer.top + len(layer.alpha), rows.stop)
        if first < last:
            drawn = layer.alpha[first - layer.top : last - layer.top] > 0.05
            part = shown[first - rows.start : last - rows.start, layer.left :]
            part = part[:, : drawn.shape[1]]
            np.maximum(part, drawn, out=part)
    side = 2 * max(1, round(KEEP_AWAY_SIDE * width)) + 1
    return cv2.dilate(shown, np.ones((side, side))) == 0


def _radius2(height: int, width: int) -> FloatArray:
    """(H, W) squared distance from the centre, 1 at the border."""
    x = ((np.arange(width, dtype=np.float32) + 0.5) / width - 0.5) * 2
    y = ((np.arange(height, dtype=np.float32) + 0.5) / height - 0.5) * 2
    return np.asarray(x[None, :] ** 2 + y[:, None] ** 2, dtype=np.float32)


def _learn_rows(
    live: NDArray[np.uint8],
    plate: FloatArray,
    learned: NDArray[np.bool_],
    exposure: Exposure,
    *,
    usable: NDArray[np.bool_],
    radius2: FloatArray,
    is_cautious: bool,
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """New plate, noise and learned mask of some rows of one lens."""
    height, width = plate.shape[:2]
    falloff = radius2[..., None] * exposure.falloff.astype(np.float32)
    gain = exposure.gain.astype(np.float32) + falloff
    neutral = (live.astype(np.float32) / 255.0 - exposure.offset.astype(np.float32)) / gain
    residual = np.asarray(neutral - plate, dtype=np.float32)
    small = (width // SHRINK, height // SHRINK)
    small_residual, small_plate = resized(residual, small), resized(plate, small)
    side = max(3, round(COHERENT_SIDE * width / SHRINK)) | 1
    mean_residual = box_blurred(small_residual, side)
    level = CAUTIOUS_LEVEL if is_cautious else COHERENT_LEVEL
    shows_room = np.abs(mean_residual).max(axis=2) < level
    if not is_cautious:
        shows_room |= _relit(box_blurred(small_plate, side), mean_residual)
    take = usable & (cv2.resize(shows_room.astype(np.uint8), (width, height)) > 0)
    share = np.where(learned, np.float32(BLEND), np.float32(1.0)) * take
    plate = plate + residual * share[..., None]
    known = learned | take
    noise = plate_noise(plate)
    if not known.all():
        speckle = np.abs(small_residual - mean_residual).mean(axis=2)
        taken = cv2.resize(take.astype(np.uint8), small, interpolation=cv2.INTER_NEAREST) > 0
        rough = cv2.resize(_roughness(speckle, taken), (width, height))
        noise = np.where(known, noise, np.maximum(noise, rough))
    return plate, noise.astype(np.float32), known


def _relit(plate: FloatArray, residual: FloatArray) -> NDArray[np.bool_]:
    """Where the same colour is only lighter or darker: a shadow has come or gone."""
    live = plate + residual
    power = np.einsum("hwc,hwc->hw", plate, plate) + 1e-4
    ratio = np.einsum("hwc,hwc->hw", live, plate) / power
    hue = np.abs(live - ratio[..., None] * plate).max(axis=2)
    return (ratio > RELIT_RATIO[0]) & (ratio < RELIT_RATIO[1]) & (hue < RELIT_HUE)


def _roughness(residual: FloatArray, take: NDArray[np.bool_]) -> FloatArray:
    """Typical difference between scan and live picture in the surroundings that were taken over."""
    weight = take.astype(np.float32)
    side = max(3, round(ROUGH_SIDE * residual.shape[1]) * 2 + 1)
    total, count = box_blurred(residual * weight, side), box_blurred(weight, side)
    return (total / np.maximum(count, 1e-3)).astype(np.float32)
