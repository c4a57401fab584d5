"""Masks that a hand draws in a picture: boxes, outlines (lasso) and strokes of a brush."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

MAX_BRUSH_PX = 500.0
"""Radius of a brush: more than half of the pictures that rooms are marked in."""

Point = tuple[float, float]
SUBPIXEL_BITS = 4
"""Binary digits of a pixel in OpenCV's fixed point."""


@dataclass(frozen=True, slots=True)
class Stroke:
    """One stroke of a brush.

    Attributes:
        radius_px: half of its width.
        points: (x, y) along its middle, pixels.

    Raises:
        ValueError: the radius is no length, or there is no point.
    """

    radius_px: float
    points: tuple[Point, ...]

    def __post_init__(self) -> None:
        if not 0 < self.radius_px <= MAX_BRUSH_PX:
            raise ValueError(f"brush: radius {self.radius_px} px, limits 0 to {MAX_BRUSH_PX:g} px")
        if not self.points or not np.isfinite(self.points).all():
            raise ValueError("brush: a stroke without points, wanted finite X Y of one or more")


@dataclass(frozen=True, slots=True)
class Drawn:
    """All that was drawn in one picture; what any of it holds is meant.

    Attributes:
        box: (left, top, right, bottom), pixels, or None.
        outlines: closed ones, (x, y) each of three corners or more.
        strokes: of a brush.
    """

    box: tuple[float, float, float, float] | None = None
    outlines: tuple[tuple[Point, ...], ...] = ()
    strokes: tuple[Stroke, ...] = ()

    def mask(self, width: int, height: int) -> NDArray[np.bool_]:
        """(height, width) bool: what of a picture is meant.

        Raises:
            ValueError: an outline is none, or nothing of the picture is meant.
        """
        canvas = np.zeros((height, width), np.uint8)
        corners: list[Sequence[Point]] = list(self.outlines)
        if self.box is not None:
            left, top, right, bottom = self.box
            corners.append(((left, top), (right, top), (right, bottom), (left, bottom)))
        for outline in corners:
            if len(outline) < 3 or not np.isfinite(outline).all():
                raise ValueError(f"lasso: {len(outline)} corners, wanted three finite ones or more")
            cv2.fillPoly(canvas, [_fixed(outline)], (1,), cv2.LINE_8, SUBPIXEL_BITS)
        for stroke in self.strokes:
            width_px = max(1, round(2 * stroke.radius_px))
            points = np.round(np.array(stroke.points) - 0.5).astype(np.int32)
            cv2.polylines(canvas, [points], False, (1,), width_px)
            for x, y in points:
                cv2.circle(canvas, (int(x), int(y)), max(1, round(stroke.radius_px)), (1,), -1)
        if not canvas.any():
            raise ValueError(f"what was drawn lies outside the {width}×{height} px picture")
        return canvas > 0


def _fixed(points: Sequence[Point]) -> NDArray[np.int32]:
    return np.round((np.array(points) - 0.5) * (1 << SUBPIXEL_BITS)).astype(np.int32)
