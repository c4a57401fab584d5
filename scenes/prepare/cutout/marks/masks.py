"""From a box, clicks and strokes in a picture to the mask of one object, without weights."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

MAX_SIDE_PX = 640
"""GrabCut's time grows with the picture; its outline gains little from more."""
STROKE_PX = 4.0
"""Half width of what a click or stroke says about its surroundings."""
MARGIN = 0.35
"""Of the box's size: how much of its surroundings GrabCut learns the background from."""
ITERATIONS = 5
"""Rounds of GrabCut."""


@dataclass(frozen=True, slots=True, eq=False)
class Prompt:
    """Marks of a person on one object in one picture: a box, points.

    Attributes:
        box_px: (left, top, right, bottom) around the whole object, or None to use the strokes only.
        inside_px: (K, 2) points on it: clicks, or points along strokes.
        outside_px: (K, 2) points beside it.

    Raises:
        ValueError: nothing is said, the box is empty or a point is not finite.
    """

    box_px: tuple[float, float, float, float] | None = None
    inside_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    outside_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))

    def __post_init__(self) -> None:
        for name in ("inside_px", "outside_px"):
            points = np.array(getattr(self, name), dtype=np.float64).reshape(-1, 2)
            if not np.isfinite(points).all():
                raise ValueError(f"Prompt.{name}: a point is not finite, wanted pixels")
            points.setflags(write=False)
            object.__setattr__(self, name, points)
        if self.box_px is None and not len(self.inside_px):
            raise ValueError("Prompt: neither a box nor a point on the object; give one of them")
        if self.box_px is not None:
            left, top, right, bottom = self.box_px
            if not (np.isfinite(self.box_px).all() and right > left and bottom > top):
                raise ValueError(
                    f"Prompt.box_px: {self.box_px}, wanted left < right and top < bottom in pixels"
                )


class Masks(Protocol):
    """Finds the pixels of the object that a prompt means."""

    def mask(self, picture: NDArray[np.uint8], prompt: Prompt) -> NDArray[np.bool_]:
        """(H, W, 3) RGB picture -> (H, W) bool.

        Args:
            picture: what to look at.
            prompt: what is meant.

        Raises:
            ValueError: the prompt lies outside the picture.
        """
        ...


class GrabCutMasks:
    """Masks by colour statistics inside and around a box (Rother et al. 2004), without weights.

    Args:
        iterations: rounds of learning colours and cutting.
    """

    def __init__(self, *, iterations: int = ITERATIONS) -> None:
        self._iterations = iterations

    def mask(self, picture: NDArray[np.uint8], prompt: Prompt) -> NDArray[np.bool_]:
        """See `Masks.mask`."""
        height, width = picture.shape[:2]
        left, top, right, bottom = _clip(_box_of(prompt), width, height)
        # GrabCut learns what the background looks like from what it is given: the surroundings
        # separate the object, the far side of the room does not.
        reach_x, reach_y = MARGIN * (right - left) + 8, MARGIN * (bottom - top) + 8
        x0, y0 = int(max(left - reach_x, 0)), int(max(top - reach_y, 0))
        x1, y1 = int(min(right + reach_x, width)), int(min(bottom + reach_y, height))
        crop = picture[y0:y1, x0:x1]
        scale = min(1.0, MAX_SIDE_PX / max(crop.shape[:2]))
        small = cv2.resize(crop, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        hints = np.full(small.shape[:2], cv2.GC_BGD, np.uint8)
        inner = np.array([left - x0, top - y0, right - x0, bottom - y0]) * scale
        row, column = np.ogrid[: small.shape[0], : small.shape[1]]
        in_box = (
            (column + 0.5 > inner[0])
            & (column + 0.5 < inner[2])
            & (row + 0.5 > inner[1])
            & (row + 0.5 < inner[3])
        )
        hints[in_box] = cv2.GC_PR_FGD
        for points, hint in (
            (prompt.outside_px, cv2.GC_BGD),
            (prompt.inside_px, cv2.GC_FGD),
        ):
            for x, y in (points - (x0, y0)) * scale:
                centre = (round(x - 0.5), round(y - 0.5))
                cv2.circle(hints, centre, max(1, round(STROKE_PX * scale)), int(hint), -1)
        if (hints == cv2.GC_BGD).all() or not (hints == cv2.GC_BGD).any():
            return _paste(hints != cv2.GC_BGD, (x0, y0, x1, y1), (height, width))
        bgr = np.ascontiguousarray(small[..., ::-1])
        models = np.zeros((1, 65)), np.zeros((1, 65))
        # OpenCV draws from its own generator; the same prompt shall give the same mask.
        cv2.setRNGSeed(0)
        cv2.grabCut(bgr, hints, (0, 0, 1, 1), *models, self._iterations, cv2.GC_INIT_WITH_MASK)
        found = (hints == cv2.GC_FGD) | (hints == cv2.GC_PR_FGD)
        return _paste(found, (x0, y0, x1, y1), (height, width))


def _box_of(prompt: Prompt) -> tuple[float, float, float, float]:
    if prompt.box_px is not None:
        return prompt.box_px
    low, high = prompt.inside_px.min(axis=0), prompt.inside_px.max(axis=0)
    reach = np.maximum(high - low, 40.0)
    left, top = low - reach
    right, bottom = high + reach
    return float(left), float(top), float(right), float(bottom)


def _clip(
    box_px: tuple[float, float, float, float], width: int, height: int
) -> tuple[float, float, float, float]:
    left, top = max(box_px[0], 0.0), max(box_px[1], 0.0)
    right, bottom = min(box_px[2], float(width)), min(box_px[3], float(height))
    if right - left < 2 or bottom - top < 2:
        raise ValueError(
            f"box {tuple(round(v) for v in box_px)} px leaves nothing of the {width}×{height} px "
            "picture; draw it around the object in this view"
        )
    return left, top, right, bottom


def _paste(
    small: NDArray[np.bool_], box: tuple[int, int, int, int], shape: tuple[int, int]
) -> NDArray[np.bool_]:
    x0, y0, x1, y1 = box
    full = np.zeros(shape, dtype=bool)
    resized = cv2.resize(
        small.astype(np.uint8), (x1 - x0, y1 - y0), interpolation=cv2.INTER_LINEAR_EXACT
    )
    full[y0:y1, x0:x1] = resized > 0
    return full
