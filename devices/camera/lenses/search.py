"""The layout of a stream found from one of its pictures, with how sure that is.

Pure: nothing is remembered. Which lens of two is the front one cannot be seen; the first is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.camera.lenses.layout import Arrangement, Box, LensLayout
from devices.camera.lenses.lens_pictures import luma_of_sphere
from devices.camera.lenses.upright_evidence import (
    RIM_WEIGHT,
    SIZE_PX,
    Luma,
    rim_agreement,
    small_lens_picture,
    turned_back,
    upright_nats,
)
from devices.camera.stream_decoder import Plane, StreamPicture

INSIDE, OUTSIDE = 0.85, 1.08
"""Radii over half a share's side: nearer is inside the circle, farther outside, between is neither.

Circles of real cameras reach 1.00 to 1.05 of it; lens flare brightens the first few per cent."""

LONG_SIDE_PX = 384
"""Length to which a picture is shrunk before it is looked at."""

PAIRS_OF_TURNS = ((0, 0), (1, 1), (2, 2), (3, 3), (1, 3), (3, 1))
"""How two lenses are turned, in quarters: equally, or against each other as the X series does."""

CIRCLES_FROM = 0.6
"""Darkness outside the circles at which circles are as likely as none.

On random rooms 5000 to 5039 it is at least 0.75 with circles and at most 0.32 without.
"""

NATS_PER_DARKNESS = 20.0
"""Nats per unit of darkness outside: the two extremes above are then worth 3 and 6."""

LONG_BY_SHORT = 1.5
"""From this ratio of the sides on, a picture may hold two lenses: 4:3 has one, 16:9 either."""

SPHERE_RATIO = 0.05
"""Largest deviation of the sides' ratio from 2 in an equirectangular picture."""


@dataclass(frozen=True, slots=True)
class FoundLayout:
    """A layout and how sure it is.

    Attributes:
        layout: the likeliest.
        score: how much likelier it is than the next one, nats.
        confidence: its probability among all that were compared, 0 to 1.
        others: the others with how much less likely they are, nats, likeliest first.
    """

    layout: LensLayout
    score: float
    confidence: float
    others: tuple[tuple[LensLayout, float], ...]


def find_layout(picture: StreamPicture) -> FoundLayout:
    """How a stream's picture holds the lenses; takes some 50 ms.

    Raises:
        ValueError: the picture is too small to say, below 64 px a side.
    """
    if min(picture.width_px, picture.height_px) < 64:
        raise ValueError(
            f"layout: picture of {picture.width_px}×{picture.height_px} px, wanted at least 64 px "
            "a side"
        )
    nats: dict[LensLayout, float] = {}
    for arrangement, of_arrangement in _arrangements(picture.y).items():
        turns = _turns(picture.y, arrangement)
        total = math.log(sum(math.exp(value) for value in turns.values()))
        for turn, value in turns.items():
            nats[LensLayout(arrangement, turn)] = of_arrangement + value - total
    ranked = sorted(nats, key=lambda layout: -nats[layout])
    best = nats[ranked[0]]
    others = tuple((layout, best - nats[layout]) for layout in ranked[1:])
    confidence = 1.0 / (1.0 + sum(math.exp(-less) for _, less in others))
    return FoundLayout(ranked[0], others[0][1], confidence, others)


def _arrangements(luma: Plane) -> dict[Arrangement, float]:
    """Those that the picture's shape allows, in nats."""
    small = shrunk(luma)
    ratio = luma.shape[1] / luma.shape[0]
    circles = [Arrangement.ONE_LENS]
    if ratio >= LONG_BY_SHORT:
        circles.append(Arrangement.SIDE_BY_SIDE)
    if ratio <= 1 / LONG_BY_SHORT:
        circles.append(Arrangement.STACKED)
    nats = {a: NATS_PER_DARKNESS * (darkness_outside(small, a) - CIRCLES_FROM) for a in circles}
    if abs(max(ratio, 1 / ratio) - 2.0) <= SPHERE_RATIO * 2.0:
        nats[Arrangement.EQUIRECTANGULAR] = 0.0
    return nats


