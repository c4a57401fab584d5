"""Live surfaces drawn into pictures of the twin, behind whatever stands before them there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.quad import Quad, quad_of
from scenes.state import LiveSurface
from studio.view.overlay import FAINT, draw_path

Picture = NDArray[np.uint8]

NEARER_M = 0.08
"""Splats in front of a surface by less than this are the scan of the surface itself."""

OUTLINE_STEPS = 16


@dataclass(frozen=True, slots=True, eq=False)
class LivePicture:
    """A surface and the (H, W, 3) RGB picture that it shows now."""

    surface: LiveSurface
    picture: Picture


def draw_surface(
    drawn: Picture,
    depth: NDArray[np.float32],
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    live: LivePicture,
) -> None:
    """Paint what a live surface shows over a picture of the twin.

    Args:
        drawn: (H, W, 3) RGB, painted on.
        depth: (H, W) metres as the renderer gives it: z of a pinhole, range of a fisheye; 0 where
            nothing is.
        camera: what the twin was drawn through.
        world_from_camera: from where.
        live: the surface.
    """
    quad = quad_of(live.surface.seen_in_world)
    if not quad.faces(world_from_camera.translation):
        return
    outline = _outline(quad)
    part = _part(outline, camera, world_from_camera)
    if part is None:
        return
    rows, columns = part
    x, y = np.meshgrid(
        np.arange(columns.start, columns.stop) + 0.5, np.arange(rows.start, rows.stop) + 0.5
    )
    rays = camera.unproject(np.stack([x.ravel(), y.ravel()], axis=1))
    places, range_m = _met(quad, world_from_camera, rays)
    surface_depth = range_m if isinstance(camera, Fisheye) else range_m * rays[:, 2]
    before = depth[part].ravel()
    free = (before == 0) | (before > surface_depth - NEARER_M)
    shown = free & ((places >= 0) & (places <= 1)).all(axis=1)
    if not shown.any():
        return
    shape = x.shape
    colours = _looked_up(live.picture, places.reshape(*shape, 2), shown.reshape(shape))
    np.copyto(drawn[part], colours, where=shown.reshape(*shape, 1))
    draw_path(drawn, camera, world_from_camera, outline, colour=FAINT, width_px=1)


def _outline(quad: Quad) -> NDArray[np.float64]:
    """(N, 3) world points along the edge, closed."""
    steps = np.linspace(0.0, 1.0, OUTLINE_STEPS + 1)[:-1, None]
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    sides = [a + steps * (b - a) for a, b in pairwise(corners)]
    points, _ = quad.points(np.concatenate([*sides, corners[-1:]]))
    return points


def _part(
    outline: NDArray[np.float64], camera: Pinhole | Fisheye, world_from_camera: Pose
) -> tuple[slice, slice] | None:
    """Rows and columns that may show a surface; None if none do."""
    in_camera = world_from_camera.inverse() @ outline
    pixels, _ = camera.project(in_camera)
    behind = in_camera[:, 2] <= 0 if isinstance(camera, Pinhole) else np.zeros(len(pixels), bool)
    if behind.all():
        return None
    low, high = np.array([0, 0]), np.array([camera.width_px, camera.height_px])
    if not behind.any():
        low = np.maximum(low, np.floor(pixels.min(axis=0)).astype(int))
        high = np.minimum(high, np.ceil(pixels.max(axis=0)).astype(int))
    if (high <= low).any():
        return None
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def _met(
    quad: Quad, world_from_camera: Pose, rays: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Intersect (N, 3) unit rays and a quad's plane: (N, 2) places, NaN if none; (N,) ranges."""
    plane_from_camera = quad.world_from_plane.inverse() @ world_from_camera
    eye = plane_from_camera.translation
    directions = rays @ plane_from_camera.rotation.T
    with np.errstate(divide="ignore", invalid="ignore"):
        range_m = -eye[2] / directions[:, 2]
        points = eye[:2] + range_m[:, None] * directions[:, :2]
        places = quad.places(points)
    places[~(range_m > 0)] = np.nan
    return places, range_m


def _looked_up(
    picture: Picture, places: NDArray[np.float64], shown: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """(h, w, 3) colours of a picture at places 0..1 across it, averaged where it is finer."""
    height, width = picture.shape[:2]
    spanned = places[shown].max(axis=0) - places[shown].min(axis=0)
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    needed = (columns[-1] - columns[0] + 1, rows[-1] - rows[0] + 1)
    finer = np.sqrt(np.prod(spanned) * width * height / max(1.0, float(np.prod(needed))))
    if finer > 1.5:
        size = (max(1, round(width / finer)), max(1, round(height / finer)))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
        height, width = picture.shape[:2]
    at = np.where(shown[..., None], places, 0.0) * (width, height) - 0.5
    x, y = cv2.split(at.astype(np.float32))
    colours = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(colours, dtype=np.uint8)
