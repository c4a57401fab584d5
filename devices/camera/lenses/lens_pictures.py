"""A stream's picture to upright lens pictures, converting no pixel to RGB that is not used.

Turning, shrinking and resampling are done on the planes Y, U and V, of which two are quarters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.camera.lenses.layout import Arrangement, Box, LensLayout
from devices.camera.stream_decoder import Plane, StreamPicture
from devices.session_info import LiveStream
from scenes.cameras import Fisheye, Rig, pixel_centres
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose

LensPicture = NDArray[np.uint8]

LensPictures = tuple[LensPicture, ...]

USUAL_LENS_DISTANCE_M = 0.03
"""Metres between the two lenses of a 360° camera along their axis where nobody measured them: X3
and X4 are 33 and 37 mm thick at the lenses, whose pupils lie some millimetres inside. What the back
lens sees is off by what this is off."""

DEFAULT_FOV_DEG = 200.0
"""Field of view, degrees, of a lens whose calibration is not known: that of the X3's and X4's."""

TURN_BACK = {
    1: cv2.ROTATE_90_COUNTERCLOCKWISE,
    2: cv2.ROTATE_180,
    3: cv2.ROTATE_90_CLOCKWISE,
}
"""Rotation that makes a picture upright again that is turned by so many quarters clockwise."""

MAX_MAPS = 4
"""Resampling maps that are kept, each of 8 bytes a pixel: two sizes with two turns."""


def stream_images(pictures: Sequence[StreamPicture], stream: LiveStream) -> LensPictures:
    """Upright lens pictures of what a live camera showed, as `Frame.images` holds them.

    Args:
        pictures: one for all lenses, or one a track.
        stream: how they hold the lenses; of several tracks, how each of them does.
    """
    size = stream.lens_size_px
    made = [lens_pictures(picture, stream.layout, lens_size_px=size) for picture in pictures]
    return tuple(image for images in made for image in images)


def lens_pictures(
    picture: StreamPicture,
    layout: LensLayout,
    *,
    lens_size_px: int | None = None,
    fov_deg: float = DEFAULT_FOV_DEG,
) -> tuple[LensPicture, ...]:
    """Upright RGB pictures of the lenses, the front one first, as `Frame.images` holds them.

    Args:
        picture: as it was decoded.
        layout: how it holds the lenses.
        lens_size_px: side of each lens picture, even; None for as many pixels as the stream has.
        fov_deg: of the two fisheyes that are made of an equirectangular picture.

    Returns:
        One (S, S, 3) uint8 a lens, read-only.

    Raises:
        ValueError: `lens_size_px` is odd or below 16.
    """
    size = lens_size_px or own_lens_size_px(picture, layout)
    if size < 16 or size % 2:
        raise ValueError(f"lens picture {size} px: wanted an even size of at least 16 px")
    if layout.arrangement is Arrangement.EQUIRECTANGULAR:
        images = _from_sphere(picture, layout.turns[0], size, fov_deg)
    else:
        boxes = layout.boxes(picture.width_px, picture.height_px)
        images = tuple(
            _upright(picture, box, turn, size)
            for box, turn in zip(boxes, layout.turns, strict=True)
        )
    for image in images:
        image.setflags(write=False)
    return images


def own_lens_size_px(picture: StreamPicture, layout: LensLayout) -> int:
    """Side of a lens picture with as many pixels as the stream has for it."""
    if layout.arrangement is Arrangement.EQUIRECTANGULAR:
        return min(picture.width_px, picture.height_px) & ~1
    return layout.boxes(picture.width_px, picture.height_px)[0].width


def assumed_rig(
    layout: LensLayout,
    lens_size_px: int,
    *,
    fov_deg: float = DEFAULT_FOV_DEG,
    lens_distance_m: float = USUAL_LENS_DISTANCE_M,
) -> Rig:
    """The lenses of a camera that is not calibrated: equidistant, back to back.

    Of an equirectangular picture it is exact: those fisheyes are made here, at one place.
    """
    lens = Fisheye.from_fov(lens_size_px, math.radians(fov_deg))
    if layout.arrangement is Arrangement.ONE_LENS:
        return Rig((lens,), (Pose.identity(),))
    is_sphere = layout.arrangement is Arrangement.EQUIRECTANGULAR
    apart_m = 0.0 if is_sphere else lens_distance_m
    back = Pose(FRONT_FROM_BACK_LENS.rotation, np.array([0.0, 0.0, -apart_m]))
    return Rig((lens, lens), (Pose.identity(), back))


def luma_of_sphere(
    luma: Plane, turn: int, size_px: int, *, fov_deg: float = DEFAULT_FOV_DEG
) -> tuple[Plane, Plane]:
    """The Y planes (S, S) of the two fisheyes of an equirectangular Y plane, black outside."""
    shape = (luma.shape[0], luma.shape[1])
    front, back = (
        _remap(luma, _sphere_maps(shape, turn, size_px, fov_deg, is_back), 0)
        for is_back in (False, True)
    )
    return front, back


def _upright(picture: StreamPicture, box: Box, turn: int, size: int) -> LensPicture:
    half = Box(box.x0 // 2, box.y0 // 2, box.width // 2, box.height // 2)
    return picture.to_rgb(
        _plane(picture.y, box, turn, size),
        _plane(picture.u, half, turn, size // 2),
        _plane(picture.v, half, turn, size // 2),
    )


def _plane(plane: Plane, box: Box, turn: int, size: int) -> Plane:
    part = plane[box.y0 : box.y0 + box.height, box.x0 : box.x0 + box.width]
    if part.shape != (size, size):
        grows = size > box.width
        how = cv2.INTER_LINEAR if grows else cv2.INTER_AREA
        part = np.asarray(cv2.resize(part, (size, size), interpolation=how), np.uint8)
    if turn:
        part = np.asarray(cv2.rotate(part, TURN_BACK[turn]), np.uint8)
    return part


def _from_sphere(
    picture: StreamPicture, turn: int, size: int, fov_deg: float
) -> tuple[LensPicture, ...]:
    shape = (picture.height_px, picture.width_px)
    half = (picture.u.shape[0], picture.u.shape[1])
    images: list[LensPicture] = []
    for is_back in (False, True):
        fine = _sphere_maps(shape, turn, size, fov_deg, is_back)
        coarse = _sphere_maps(half, turn, size // 2, fov_deg, is_back)
        images.append(
            picture.to_rgb(
                _remap(picture.y, fine, 0 if picture.is_full_range else 16),
                _remap(picture.u, coarse, 128),
                _remap(picture.v, coarse, 128),
            )
        )
    return tuple(images)


_Maps = tuple[NDArray[np.int16], NDArray[np.uint16], NDArray[np.uint8]]


@lru_cache(maxsize=4 * MAX_MAPS)
def _sphere_maps(
    shape: tuple[int, int], turn: int, size: int, fov_deg: float, is_back: bool
) -> _Maps:
    """Maps of a fisheye's pixels in an equirectangular plane, and its circle: 255 inside, else 0.

    The plane's middle is the front lens's axis; right of it is to the right of that.
    """
    lens = Fisheye.from_fov(size, math.radians(fov_deg))
    rays = lens.unproject(pixel_centres(lens))
    inside = np.arccos(np.clip(rays[:, 2], -1.0, 1.0)) <= lens.max_angle
    if is_back:
        rays = rays @ FRONT_FROM_BACK_LENS.rotation.T
    right = np.arctan2(rays[:, 0], rays[:, 2]) / (2 * math.pi)
    down = np.arcsin(np.clip(rays[:, 1], -1.0, 1.0)) / math.pi
    # A quarter turn clockwise takes what is right to the bottom, and what is down to the left.
    for _ in range(turn):
        right, down = -down, right
    x = (right + 0.5) * shape[1] - 0.5
    y = (down + 0.5) * shape[0] - 0.5
    # Across the seam the picture goes on at its other end, across a pole it is the pole's own row.
    if turn % 2:
        x = np.clip(x, 0.0, shape[1] - 1.0)
    else:
        y = np.clip(y, 0.0, shape[0] - 1.0)
    grid = (size, size)
    first, second = cv2.convertMaps(
        x.reshape(grid).astype(np.float32), y.reshape(grid).astype(np.float32), cv2.CV_16SC2
    )
    return (
        np.asarray(first, np.int16),
        np.asarray(second, np.uint16),
        np.asarray(255 * inside.reshape(grid), np.uint8),
    )


def _remap(plane: Plane, maps: _Maps, black: int) -> Plane:
    moved = cv2.remap(
        plane, maps[0], maps[1], interpolation=cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP
    )
    plane = np.asarray(moved, np.uint8)
    np.bitwise_and(plane, maps[2], out=plane)
    if black:
        np.bitwise_or(plane, ~maps[2] & np.uint8(black), out=plane)
    return plane
