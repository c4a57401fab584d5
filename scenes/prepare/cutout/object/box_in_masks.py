# pyright: standard
"""The box of an object that is one, as its masks show it.

Views that look along a book's cover hardly constrain its depth, and the splats of its far edge hang
together with the table's. A mask in a photo ends where the book ends, to a pixel. A place belongs
to a box if everything above it, from the box's bottom to its top, falls into the masks; of all
rectangles the one is taken that holds most such places and least others. Drawn into the views, the
box has to cover the masks: what is no box is recognised by that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.prepare.cutout.marks.masked_view import MaskedView

FloatArray = NDArray[np.float64]

MIN_OVERLAP = 0.8
"""Of a mask and the box drawn into its view: what is less is no box, or no good mask."""
MAX_MASK_ERROR_PX = 2
"""How far beside an object its mask may end."""
MIN_MASK_COVERED = 0.96
"""Of a mask, by the box drawn so much larger: a stool's seat reaches out above its legs."""
MIN_PLACES_HELD = 0.96
"""Of the places: what leaves more out of its rectangle, such as a mug's handle, is no box."""
MIN_OBJECT_SHARE = 0.8
"""Of what is known of the object: columns that fall into a stool's masks are fewer than its
seat."""
BESIDE_M = 0.03
"""So far beside a box what is known of the object may lie."""
MAX_PIXEL_M = 0.0045
"""A mask ends up to two pixels beside the object on either side: four should be under 2 cm."""
AROUND_M = 0.1
"""How far beyond what is known of the object its box may reach."""
CELL_M = 0.0025
"""Side of a cell of the grid, metres."""
MAX_CELLS = 200
"""Along each side of the grid: the cells of a large object are larger."""
COARSE = 4
"""Cells, across, that are one while the yaw is looked for."""
LEVELS = 3
"""Heights at which the masks vote."""
YAWS_DEG = np.arange(-44.0, 45.0, 1.0)
"""Yaws that are tried, degrees: a rectangle is the same after a quarter turn."""
NEXT_YAWS_DEG = np.arange(-1.0, 1.01, 0.25)
"""Yaws that are tried around the best of them, degrees."""


@dataclass(frozen=True, slots=True)
class LevelRectangle:
    """A rectangle seen from above: its middle (x, y), its first side's yaw, and both sides."""

    middle: tuple[float, float]
    yaw: float
    sides_m: tuple[float, float]


def box_in_masks(
    views: Sequence[MaskedView], places: FloatArray, span_m: tuple[float, float]
) -> LevelRectangle | None:
    """Fit a standing box to masks; None if they show no box.

    Args:
        views: with masks of the object; pinhole ones from near enough are looked at.
        places: (N, 2) level places of the object, roughly.
        span_m: heights of its bottom and its top.
    """
    if not len(places):
        return None
    middle = np.asarray(np.median(places, axis=0), dtype=np.float64)
    seen = _near_enough(views, np.append(middle, sum(span_m) / 2))
    if not seen:
        return None
    reach = AROUND_M + float(np.quantile(np.linalg.norm(places - middle, axis=1), 0.99))
    cell = max(CELL_M, 2 * reach / MAX_CELLS)
    count = COARSE * int(np.ceil(2 * reach / (cell * COARSE)))
    along = (np.arange(count) + 0.5 - count / 2) * cell
    grid = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1)
    voices = _voices(seen, middle + grid.reshape(-1, 2), span_m).reshape(count, count)
    coarse = [_best(_turn(voices, yaw), COARSE)[0] for yaw in np.deg2rad(YAWS_DEG)]
    near = np.deg2rad(YAWS_DEG[int(np.argmax(coarse))] + NEXT_YAWS_DEG)
    fine = [_best(_turn(voices, yaw), 1) for yaw in near]
    best = int(np.argmax([gain for gain, _ in fine]))
    yaw, ends = float(near[best]), fine[best][1]
    places_in = _turn(voices, yaw) > 0
    if places_in[slice(*ends[0]), slice(*ends[1])].sum() < MIN_PLACES_HELD * places_in.sum():
        return None
    low, high = (np.array(ends).T - count / 2) * cell
    beside = np.abs((places - middle) @ _axes(yaw).T - 0.5 * (low + high)) - 0.5 * (high - low)
    if (beside < BESIDE_M).all(axis=1).mean() < MIN_OBJECT_SHARE:
        return None
    x, y = middle + _axes(yaw).T @ (0.5 * (low + high))
    sides = float(high[0] - low[0]), float(high[1] - low[1])
    found = LevelRectangle((float(x), float(y)), yaw, sides)
    fits = [_fit(view, camera, found, span_m) for view, camera in seen]
    overlap, covered = np.median(fits, axis=0)
    return found if overlap >= MIN_OVERLAP and covered >= MIN_MASK_COVERED else None


