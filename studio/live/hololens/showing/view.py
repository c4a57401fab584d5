"""View of a headset's wearer: its display over a picture of its camera."""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.hololens.display_list import Item, Label, Shape, Solid
from devices.hololens.values import PersonalVideoFrame
from scenes.cameras import Pinhole
from scenes.pose import Pose

Array = NDArray[np.float64]

ROUND = 24
"""Corners of a drawn circle."""

NEAR_M = 0.05
"""Distance before the camera below which nothing is drawn."""

LETTER_PX = 22.0
"""Height of a letter as OpenCV draws it at scale 1, pixels."""

MIN_SCALE = 0.35
"""Smallest letters that can be read, at that scale."""

FAR_PX = 20_000.0
"""Pixels beside the picture beyond which a shape is not drawn: OpenCV's fractions end there."""


def seen_by_wearer(frame: PersonalVideoFrame, items: Iterable[Item]) -> NDArray[np.uint8]:
    """Return (H, W, 3) uint8 RGB: a picture of the headset's camera with what its display shows.

    Nothing of the room hides it, and nearer items are over farther ones.
    """
    shown = np.ascontiguousarray(frame.image).copy()
    if frame.world_from_camera is None:
        return shown
    camera, camera_from_world = frame.camera, frame.world_from_camera.inverse()

    def nearer_later(item: Item) -> float:
        return -float(np.linalg.norm(camera_from_world @ item.world_from_item.translation))

    for item in sorted(items, key=nearer_later):
        if isinstance(item, Label):
            _write(shown, camera, camera_from_world=camera_from_world, item=item)
        else:
            _paint(shown, camera, camera_from_world=camera_from_world, item=item)
    return shown


def _paint(
    picture: NDArray[np.uint8], camera: Pinhole, *, camera_from_world: Pose, item: Solid
) -> None:
    """Fill the outline of a shape, all of which lies before the camera."""
    turned = item.world_from_item.rotation * np.asarray(item.size_m)
    points = _points(item.shape) @ turned.T + item.world_from_item.translation
    in_camera = camera_from_world @ points
    if float(in_camera[:, 2].min()) < NEAR_M:
        return
    pixels = in_camera[:, :2] / in_camera[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    if float(np.abs(pixels).max()) > FAR_PX:
        return
    hull = cv2.convexHull(np.round(16.0 * pixels).astype(np.int32))
    red, green, blue, opacity = item.colour
    colour = tuple(float(255.0 * value) for value in (red, green, blue))
    if opacity >= 0.99:
        cv2.fillConvexPoly(picture, hull, colour, cv2.LINE_AA, 4)
        return
    height, width = picture.shape[:2]
    # A pixel more on each side: its edge is smooth.
    low = np.clip(np.floor(pixels.min(axis=0)).astype(int) - 1, 0, (width, height))
    high = np.clip(np.ceil(pixels.max(axis=0)).astype(int) + 2, 0, (width, height))
    (left, top), (right, bottom) = low, high
    if left >= right or top >= bottom:
        return
    under = picture[top:bottom, left:right]
    over = under.copy()
    cv2.fillConvexPoly(over, hull - 16 * low.astype(np.int32), colour, cv2.LINE_AA, 4)
    picture[top:bottom, left:right] = cv2.addWeighted(over, opacity, under, 1.0 - opacity, 0.0)


def _write(
    picture: NDArray[np.uint8], camera: Pinhole, *, camera_from_world: Pose, item: Label
) -> None:
    """Write a text where its middle is, upright, as large as its distance makes it."""
    x, y, z = (camera_from_world @ item.world_from_item.translation).tolist()
    if z < NEAR_M:
        return
    scale = max(MIN_SCALE, camera.fy * item.height_m / z / LETTER_PX)
    size, _ = cv2.getTextSize(item.text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
    left = round(camera.fx * x / z + camera.cx - 0.5 * size[0])
    base = round(camera.fy * y / z + camera.cy + 0.5 * size[1])
    colour = tuple(float(255.0 * value) for value in item.colour[:3])
    place = (left, base)
    cv2.putText(
        picture, item.text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, (0, 0, 0), 3, cv2.LINE_AA
    )
    cv2.putText(picture, item.text, place, cv2.FONT_HERSHEY_SIMPLEX, scale, colour, 1, cv2.LINE_AA)


def _points(shape: Shape) -> Array:
    """Return points whose hull is a shape of 1 m: sphere, capsule, cylinder, cube, plane, quad."""
    angle = 2.0 * np.pi * np.arange(ROUND) / ROUND
    circle = 0.5 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    if shape in (Shape.SPHERE, Shape.CAPSULE):
        rings = [circle[:, order] for order in ((0, 1, 2), (0, 2, 1), (2, 0, 1))]
        slanted = circle[:, :2] @ np.array([[0.7071, 0.7071, 0.0], [0.0, 0.0, 1.0]])
        other = circle[:, :2] @ np.array([[0.7071, -0.7071, 0.0], [0.0, 0.0, 1.0]])
        return np.concatenate([*rings, slanted, other])
    if shape is Shape.CYLINDER:
        return np.concatenate([np.add(circle, (0.0, 0.0, z)) for z in (-0.5, 0.5)])
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    if shape is Shape.CUBE:
        return corners
    flat = corners.copy()
    flat[:, 2 if shape is Shape.PLANE else 1] = 0.0
    return flat