def _turns(luma: Plane, arrangement: Arrangement) -> dict[tuple[int, ...], float]:
    """Nats of each way to turn the lens pictures, the best at 0."""
    if arrangement is Arrangement.EQUIRECTANGULAR:
        nats = _of_sphere(luma)
    else:
        shape = LensLayout(arrangement, (0, 0) if _is_pair(arrangement) else (0,))
        lenses = [
            small_lens_picture(luma[b.y0 : b.y0 + b.height, b.x0 : b.x0 + b.width])
            for b in shape.boxes(luma.shape[1], luma.shape[0])
        ]
        nats = _of_pair(lenses) if len(lenses) == 2 else _of_lens(lenses[0])
    best = max(nats.values())
    return {turns: value - best for turns, value in nats.items()}


def _is_pair(arrangement: Arrangement) -> bool:
    return arrangement in (Arrangement.SIDE_BY_SIDE, Arrangement.STACKED)


def _of_lens(lens: Luma) -> dict[tuple[int, ...], float]:
    return {(turn,): upright_nats(turned_back(lens, turn)) for turn in range(4)}


def _of_pair(lenses: list[Luma]) -> dict[tuple[int, ...], float]:
    turned = [[turned_back(lens, turn) for turn in range(4)] for lens in lenses]
    nats = [[upright_nats(picture) for picture in lens] for lens in turned]
    return {
        (first, second): nats[0][first]
        + nats[1][second]
        + RIM_WEIGHT * rim_agreement(turned[0][first], turned[1][second])
        for first, second in PAIRS_OF_TURNS
    }


def _of_sphere(luma: Plane) -> dict[tuple[int, ...], float]:
    """An equirectangular picture, seen as the two fisheyes that would be made of it."""
    is_upright = luma.shape[1] > luma.shape[0]
    size = (4 * SIZE_PX, 2 * SIZE_PX) if is_upright else (2 * SIZE_PX, 4 * SIZE_PX)
    small = np.asarray(cv2.resize(luma, size, interpolation=cv2.INTER_AREA), np.uint8)
    return {
        (turn,): sum(
            upright_nats(np.asarray(lens, np.float32))
            for lens in luma_of_sphere(small, turn, SIZE_PX)
        )
        for turn in ((0, 2) if is_upright else (1, 3))
    }


def shrunk(luma: NDArray[np.uint8]) -> Luma:
    """A picture's Y plane (H, W) at the size at which it is looked at."""
    scale = LONG_SIDE_PX / max(luma.shape)
    size = (max(8, round(luma.shape[1] * scale)), max(8, round(luma.shape[0] * scale)))
    return np.asarray(cv2.resize(luma, size, interpolation=cv2.INTER_AREA), np.float32)


def darkness_outside(luma: Luma, arrangement: Arrangement) -> float:
    """Probability that a pixel outside the circles is darker than one inside, minus ½, doubled.

    1 where everything outside is darker than everything inside, 0 where there is no difference.
    """
    boxes = LensLayout(arrangement, (0,) * (1 if arrangement is Arrangement.ONE_LENS else 2)).boxes(
        luma.shape[1], luma.shape[0]
    )
    radii = np.min([_radii(luma, box) for box in boxes], axis=0)
    outside = np.sort(luma[radii > OUTSIDE])
    inside = luma[radii < INSIDE]
    if not len(outside) or not len(inside):
        return 0.0
    below = np.searchsorted(outside, inside, side="left")
    up_to = np.searchsorted(outside, inside, side="right")
    return float((below + up_to).mean() / len(outside) - 1.0)


def _radii(luma: Luma, box: Box) -> NDArray[np.float64]:
    """Distance of every pixel from the middle of a box, over half its side."""
    y, x = np.mgrid[: luma.shape[0], : luma.shape[1]]
    half = 0.5 * box.width
    return np.hypot(x + 0.5 - box.x0 - half, y + 0.5 - box.y0 - half) / half
