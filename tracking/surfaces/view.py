"""Sampling tables of a live surface: four corners in the world, seen by the lenses.

A surface is a planar quad (paper 4.3). Its picture is spread over the quad by the homography that
takes the picture's corners to the quad's, so straight lines stay straight; each pixel's place in
the world is projected through every lens, and the lens that sees the surface finest gives it.
Where that lens ends, the next one fills in: the surface's place is known, so there is no seam.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from scenes.quad import Quad

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

LARGEST_SIDE_PX = 2048
MIN_SIDE_PX = 16
UNSEEN_PX_PER_M = 400.0
"""Fineness of a surface that no lens sees when it is made."""

GRID = 12
"""Cells along each side of a surface on which the lenses are compared."""

LATTICE_PX = 6
"""Pixels between two places that are projected; those between are interpolated."""


RIM_PX = 1.5
"""Border of the lens circle that is not used."""

BEYOND = 1.2
"""Places up to this many radii of the lens circle off its centre are good to interpolate with."""


@dataclass(frozen=True, slots=True, eq=False)
class LensTable:
    """Coordinates of a surface's pixels in one lens.

    Attributes:
        lens: its index.
        map_xy: (H, W, 2) float32 lens pixels in `cv2.remap` coordinates (integer centres).
        quick_map: the same in the fixed-point pair that `cv2.remap` is fastest with.
        taken: (H, W) bool, the pixels that this lens gives.
        range_m: (H, W) float32 distance of the surface from the lens.
    """

    lens: int
    map_xy: NDArray[np.float32]
    quick_map: tuple[NDArray[np.int16], NDArray[np.uint16]]
    taken: BoolArray
    range_m: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceView:
    """A surface as a rig sees it from one place.

    Attributes:
        tables: one per lens that gives pixels; the finest first. Empty if no lens sees any.
        seen: (H, W) bool, the pixels that some lens gives.
    """

    tables: tuple[LensTable, ...]
    seen: BoolArray

    def picture(self, images: tuple[NDArray[np.uint8], ...]) -> NDArray[np.uint8]:
        """The surface's (H, W, 3) picture out of the lenses' pictures; black where unseen."""
        height, width = self.seen.shape
        if not self.tables:
            return np.zeros((height, width, 3), np.uint8)
        first, *others = (_looked_up(images[table.lens], table) for table in self.tables)
        for table, other in zip(self.tables[1:], others, strict=True):
            np.copyto(first, other, where=table.taken[..., None])
        if not self.seen.all():
            first[~self.seen] = 0
        return first


def surface_view(
    quad: Quad,
    rig: Rig,
    world_from_rig: Pose,
    size_px: tuple[int, int],
    *,
    margin_px: tuple[int, int] = (0, 0),
) -> SurfaceView:
    """Look-up tables of a surface.

    Args:
        quad: where it is.
        rig: the 360° camera.
        world_from_rig: its pose.
        size_px: (width, height) of the picture between the corners.
        margin_px: (across, down) further pixels on each side, beyond the corners.
    """
    order = sorted(range(len(rig.lenses)), key=lambda i: -fineness(quad, rig, world_from_rig, i))
    width, height = size_px[0] + 2 * margin_px[0], size_px[1] + 2 * margin_px[1]
    seen = np.zeros((height, width), bool)
    tables: list[LensTable] = []
    for lens in order:
        world_from_lens = world_from_rig @ rig.rig_from_lens[lens]
        if seen.all() or not quad.faces(world_from_lens.translation):
            continue
        columns, rows = _lattice(width), _lattice(height)
        x, y = np.meshgrid(
            (columns - margin_px[0]) / size_px[0], (rows - margin_px[1]) / size_px[1]
        )
        points, exists = quad.points(np.stack([x.ravel(), y.ravel()], axis=1))
        in_lens = world_from_lens.inverse() @ points
        camera = rig.lenses[lens]
        pixels, _ = camera.project(in_lens)
        # Behind the lens neighbours are on opposite sides of the picture: nothing is between them.
        near = np.linalg.norm(pixels - (camera.cx, camera.cy), axis=1) < BEYOND * camera.circle_px
        range_m = np.linalg.norm(in_lens, axis=1)
        values = np.stack([*(pixels - 0.5).T, range_m, near & exists], axis=1)
        coarse = values.reshape(len(rows), len(columns), 4)
        fine = _between(coarse, columns, rows, width, height)
        taken = (fine[..., 3] > 0.999) & _in_picture(fine[..., :2], camera) & ~seen
        if not taken.any():
            continue
        map_xy = np.ascontiguousarray(fine[..., :2])
        quick = cv2.convertMaps(map_xy, None, cv2.CV_16SC2)  # pyright: ignore
        tables.append(LensTable(int(lens), map_xy, quick, taken, fine[..., 2].copy()))  # pyright: ignore
        seen |= taken
    return SurfaceView(tuple(tables), seen)


def fineness(quad: Quad, rig: Rig, world_from_rig: Pose, lens: int) -> float:
    """Lens pixels along a side of a surface that is seen whole: the root of its area in a lens.

    What is seen slantwise, from behind or beyond the lens circle counts accordingly.
    """
    area, _ = _in_lens(quad, rig, world_from_rig, lens)
    return float(np.sqrt(area.sum()))


def native_size_px(quad: Quad, rig: Rig, world_from_rig: Pose) -> tuple[int, int]:
    """(width, height) at which the lens that sees a surface best gives a pixel for a pixel.

    The nearest part decides, so nothing that the lens shows is lost; at most `LARGEST_SIDE_PX`.
    """
    best = max(range(len(rig.lenses)), key=lambda i: fineness(quad, rig, world_from_rig, i))
    area, (across, down) = _in_lens(quad, rig, world_from_rig, best)
    if area.any():
        sides = [GRID * float(across.max()), GRID * float(down.max())]
    else:
        corners, _ = quad.points([[0, 0], [1, 0], [0, 1]])
        sides = [UNSEEN_PX_PER_M * float(np.linalg.norm(c - corners[0])) for c in corners[1:]]
    shrink = min(1.0, LARGEST_SIDE_PX / max(sides))
    width, height = (max(MIN_SIDE_PX, round(shrink * side)) for side in sides)
    return width, height


def _in_lens(
    quad: Quad, rig: Rig, world_from_rig: Pose, lens: int
) -> tuple[FloatArray, tuple[FloatArray, FloatArray]]:
    """(GRID, GRID) pixels that each cell of a surface covers, and its sides' lengths; 0 unseen."""
    world_from_lens = world_from_rig @ rig.rig_from_lens[lens]
    ticks = np.linspace(0.0, 1.0, GRID + 1)
    x, y = np.meshgrid(ticks, ticks)
    points, _ = quad.points(np.stack([x.ravel(), y.ravel()], axis=1))
    pixels, valid = rig.lenses[lens].project(world_from_lens.inverse() @ points)
    grid, valid = pixels.reshape(GRID + 1, GRID + 1, 2), valid.reshape(GRID + 1, GRID + 1)
    across, down = np.diff(grid, axis=1)[:-1], np.diff(grid, axis=0)[:, :-1]
    whole = valid[:-1, :-1] & valid[:-1, 1:] & valid[1:, :-1] & valid[1:, 1:]
    whole &= quad.faces(world_from_lens.translation)
    area = np.abs(across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0])
    lengths = (
        np.where(whole, np.linalg.norm(across, axis=2), 0.0),
        np.where(whole, np.linalg.norm(down, axis=2), 0.0),
    )
    return np.where(whole, area, 0.0), lengths


