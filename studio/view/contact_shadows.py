"""Soft shadows that movable objects cast on what they stand on, wherever that is.

A scan's splats carry the light of the day they were filmed, and none of an object that is put
elsewhere: without a shadow of its own it seems to float. What an object hides of the light from
above is found once from its splats, as a map around its base, and laid on the surface that a
picture's depth shows there; in the air nothing is that near to its base, and nothing is darkened.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole
from scenes.pose import Pose, rotation_from_quaternion
from scenes.splats import SH_C0, SplatCloud

SPLAT_CELLS, OVERLAP, FAINT = 4, 0.6, 0.02
"""Of a shadow as splats: cells between two, their standard deviation in that distance, and what is
too faint to be drawn."""

RISE_M, FLAT_M = 0.012, 0.002
"""They lie so far over the base, before a floor's splats and behind a book's, and are so flat."""

FloatArray = NDArray[np.float64]
Part = tuple[slice, slice]
"""Rows and columns of a picture."""
Region = tuple[int, int, int, int]
"""Left, top, width and height in pixels."""

CELLS = 96
"""Of a map's side."""

DIRECTIONS = 32
"""From which light comes, spread over the upper hemisphere."""

DARKEST, CONTRAST = 0.7, 2.2
"""Share of light that is taken where no direction is free, as walls and floor send some back; and
how much more than that of the free directions is taken, chosen by eye: rooms are not lit evenly,
and most light comes from where a seat hides it."""

SOLID = 0.3
"""Opacity from which a splat hides light."""

BASE_SHARE = 0.01
"""Share of an object's splats below its base: a scan's stray ones."""

SPREAD, SPREAD_POINTS = 1.2, 5
"""How far over a splat it is solid, in its standard deviations, and points across it."""

HIGHEST_M = 1.2
"""Height above the base from which no shadow is seen."""

MARGIN_M, MARGIN_SHARE = 0.03, 0.35
"""Around an object's outline, and more by this share of its height: so far its shadow reaches."""

