"""Corners clicked in a lens picture, put onto the flat surface that the room has there.

The room's splats are drawn from the camera; what is drawn between the clicks gives a plane, and
the rays of the clicks meet it in the corners.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.cameras import Fisheye, Rig, pixel_centres
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]

MIN_PIXELS = 30
"""Pixels with a depth that a plane is laid through."""

MIN_ALPHA = 0.95
ROUNDS = 12
CUTOFF = 3.0
"""Tukey's constant: pixels farther off the plane, in standard deviations, say nothing."""

FINEST = 2e-3
"""Share of its distance to which a drawn surface is known at best."""

MIN_FACING = 0.05
"""Sine between a clicked ray and the plane below which they meet nowhere in particular."""


def corners_from_clicks(
    clicks_px: ArrayLike,
    lens: int,
    rig: Rig,
    world_from_rig: Pose,
    room: SplatCloud,
    renderer: Renderer,
) -> FloatArray:
    """(4, 3) corners in the world, metres, clockwise beginning with the first click.

    Args:
        clicks_px: (4, 2) pixels of a lens picture, around the surface, the top left one first;
            clicks that run the other way round are turned about.
        lens: in whose picture.
        rig: the 360° camera.
        world_from_rig: its pose, best the refined one.
        room: splats of what stands still.
        renderer: draws splats.

    Raises:
        ValueError: the clicks are no convex quad in the lens circle, the room has no surface
            there, or a click looks along the surface.
    """
    camera = rig.lenses[lens]
    clicks = _in_order(np.asarray(clicks_px, dtype=np.float64), camera)
    world_from_lens = world_from_rig @ rig.rig_from_lens[lens]
    window, inside = _window(camera, clicks)
    drawn = renderer.render(
        (PosedSplats(room, Pose.identity()),), window, world_from_lens, RenderOptions()
    )
    usable = inside & (drawn.alpha > MIN_ALPHA) & (drawn.depth > 0)
    if usable.sum() < MIN_PIXELS:
        raise ValueError(
            f"surface: the scan shows something on {usable.sum()} of {inside.sum()} pixels between "
            f"the clicks, wanted at least {MIN_PIXELS}: click a larger surface, or one nearer"
        )
    rays = window.unproject(pixel_centres(window)).reshape(*inside.shape, 3)[usable]
    plane = plane_through(rays, drawn.depth[usable].astype(np.float64))
    clicked = camera.unproject(clicks)
    nearness = clicked @ plane
    if (nearness < MIN_FACING * np.linalg.norm(plane)).any():
        raise ValueError(
            "surface: a click looks along the surface or past it; click corners that lie on it"
        )
    return world_from_lens @ (clicked / nearness[:, None])


def plane_through(rays: FloatArray, range_m: FloatArray) -> FloatArray:
    """The plane most points lie on, as p (3,) with p · x = 1, in the rays' axes.

    Along a ray r the plane is 1 / (p · r) away, so inverse distances are linear in p: least
    squares, with weights that first take the middle and then leave out what is not on the plane.

    Args:
        rays: (N, 3) unit vectors.
        range_m: (N,) distances along them, > 0.
    """
    inverse = 1.0 / range_m
    weights = np.ones(len(rays))
    plane = np.zeros(3)
    for round_ in range(ROUNDS):
        weighted = rays * weights[:, None]
        plane = np.linalg.lstsq(weighted.T @ rays, weighted.T @ inverse, rcond=None)[0]
        # As a share of the distance.
        off = np.abs(rays @ plane * range_m - 1.0)
        scale = max(1.48 * float(np.median(off)), FINEST)
        if round_ < ROUNDS // 2:
            weights = 1.0 / np.maximum(off, 0.1 * scale)
        else:
            weights = np.clip(1.0 - (off / (CUTOFF * scale)) ** 2, 0.0, None) ** 2
        weights *= range_m**2 / float(np.mean(range_m**2))
    return np.asarray(plane, dtype=np.float64)


def _in_order(clicks: FloatArray, camera: Fisheye) -> FloatArray:
    """The clicks, clockwise in the picture."""
    if clicks.shape != (4, 2) or not np.isfinite(clicks).all():
        raise ValueError(f"surface: clicks {clicks.tolist()}, wanted four (x, y) pixels")
    off_px = np.linalg.norm(clicks - (camera.cx, camera.cy), axis=1)
    if (off_px > camera.circle_px).any():
        raise ValueError(
            f"surface: a click is {off_px.max():.0f} px from the lens's centre, limit "
            f"{camera.circle_px:.0f} px: click inside the picture"
        )
    sides = np.roll(clicks, -1, axis=0) - clicks
    following = np.roll(sides, -1, axis=0)
    turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
    if (turns < 0).all():
        return clicks[[0, 3, 2, 1]]
    if not (turns > 0).all():
        raise ValueError(
            f"surface: clicks {clicks.tolist()} are no convex quad: click around the surface"
        )
    return clicks


def _window(camera: Fisheye, clicks: FloatArray) -> tuple[Fisheye, NDArray[np.bool_]]:
    """The part of the lens around the clicks, and which (H, W) of its pixels are between them."""
    low = np.maximum(np.floor(clicks.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(clicks.max(axis=0)).astype(int), (camera.width_px, camera.height_px))
    width, height = (max(1, int(side)) for side in high - low)
    window = replace(
        camera,
        width_px=width,
        height_px=height,
        cx=camera.cx - float(low[0]),
        cy=camera.cy - float(low[1]),
    )
    mask = np.zeros((height, width), np.uint8)
    inside: FloatArray = clicks - low - 0.5
    outline = np.round(inside).astype(np.int32)
    cv2.fillConvexPoly(mask, outline, 1)
    # The edge belongs to the frame or to the wall behind.
    side = max(1, min(width, height) // 12)
    inner = cv2.erode(mask, np.ones((2 * side + 1,) * 2, np.uint8), borderValue=0)
    return window, (inner if inner.any() else mask) > 0
