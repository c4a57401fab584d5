"""Background images learn: where the live picture agrees with the scan, it is better than it.

A scan is blurred, speckled and lit as on the day it was made. Pixels that certainly show the room
(outside every known object, without a coherent difference over their surroundings) are copied into
the background image at its exposure. People and unknown objects differ coherently and are not.
Where the scan is empty nothing can agree: there the first picture is the room.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Fisheye
from tracking.background.images import KNOWN_COVERAGE, BackgroundImages, Exposure, unexposed
from tracking.background.strips import STRIPS, strip_of
from tracking.kernels.background import LEARNING
from tracking.kernels.native import RoomLearner
from tracking.window.window import Layer

FloatArray = NDArray[np.float32]
T = TypeVar("T")

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
        free & (background.coverage[index][rows] > KNOWN_COVERAGE),
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


def learn_unscanned(
    background: BackgroundImages,
    frame: Frame,
    *,
    lens: int,
    exposure: Exposure,
    taken: Sequence[Layer],
) -> BackgroundImages:
    """Background images that are as this frame where the scan is empty, away from all objects.

    No photo showed the ceiling: there all that is to be seen would differ from the room for ever.

    Args:
        background: so far.
        frame: live pictures.
        lens: which is learned.
        exposure: of it in this frame.
        taken: movable objects rendered into it.
    """
    height, width = background.coverage[lens].shape
    free = _free_of(taken, slice(0, height), width) & _circle_of(frame.rig.lenses[lens])
    here = free & (background.coverage[lens] <= KNOWN_COVERAGE)
    if not here.any():
        return background
    rows, columns = np.nonzero(here)
    x, y = (2.0 * columns + 1.0) / width - 1.0, (2.0 * rows + 1.0) / height - 1.0
    shown = (frame.images[lens][rows, columns] / 255.0).astype(np.float32)
    radius2 = (x * x + y * y).astype(np.float32)
    image = background.images[lens].with_pixels(here, unexposed(shown, exposure, radius2=radius2))
    # This camera saw it: nothing is misaligned.
    noise = background.noise[lens].with_pixels(here, np.float32(LEARNING.noise_floor))
    learned = background.learned[lens].with_pixels(here, np.True_)
    coverage = np.where(here, np.float32(1.0), background.coverage[lens])

    def with_lens(pictures: tuple[T, ...], picture: T) -> tuple[T, ...]:
        return (*pictures[:lens], picture, *pictures[lens + 1 :])

    return replace(
        background,
        images=with_lens(background.images, image),
        noise=with_lens(background.noise, noise),
        learned=with_lens(background.learned, learned),
        coverage=with_lens(background.coverage, coverage),
    )


def _circle_of(lens: Fisheye) -> NDArray[np.bool_]:
    """(H, W) bool: inside a lens's field of view."""
    across, down = (np.arange(n) + 0.5 for n in (lens.width_px, lens.height_px))
    radius2 = (across[None, :] - lens.cx) ** 2 + (down[:, None] - lens.cy) ** 2
    return np.asarray(radius2 < lens.circle_px**2)


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
