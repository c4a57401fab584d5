"""The details that a lens saw when the camera's pose was found, to see later whether it moved.

A marker does not show that a camera was bumped or that a stand sinks: the marker may have moved
along, jitter more than that, or be absent. Its pictures show it. Details are kept at two sizes: by
the small one a turn of degrees is found, by the large one hundredths of a degree.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye
from scenes.pose import Pose
from tracking.window.contour import sample
from tracking.window.filters import blurred, resized, slopes

WATCH_PX = (120, 480)
"""Widths in px of the compared pictures, the small one first. Of a lens of 200° a pixel is 1.7° and
0.42°: a turn of 3° moves the small picture's details, which are wider, by two of them."""

BLUR_PX = 1.5
"""Gaussian blur in px before the comparison."""

COARSE = 6
"""Ratio of the coarse to the fine blur; structure beyond it (shadows, lamps) is removed."""

CELL_PX = (4, 10)
"""Side in px of the cells at each size; the steepest pixel of each is used."""

DARK = 0.1
"""Grey 0..1 that is added before the logarithm. Under other exposure or light a logarithm's details
stay as they are; below a tenth of white the sensor's noise would be all that is left of them."""

MIN_STEEP = 0.01
"""Least gradient per px, of log grey, of a used pixel: about that of the noise after the blur."""


FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Details:
    """A lens's picture at one size.

    Attributes:
        camera: the lens at this size.
        rays: (N, 3) unit, lens frame.
        nearness: (N,) 1/m of what is seen there; 0 where it is unknown or far.
        values: (N,) log grey without coarse structure.
        by_twist: (N, 6) their derivatives by a twist of the rig in its axes: radians, metres.
        flow_by_twist: (N, 2, 6) likewise of their places, radians of the lens.
        sector: (N,) int, in which of `SECTORS` equal sectors around the lens's axis.
    """

    camera: Fisheye
    rays: Points
    nearness: Points
    values: FloatArray
    by_twist: Points
    flow_by_twist: Points
    sector: NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Watch:
    """A lens's picture at the pose it was calibrated at.

    Attributes:
        rig_from_lens: where it sits.
        sizes: its details, as in `WATCH_PX`.
    """

    rig_from_lens: Pose
    sizes: tuple[Details, ...]


SECTORS = 8
"""Sectors of a lens that are asked separately whether the camera moved."""


def begin_watch(
    image: NDArray[np.uint8], camera: Fisheye, rig_from_lens: Pose, range_m: FloatArray
) -> Watch:
    """Return what later pictures are compared with.

    Args:
        image: (H, W, 3) uint8 of the lens.
        camera: the lens.
        rig_from_lens: where it sits.
        range_m: (H, W) distance of what stands still; 0 where it is unknown.
    """
    sizes = zip(WATCH_PX, CELL_PX, strict=True)
    grey = _grey(image)
    return Watch(
        rig_from_lens,
        tuple(_details(grey, camera, rig_from_lens, range_m, w, cell) for w, cell in sizes),
    )


def pictured(image: NDArray[np.uint8]) -> tuple[FloatArray, ...]:
    """(H, W) details of a lens picture at every size of `WATCH_PX`."""
    grey = _grey(image)
    return tuple(_detail(grey, width) for width in WATCH_PX)


def residual(details: Details, rig_from_lens: Pose, twist: Points, detail: FloatArray) -> Points:
    """(N,) log grey now less that then, of a rig that moved by a twist.

    Args:
        details: those then.
        rig_from_lens: where the lens sits.
        twist: (6,) turn in radians and shift in metres, in the rig's axes then.
        detail: (H, W) details now, of the same size.
    """
    pixels, _ = details.camera.project(_moved(details.rays, details.nearness, rig_from_lens, twist))
    return sample(detail, pixels).astype(np.float64) - details.values


