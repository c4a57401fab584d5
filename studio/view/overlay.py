"""Lines and words drawn over pictures of the room: outlines, people, captions."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

from scenes.cameras import Camera
from scenes.pose import Pose
from scenes.state import Annotation, Avatar, TrackState

Colour = tuple[int, int, int]
Picture = NDArray[np.uint8]

TRUTH: Colour = (255, 255, 255)
REMOTE: Colour = (86, 180, 233)
LOCAL: Colour = (204, 121, 167)
INK: Colour = (232, 234, 237)
FAINT: Colour = (154, 160, 170)
STATE_COLOURS: dict[TrackState, Colour] = {
    TrackState.STATIC: (140, 146, 156),
    TrackState.TRACKED: (0, 176, 128),
    TrackState.OCCLUDED: (240, 170, 20),
    TrackState.LOST: (222, 90, 20),
}
"""Colour of each state, sRGB 0..255, chosen without red against green for colour-blind eyes. The
state's word stands beside its colour everywhere."""

STATE_WORDS: dict[TrackState, str] = {
    TrackState.STATIC: "at rest",
    TrackState.TRACKED: "tracked",
    TrackState.OCCLUDED: "hidden",
    TrackState.LOST: "lost",
}
SHIFT = 4
"""Bits below the pixel in OpenCV's line drawing."""


def draw_path(
    picture: Picture,
    camera: Camera,
    world_from_camera: Pose,
    points_in_world: ArrayLike,
    *,
    colour: Colour,
    width_px: int = 2,
    dashed: bool = False,
) -> None:
    """A polyline (N, 3) in world metres; segments with an end out of sight are left out."""
    points = np.atleast_2d(np.asarray(points_in_world, dtype=np.float64))
    pixels, seen = camera.project(world_from_camera.inverse() @ points)
    corners = np.round((pixels - 0.5) * (1 << SHIFT)).astype(int)
    for i in range(len(points) - 1):
        if seen[i] and seen[i + 1] and not (dashed and i % 2):
            start, end = tuple(corners[i].tolist()), tuple(corners[i + 1].tolist())
            cv2.line(picture, start, end, colour, width_px, cv2.LINE_AA, SHIFT)


def draw_footprint(
    picture: Picture,
    camera: Camera,
    world_from_camera: Pose,
    world_from_object: Pose,
    box_m: tuple[float, float, float],
    *,
    colour: Colour,
    width_px: int = 2,
    dashed: bool = False,
) -> None:
    """The outline of an object on its support plane, with a tick towards its front (+x)."""
    x, y = 0.5 * box_m[0], 0.5 * box_m[1]
    corners = np.array([[x, y, 0.0], [-x, y, 0.0], [-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0]])
    steps = np.linspace(0.0, 1.0, 9)[:-1, None]
    sides = [a + steps * (b - a) for a, b in pairwise(corners)]
    outline = np.concatenate([*sides, corners[-1:]])
    draw_path(
        picture,
        camera,
        world_from_camera,
        world_from_object @ outline,
        colour=colour,
        width_px=width_px,
        dashed=dashed,
    )
    tick = np.array([[x, 0.0, 0.0], [1.35 * x, 0.0, 0.0]])
    draw_path(
        picture,
        camera,
        world_from_camera,
        world_from_object @ tick,
        colour=colour,
        width_px=width_px,
    )


def draw_avatar(picture: Picture, camera: Camera, world_from_camera: Pose, avatar: Avatar) -> None:
    """A person: disc for the head, wedge for where they look, hands, pointing ray, name."""
    colour = REMOTE if avatar.role == "remote" else LOCAL
    head = avatar.world_from_head.translation
    gaze = avatar.world_from_head.rotation[:, 2]
    side = avatar.world_from_head.rotation[:, 0]
    wedge = [head, head + 0.45 * gaze + 0.22 * side, head + 0.45 * gaze - 0.22 * side, head]
    draw_path(picture, camera, world_from_camera, wedge, colour=colour)
    if avatar.ray is not None:
        draw_path(picture, camera, world_from_camera, avatar.ray, colour=colour)
    dots = [(head, 7), *((joint, 3) for hand in avatar.hands for joint in hand[:1])]
    for point, radius in dots:
        pixels, seen = camera.project(world_from_camera.inverse() @ np.atleast_2d(point))
        if seen[0]:
            x, y = np.round(pixels[0]).astype(int).tolist()
            cv2.circle(picture, (x, y), radius, colour, -1, cv2.LINE_AA)
            cv2.circle(picture, (x, y), radius, (20, 22, 26), 1, cv2.LINE_AA)


def draw_line(picture: Picture, camera: Camera, world_from_camera: Pose, line: Annotation) -> None:
    """Draw somebody's line in its own colour, as a curve: lenses bend straight lines."""
    points = line.points_in_world
    steps = np.linspace(0.0, 1.0, 9)[:-1, None]
    curve = np.concatenate([*(a + steps * (b - a) for a, b in pairwise(points)), points[-1:]])
    red, green, blue = (round(255 * value) for value in line.colour)
    draw_path(picture, camera, world_from_camera, curve, colour=(red, green, blue))


def write_words(
    picture: Picture, words: Sequence[tuple[tuple[float, float], str, Colour, int, bool]]
) -> Picture:
    """Text over a picture.

    Args:
        picture: (H, W, 3) RGB.
        words: position of the left end of the baseline in pixels, text, colour, size in pixels,
            bold or not.

    Returns:
        A new picture.
    """
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    for position, text, colour, size_px, bold in words:
        draw.text(position, text, fill=colour, font=_font(size_px, bold), anchor="ls")
    return np.asarray(image)


def width_of(text: str, size_px: int, *, bold: bool = False) -> float:
    """Width of a line of text in pixels."""
    return _font(size_px, bold).getlength(text)


@cache  # fonts are constants of the installation: the same arguments always give the same font
def _font(size_px: int, bold: bool) -> ImageFont.FreeTypeFont:
    import matplotlib as mpl

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts" / "ttf" / name), size_px)
