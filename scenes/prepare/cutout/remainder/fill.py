# pyright: standard
"""Fills the hole that an object leaves in what it stood on.

The support was never seen where the object stood. New flat splats are laid on its plane there, with
the colours of the support around it mirrored in the hole's rim, so that its pattern goes on.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from scenes.prepare.cutout.colour_similarity import usual
from scenes.prepare.cutout.level_planes import level_area
from scenes.prepare.cutout.object.upright_box import UprightBox
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]

CELL_M = 0.01
"""Side of a cell of the hole, metres."""
MARGIN_M = 0.04
"""Width around an object's outline that is filled too, metres."""
PLANE_REACH_M = 0.02
"""Splats this near to the plane belong to the support."""
COVERED = 0.5
"""Opacity over a cell from which on it needs no filling."""
RIM_M = 0.35
"""How far around the hole colours are taken from."""
OVERLAP = 0.75
"""Standard deviation of a new splat in cells' steps: enough to leave no gaps."""
STEP_CELLS = 2
"""Cells between the splats of a fill."""
SOURCES = 15
"""Splats of the support that a new one takes its colour from."""
OPACITY = 0.95
"""Opacity of a fill's splats."""
THICKNESS_M = 0.0008
"""Thickness of a fill's splats, standard deviation in metres."""


def fill_support(room: SplatCloud, footprint: FloatArray, box: UprightBox) -> SplatCloud | None:
    """Splats for the part of the support that the object hid, or None where nothing is missing.

    Args:
        room: what is left, world frame.
        footprint: (K, 3) the object's splats, whose outline from above is the hole at most.
        box: of the object; its support is the plane.
    """
    outline = cv2.convexHull(footprint[:, :2].astype(np.float32))[:, 0, :].astype(np.float64)
    low = outline.min(axis=0) - MARGIN_M - RIM_M
    high = outline.max(axis=0) + MARGIN_M + RIM_M
    on_plane = np.abs(room.means[:, 2] - box.support_z_m) < PLANE_REACH_M
    on_plane &= ((room.means[:, :2] > low) & (room.means[:, :2] < high)).all(axis=1)
    support = room.select(on_plane)
    if len(support) < 8:
        return None
    shape = tuple(int(n) for n in np.ceil((high - low) / CELL_M).astype(int)[::-1])
    inside = _within(outline, low, shape)
    covered = _coverage(support, low, shape) > COVERED
    reach = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
    hole = cv2.morphologyEx((inside & ~covered).astype(np.uint8), cv2.MORPH_CLOSE, reach) > 0
    rows, columns = np.nonzero(hole)
    chosen = (rows % STEP_CELLS == 0) & (columns % STEP_CELLS == 0)
    if not chosen.any():
        return None
    places = low + (np.stack([columns, rows], axis=1)[chosen] + 0.5) * CELL_M
    # What lies under the object was never seen, covered or not: its colours are nobody's.
    outside = ~inside[_cells(support.means[:, :2].astype(np.float64), low, shape)]
    if not outside.any():
        return None
    around = support.select(outside)
    # A sheet of paper beside the hole does not go on in it.
    colours = np.clip(around.colours(), 0.0, 1.0)
    own = usual(colours, among=colours, area=level_area(around))
    around = around.select(own) if own.any() else around
    return _lay(places, around, box.support_z_m, hole, low)


def _within(outline: FloatArray, low: FloatArray, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """(rows, columns) cells within the outline and its margin."""
    canvas = np.zeros(shape, dtype=np.uint8)
    cv2.fillConvexPoly(canvas, np.round((outline - low) / CELL_M - 0.5).astype(np.int32), 1)
    size = 2 * round(MARGIN_M / CELL_M) + 1
    return cv2.dilate(canvas, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))) > 0


def _cells(
    points: FloatArray, low: FloatArray, shape: tuple[int, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    cells = np.floor((points - low) / CELL_M).astype(np.intp)
    return np.clip(cells[:, 1], 0, shape[0] - 1), np.clip(cells[:, 0], 0, shape[1] - 1)


def _coverage(support: SplatCloud, low: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """(rows, columns) opacity of the support over each cell, seen from above."""
    through = np.ones(shape)
    flat = support.covariances()[:, :2, :2] + np.eye(2) * (0.3 * CELL_M) ** 2
    inverse = np.linalg.inv(flat)
    reach = np.ceil(2.5 * np.sqrt(flat[:, [0, 1], [0, 1]].max(axis=1)) / CELL_M).astype(int)
    rows, columns = _cells(support.means[:, :2].astype(np.float64), low, shape)
    for k, (row, column) in enumerate(zip(rows, columns, strict=True)):
        extent = min(int(reach[k]), 60)
        r = slice(max(row - extent, 0), row + extent + 1)
        c = slice(max(column - extent, 0), column + extent + 1)
        y = low[1] + (np.arange(*r.indices(shape[0])) + 0.5) * CELL_M - support.means[k, 1]
        x = low[0] + (np.arange(*c.indices(shape[1])) + 0.5) * CELL_M - support.means[k, 0]
        a, b, d = inverse[k, 0, 0], inverse[k, 0, 1], inverse[k, 1, 1]
        power = a * x[None, :] ** 2 + 2 * b * x[None, :] * y[:, None] + d * y[:, None] ** 2
        through[r, c] *= 1.0 - support.opacities[k] * np.exp(-0.5 * power)
    return 1.0 - through


def _lay(
    places: FloatArray,
    support: SplatCloud,
    height_m: float,
    hole: NDArray[np.bool_],
    low: FloatArray,
) -> SplatCloud:
    """Flat splats at the places, coloured from the support mirrored in the hole's rim."""
    rim = hole & (cv2.erode(hole.astype(np.uint8), np.ones((3, 3), np.uint8)) == 0)
    rim_rows, rim_columns = np.nonzero(rim)
    rim_xy = low + (np.stack([rim_columns, rim_rows], axis=1) + 0.5) * CELL_M
    _, nearest = KDTree(rim_xy).query(places)
    n = len(places)
    mirrored = 2.0 * rim_xy[nearest] - places
    # One stray colour would be a spot; of several beside each other the middle one is the floor's.
    among = min(SOURCES, len(support))
    _, source = KDTree(support.means[:, :2].astype(np.float64)).query(mirrored, k=among)
    colours = np.median(support.sh[source.reshape(n, among)], axis=1)
    spread = OVERLAP * STEP_CELLS * CELL_M
    return SplatCloud(
        np.column_stack([places, np.full(n, height_m)]).astype(np.float32),
        np.tile(np.array([spread, spread, THICKNESS_M], dtype=np.float32), (n, 1)),
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (n, 1)),
        np.full(n, OPACITY, dtype=np.float32),
        colours,
    )