def _in_picture(map_xy: NDArray[np.float32], camera: Fisheye) -> BoolArray:
    """(H, W) whether places in `cv2.remap` coordinates are in the lens circle and the picture."""
    x, y = map_xy[..., 0], map_xy[..., 1]
    off_px = np.hypot(x + 0.5 - camera.cx, y + 0.5 - camera.cy)
    inside = (x >= -0.5) & (x <= camera.width_px - 0.5)
    inside &= (y >= -0.5) & (y <= camera.height_px - 0.5)
    # The pixels at the circle's rim are mixed with the dark around it.
    return inside & (off_px <= camera.circle_px - RIM_PX)


def _looked_up(image: NDArray[np.uint8], table: LensTable) -> NDArray[np.uint8]:
    drawn = cv2.remap(image, *table.quick_map, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(drawn, dtype=np.uint8)


def _lattice(pixels: int) -> FloatArray:
    """Places along a side that are projected, from the first pixel's centre to the last's."""
    return np.linspace(0.5, pixels - 0.5, max(2, 1 + -(-(pixels - 1) // LATTICE_PX)))


def _between(
    coarse: FloatArray, columns: FloatArray, rows: FloatArray, width: int, height: int
) -> NDArray[np.float32]:
    """(R, C, K) values at lattice places -> (height, width, K) at every pixel, bilinear."""
    along_x, along_y = _weights(columns, width), _weights(rows, height)
    wide = np.einsum("rck,xc->rxk", coarse, along_x, optimize=True)
    return np.einsum("rxk,yr->yxk", wide, along_y, optimize=True).astype(np.float32)


def _weights(places: FloatArray, pixels: int) -> FloatArray:
    """(pixels, len(places)) shares of the two nearest places in each pixel."""
    position = np.interp(np.arange(pixels) + 0.5, places, np.arange(len(places)))
    left = np.minimum(position.astype(int), len(places) - 2)
    weights = np.zeros((pixels, len(places)))
    rows = np.arange(pixels)
    weights[rows, left] = 1.0 - (position - left)
    weights[rows, left + 1] = position - left
    return weights
