"""Background images learn: where the live picture agrees with the scan, it is better than it.

A scan is blurred, speckled and lit as on the day it was made. Pixels that certainly show the room
(outside every known object, without a coherent difference over their surroundings) are copied into
the background image at its exposure. People and unknown objects differ coherently and are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from tracking.background.images import BackgroundImages, Exposure
from tracking.background.strips import STRIPS, strip_of
from tracking.kernels.background import LEARNING
from tracking.kernels.native import RoomLearner
from tracking.window.window import Layer

FloatArray = NDArray[np.float32]

COHERENT_SIDE = 1 / 110
"""Side of the surroundings that are averaged, as a share of the lens picture's."""

COHERENT_LEVEL = 0.07
"""Mean difference (channel of 0..1) above which pixels show an object. Chosen on the rooms lab and
desk."""


CAUTIOUS_LEVEL = 0.03
"""The same with `Care.CAUTIOUS` and `Care.WARY`: a pale mug before a pale wall differs little
more."""


WARY_SIDE = 1 / 72
"""Side of the square, as a share of the lens picture's, that must be free of differences with
`Care.WARY`: sides and handles of objects have colours like the room's."""


KEEP_AWAY_SIDE = 1 / 360
"""Distance kept from known objects, as a share of the lens picture's side."""

SHRINK = 4
"""Downsampling, each way, of the picture in which coherent differences are found."""


MARGIN_SIDE = 1 / 90
"""Rows beside a band that are looked at with it, as a share of the lens picture's side."""

ROUGH_SIDE = 1 / 24
"""Surroundings over which the roughness of pixels not yet learned is estimated."""

LEARNER = RoomLearner(LEARNING.for_native())
"""Native learner; `tests.twins.solver.learned_rows` is its numpy twin."""


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
    lens, part = divmod(turn % (STRIPS * len(heights_px)), STRIPS)
    return Band(lens, *strip_of(part, heights_px[lens]))


def looked_at(band: Band, width: int, height: int) -> slice:
    """The rows that a band is learned from: those beside it as well."""
    margin = max(SHRINK, round(MARGIN_SIDE * width)) // SHRINK * SHRINK
    return slice(max(band.top - margin, 0) // SHRINK * SHRINK, min(band.bottom + margin, height))


class Care(Enum):
    """How much of what differs from the scan is learned as background."""

    LITTLE = "what is only lighter or darker is background, too"
    CAUTIOUS = "a grey object before a wall is no shadow on it"
    WARY = "objects may be anywhere, and extend beyond what differs"


def surroundings(width: int, care: Care) -> tuple[int, int, int]:
    """Sides in px of the shrunk picture's squares: coherence average, roughness, freedom."""
    small = -(-width // SHRINK)
    coherent, wary = (max(3, round(side * small)) | 1 for side in (COHERENT_SIDE, WARY_SIDE))
    rough = max(3, round(ROUGH_SIDE * small) * 2 + 1)
    return coherent, rough, wary if care is Care.WARY else 1


def learn(
    background: BackgroundImages,
    frame: Frame,
    exposure: Exposure,
    taken: Sequence[Layer],
    band: Band,
    *,
    care: Care = Care.LITTLE,
) -> BackgroundImages:
    """Background images updated from what this frame shows of the room in a band.

    Args:
        background: so far.
        frame: live pictures.
        exposure: of the band's lens in this frame.
        taken: movable objects rendered into the band's lens; nothing is learned there.
        band: rows to learn from.
        care: which differences are learned.
    """
    index = band.lens
    images, noise, learned = (
        list(background.images),
        list(background.noise),
        list(background.learned),
    )
    height, width = images[index].shape[:2]
    rows = looked_at(band, width, height)
    free = _free_of(taken, rows, width)
    image, rough, known = LEARNER.learn(
        frame.images[index][rows],
        images[index][rows, :],
        learned[index][rows, :],
        free & (background.coverage[index][rows] > 0.5),
        lens_size=(width, height),
        top=rows.start,
        exposure=exposure.rows(),
        sides=surroundings(width, care),
        level=COHERENT_LEVEL if care is Care.LITTLE else CAUTIOUS_LEVEL,
        is_cautious=care is not Care.LITTLE,
    )
    inner = slice(band.top - rows.start, band.bottom - rows.start)
    size = (rows.stop - rows.start, width)
    images[index] = images[index].with_rows(band.top, image.reshape(*size, 3)[inner])
    noise[index] = noise[index].with_rows(band.top, rough.reshape(size)[inner])
    learned[index] = learned[index].with_rows(band.top, known.reshape(size)[inner])
    return replace(background, images=tuple(images), noise=tuple(noise), learned=tuple(learned))


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