ON_M, OVER_M, UNDER_M = 0.015, 0.035, 0.06
"""A surface up to the first above or below the base is in contact; beyond the second above it, or
the third below it, it is another one."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactShadow:
    """The light that an object takes around its base.

    Attributes:
        dark: (CELLS, CELLS) float32, 0..1 of the light that is taken; row is y, column is x, 0 at
            the border.
        low_xy: (2,) outer corner of cell (0, 0) in the object's frame without its heading, metres.
        cell_m: side of a cell.
        base_m: height of the base over the object's origin.
    """

    dark: NDArray[np.float32]
    low_xy: FloatArray
    cell_m: float
    base_m: float


def contact_shadow(splats: SplatCloud, rotation: FloatArray | None = None) -> ContactShadow | None:
    """The shadow of an object around its base; None of one without a solid splat.

    Args:
        splats: of the object, in its frame.
        rotation: (3, 3) how it lies; None stands upright as its frame does.
    """
    solid = splats.select(splats.opacities > SOLID)
    if len(solid) == 0:
        return None
    upright = np.eye(3) if rotation is None else rotation
    base = float(np.quantile(solid.means.astype(np.float64) @ upright[2], BASE_SHARE))
    points = _spread(solid) @ upright.T
    above = np.clip(points[:, 2] - base, 0.0, None)
    points, above = points[above < HIGHEST_M], above[above < HIGHEST_M]
    margin = MARGIN_M + MARGIN_SHARE * float(above.max())
    low, high = points[:, :2].min(axis=0) - margin, points[:, :2].max(axis=0) + margin
    cell = float((high - low).max()) / CELLS
    low = 0.5 * (low + high) - 0.5 * CELLS * cell
    hidden = np.zeros((CELLS, CELLS), np.float32)
    for slope in _slopes():
        hidden += _outline((points[:, :2] - above[:, None] * slope - low) / cell)
    open_share = 1.0 - cv2.GaussianBlur(hidden / DIRECTIONS, (0, 0), 1.2)
    dark = DARKEST * (1.0 - np.clip(open_share, 0.0, 1.0) ** CONTRAST)
    return ContactShadow((dark * _fade()).astype(np.float32), low, cell, base)


def _outline(cells: FloatArray) -> NDArray[np.float32]:
    """(CELLS, CELLS) 1 where there are points, and in gaps of a cell between them."""
    columns, rows = np.floor(cells).T.astype(np.intp)
    inside = (rows >= 0) & (columns >= 0) & (rows < CELLS) & (columns < CELLS)
    found = np.zeros((CELLS, CELLS), np.float32)
    found[rows[inside], columns[inside]] = 1.0
    closed = cv2.morphologyEx(found, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    return np.asarray(closed, np.float32)


def shadow_splats(shadow: ContactShadow) -> SplatCloud | None:
    """A shadow as flat black splats over the base, for viewers without a picture's depth.

    They are in the object's frame without its heading; None of a shadow too faint to be seen.
    """
    step_m = SPLAT_CELLS * shadow.cell_m
    side = CELLS // SPLAT_CELLS
    dark = cv2.resize(shadow.dark, (side, side), interpolation=cv2.INTER_AREA)
    rows, columns = np.nonzero(dark > FAINT)
    if len(rows) == 0:
        return None
    means = np.empty((len(rows), 3), np.float32)
    means[:, 0] = shadow.low_xy[0] + (columns + 0.5) * step_m
    means[:, 1] = shadow.low_xy[1] + (rows + 0.5) * step_m
    means[:, 2] = shadow.base_m + RISE_M
    wide = OVERLAP * step_m
    # So many of them cover a point that together they take what the map says.
    opacities = 1.0 - (1.0 - dark[rows, columns]) ** (1.0 / (2.0 * math.pi * OVERLAP**2))
    return SplatCloud(
        means=means,
        scales=np.tile(np.array([wide, wide, FLAT_M], np.float32), (len(rows), 1)),
        rotations=np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (len(rows), 1)),
        opacities=opacities.astype(np.float32),
        sh=np.full((len(rows), 1, 3), -0.5 / SH_C0, np.float32),
    )


def _spread(splats: SplatCloud) -> FloatArray:
    """(N, 3) points all over splats: what is flat and large hides light beside its middle, too."""
    axes = rotation_from_quaternion(splats.rotations) * splats.scales[:, None, :]
    widest = np.argsort(-splats.scales, axis=1)[:, None, :2]
    one, other = np.moveaxis(np.take_along_axis(axes, widest, axis=2), 2, 0)
    steps = np.linspace(-SPREAD, SPREAD, SPREAD_POINTS)
    return np.concatenate([splats.means + i * one + j * other for i in steps for j in steps])


def draw_contact_shadows(
    picture: NDArray[np.uint8],
    depth: NDArray[np.float32],
    camera: Pinhole,
    world_from_camera: Pose,
    shadows: Iterable[tuple[ContactShadow, Pose]],
    *,
    bodies: Callable[[Region], NDArray[np.float32]],
) -> None:
    """Darken what objects stand on.

    Args:
        picture: (H, W, 3) RGB, painted on.
        depth: (H, W) metres along z, 0 where nothing is.
        camera: of the picture.
        world_from_camera: from where.
        shadows: with the pose `world_from_object` of each; only place and heading count.
        bodies: gives (H, W) how much of each pixel within a region objects cover, 0..1: what
            stands there is not darkened.
    """
    laid: list[tuple[Part, NDArray[np.float32]]] = []
    for shadow, pose in shadows:
        part = _seen_part(shadow, pose, camera, world_from_camera)
        if part is not None:
            dark = _taken(shadow, pose, depth[part], part, camera, world_from_camera)
            if dark is not None:
                laid.append((part, dark))
    if not laid:
        return
    covered = bodies(_around([part for part, _ in laid]))
    for part, dark in laid:
        light = 1.0 - dark * (1.0 - covered[part])
        picture[part] = (picture[part] * light[..., None] + 0.5).astype(np.uint8)


def _around(parts: list[Part]) -> Region:
    """The smallest region that holds parts of a picture."""
    top, left = (min(part[axis].start for part in parts) for axis in (0, 1))
    bottom, right = (max(part[axis].stop for part in parts) for axis in (0, 1))
    return left, top, right - left, bottom - top


def _taken(
    shadow: ContactShadow,
    pose: Pose,
    depth: NDArray[np.float32],
    part: Part,
    camera: Pinhole,
    world_from_camera: Pose,
) -> NDArray[np.float32] | None:
    """(h, w) share of light that is taken in a part of a picture; None if none is."""
    rows, columns = part
    across = (
        np.arange(columns.start, columns.stop, dtype=np.float32) + 0.5 - camera.cx
    ) / camera.fx
    down = (np.arange(rows.start, rows.stop, dtype=np.float32) + 0.5 - camera.cy) / camera.fy
    heading = _heading(pose.rotation)
    turn = (heading.T @ world_from_camera.rotation).astype(np.float32)
    place = (heading.T @ (world_from_camera.translation - pose.translation)).astype(np.float32)

    def along(axis: int) -> NDArray[np.float32]:
        ray = turn[axis, 0] * across[None, :] + (turn[axis, 1] * down + turn[axis, 2])[:, None]
        return place[axis] + ray * depth

    over = along(2) - np.float32(shadow.base_m)
    touches = np.clip((OVER_M - over) / (OVER_M - ON_M), 0.0, 1.0)
    touches *= np.clip((UNDER_M + over) / (UNDER_M - ON_M), 0.0, 1.0) * (depth > 0)
    if not touches.any():
        return None
    # At an outline, a picture's depth lies between what is before and behind: that is no light gap.
    touches = cv2.blur(cv2.dilate(touches, np.ones((3, 3), np.uint8)), (3, 3))
    x, y = ((along(axis) - shadow.low_xy[axis]) / shadow.cell_m - 0.5 for axis in (0, 1))
    dark = cv2.remap(
        shadow.dark,
        x.astype(np.float32),
        y.astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=0,
    )
    return (touches * dark).astype(np.float32)


def _seen_part(
    shadow: ContactShadow, pose: Pose, camera: Pinhole, world_from_camera: Pose
) -> Part | None:
    """The rows and columns of a picture in which a shadow may be; None if it is not in sight."""
    far = CELLS * shadow.cell_m
    corners = np.array(
        [
            [shadow.low_xy[0] + i * far, shadow.low_xy[1] + j * far, shadow.base_m + k * UNDER_M]
            for i in (0, 1)
            for j in (0, 1)
            for k in (-1, 1)
        ]
    )
    in_world = corners @ _heading(pose.rotation).T + pose.translation
    seen = world_from_camera.inverse() @ in_world
    ahead = seen[:, 2] > 1e-3
    if not ahead.any():
        return None
    low, high = np.zeros(2), np.array([camera.width_px, camera.height_px], dtype=float)
    if ahead.all():
        pixels = seen[:, :2] / seen[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
        low = np.maximum(low, np.floor(pixels.min(axis=0)))
        high = np.minimum(high, np.ceil(pixels.max(axis=0)))
    if (low >= high).any():
        return None
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def tilt_of(rotation: FloatArray) -> FloatArray:
    """(3, 3) how an object leans, without its heading."""
    return _heading(rotation).T @ rotation


def _heading(rotation: FloatArray) -> FloatArray:
    """(3, 3) the turn about the vertical in a rotation."""
    yaw = math.atan2(rotation[1, 0] - rotation[0, 1], rotation[0, 0] + rotation[1, 1])
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _slopes() -> list[FloatArray]:
    """How far sideways (x, y) light comes per metre down, denser upwards as the cosine asks."""
    found: list[FloatArray] = []
    for k in range(DIRECTIONS):
        radius = math.sqrt((k + 0.5) / DIRECTIONS)
        turn = k * math.pi * (3.0 - math.sqrt(5.0))
        slope = radius / max(math.sqrt(1.0 - radius**2), 0.25)
        found.append(slope * np.array([math.cos(turn), math.sin(turn)]))
    return found


def _fade() -> FloatArray:
    """1 inside a map, falling smoothly to 0 at its border."""
    t = (np.arange(CELLS) + 0.5) / CELLS
    edge = np.clip(6.0 * np.minimum(t, 1.0 - t), 0.0, 1.0)
    smooth = edge * edge * (3.0 - 2.0 * edge)
    return np.outer(smooth, smooth)