def _near_enough(
    views: Sequence[MaskedView], middle: FloatArray
) -> list[tuple[MaskedView, Pinhole]]:
    """The pinhole views with pixels fine enough at an object's middle (3,), and their cameras."""
    seen = []
    for view in views:
        if isinstance(view.camera, Pinhole):
            away = float(np.linalg.norm(view.world_from_camera.translation - middle))
            if away <= MAX_PIXEL_M * view.camera.fx:
                seen.append((view, view.camera))
    return seen


def _axes(yaw: float) -> FloatArray:
    """(2, 2) the directions of a rectangle's sides, as rows."""
    return np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])


def _voices(
    seen: Sequence[tuple[MaskedView, Pinhole]], places: FloatArray, span_m: tuple[float, float]
) -> FloatArray:
    """(N,) share of the views, less a half, in whose mask all that is above a place falls."""
    inside, framed = np.zeros((2, len(places)))
    for view, camera in seen:
        all_in, in_frame = np.ones((2, len(places)), dtype=bool)
        for height in np.linspace(*span_m, LEVELS):
            points = np.column_stack([places, np.full(len(places), height)])
            pixels, there = camera.project(view.world_from_camera.inverse() @ points)
            column = np.clip(pixels[:, 0].astype(np.intp), 0, camera.width_px - 1)
            row = np.clip(pixels[:, 1].astype(np.intp), 0, camera.height_px - 1)
            all_in &= there & view.mask[row, column]
            in_frame &= there
        inside += all_in
        framed += in_frame
    return inside / np.maximum(framed, 1.0) - 0.5


def _turn(voices: FloatArray, yaw: float) -> FloatArray:
    """The grid along the sides of a rectangle of that yaw."""
    count = len(voices)
    along = np.arange(count) + 0.5 - count / 2
    x, y = np.meshgrid(along, along, indexing="ij")
    axes = _axes(yaw)
    at = [axes[0, k] * x + axes[1, k] * y + count / 2 - 0.5 for k in range(2)]
    return np.asarray(ndimage.map_coordinates(voices, at, order=1, cval=-0.5))


def _best(voices: FloatArray, step: int) -> tuple[float, tuple[tuple[int, int], tuple[int, int]]]:
    """The largest sum that a rectangle of cells holds, and its first and end cell both ways."""
    n = len(voices) // step
    blocks = voices.reshape(n, step, n, step).sum(axis=(1, 3))
    above = np.vstack([np.zeros(n), np.cumsum(blocks, axis=0)])
    most, ends = -np.inf, ((0, 0), (0, 0))
    for first in range(n):
        # For each last row: sums of columns so far, and the least of them before each column.
        running = np.cumsum(above[first + 1 :] - above[first], axis=1)
        before = np.hstack([np.zeros((n - first, 1)), running[:, :-1]])
        gains = running - np.minimum.accumulate(before, axis=1)
        last, column = np.unravel_index(int(gains.argmax()), gains.shape)
        if gains[last, column] > most:
            start = int(before[last, : column + 1].argmin())
            most = float(gains[last, column])
            rows = step * first, step * (first + int(last) + 1)
            ends = rows, (step * start, step * (int(column) + 1))
    return most, ends


def _fit(
    view: MaskedView, camera: Pinhole, box: LevelRectangle, span_m: tuple[float, float]
) -> tuple[float, float]:
    """Overlap of the mask and the box drawn into its view, and how much of the mask it covers.

    The first is intersection over union; the second allows for how far off masks are.
    """
    world_from_box = Pose.from_yaw(box.yaw, (*box.middle, 0.0))
    half_x, half_y = 0.5 * box.sides_m[0], 0.5 * box.sides_m[1]
    corners = [(x, y, z) for x in (-half_x, half_x) for y in (-half_y, half_y) for z in span_m]
    in_camera = view.world_from_camera.inverse() @ (world_from_box @ np.array(corners))
    if (in_camera[:, 2] <= 0).any():
        return 0.0, 0.0
    pixels, _ = camera.project(in_camera)
    drawn = np.zeros(view.mask.shape, dtype=np.uint8)
    hull = cv2.convexHull(np.floor(pixels).astype(np.int32))
    cv2.fillConvexPoly(drawn, hull, 1)
    larger = cv2.dilate(drawn, np.ones((2 * MAX_MASK_ERROR_PX + 1,) * 2, dtype=np.uint8)) > 0
    union = int(((drawn > 0) | view.mask).sum())
    overlap = float(((drawn > 0) & view.mask).sum() / max(union, 1))
    return overlap, float((larger & view.mask).sum() / max(int(view.mask.sum()), 1))