def _moved(rays: Points, nearness: Points, rig_from_lens: Pose, twist: Points) -> Points:
    """(N, 3) directions, in the lens's frame now, of what lay along rays before the rig moved."""
    there = nearness[:, None]
    in_rig = rays @ rig_from_lens.rotation.T + there * (rig_from_lens.translation - twist[3:])
    turn, _ = cv2.Rodrigues(twist[:3])
    return (in_rig @ turn - there * rig_from_lens.translation) @ rig_from_lens.rotation


def _details(
    grey: FloatArray,
    lens: Fisheye,
    rig_from_lens: Pose,
    range_m: FloatArray,
    width: int,
    cell_px: int,
) -> Details:
    detail = _detail(grey, width)
    height = len(detail)
    camera = lens.resized(width, height)
    gx, gy = slopes(detail)
    row, column = _steepest(camera, np.hypot(gx, gy), cell_px)
    rays = camera.unproject(np.stack([column + 0.5, row + 0.5], axis=1))
    rows, columns = ((k * n // m) for k, n, m in (
        (row, range_m.shape[0], height), (column, range_m.shape[1], width)
    ))  # fmt: skip
    there = range_m[rows, columns].astype(np.float64)
    nearness = np.where(there > 0, 1.0 / np.maximum(there, 0.1), 0.0)
    small, zero = 1e-4, np.zeros(6)
    before, _ = camera.project(_moved(rays, nearness, rig_from_lens, zero))
    flow = np.empty((len(rays), 2, 6))
    for axis in range(6):
        twist = zero.copy()
        twist[axis] = small
        after, _ = camera.project(_moved(rays, nearness, rig_from_lens, twist))
        flow[:, :, axis] = (after - before) / small
    slope = np.stack([gx[row, column], gy[row, column]], axis=1).astype(np.float64)
    angle = np.arctan2(row + 0.5 - camera.cy, column + 0.5 - camera.cx) / (2 * math.pi) + 0.5
    sector = np.minimum((angle * SECTORS).astype(np.intp), SECTORS - 1)
    by_twist = np.einsum("nia,ni->na", flow, slope)
    return Details(
        camera, rays, nearness, detail[row, column], by_twist, flow / camera.f_px, sector
    )


def _steepest(
    camera: Fisheye, steep: FloatArray, cell_px: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the steepest pixel of each cell that has one."""
    height, width = steep.shape
    y, x = np.mgrid[0:height, 0:width] + 0.5
    inside = np.hypot(x - camera.cx, y - camera.cy) < 0.95 * camera.circle_px
    rows, columns = height // cell_px, width // cell_px
    cells = np.where(inside, steep, 0)[: rows * cell_px, : columns * cell_px]
    cells = cells.reshape(rows, cell_px, columns, cell_px)
    cells = cells.swapaxes(1, 2).reshape(rows * columns, cell_px**2)
    best = cells.argmax(axis=1)
    kept = np.flatnonzero(cells[np.arange(len(best)), best] > MIN_STEEP)
    row = kept // columns * cell_px + best[kept] // cell_px
    column = kept % columns * cell_px + best[kept] % cell_px
    return row, column


def _grey(image: NDArray[np.uint8]) -> FloatArray:
    """(H, W) grey 0..1 at the largest size of `WATCH_PX`."""
    width = WATCH_PX[-1]
    size = (width, round(width * image.shape[0] / image.shape[1]))
    method = cv2.INTER_AREA if width < image.shape[1] else cv2.INTER_LINEAR
    small = cv2.resize(image, size, interpolation=method)
    return cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float32) / np.float32(255)


def _detail(grey: FloatArray, width: int) -> FloatArray:
    """(H, `width`) log grey without its finest and coarsest structure."""
    size = (width, round(width * grey.shape[0] / grey.shape[1]))
    picture = np.log((grey if width == grey.shape[1] else resized(grey, size)) + np.float32(DARK))
    fine = blurred(picture, BLUR_PX)
    coarse = blurred(resized(fine, (width // 4, size[1] // 4)), COARSE * BLUR_PX / 4)
    return fine - resized(coarse, size)
