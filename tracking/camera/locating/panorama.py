"""Small panoramas of what a camera sees all around, without its light: live, and drawn.

A panorama has rows of equal elevation and columns of equal azimuth about the world's vertical, so a
turn of the camera about the vertical shifts its columns round.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from tracking.window.filters import blurred, box_blurred

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

COLUMNS = 96
"""Columns round the horizon, 3.75° each."""

STEP_RAD = 2.0 * math.pi / COLUMNS
"""Angle between columns and between rows, radians."""

LOWEST_RAD = math.radians(-56.25)
"""Elevation of the lowest row: below it a camera sees its own stand."""

ROWS = 36
"""Rows, up to 75°."""

BLUR_STEPS = 0.8
"""Smoothing of a panorama, steps: 3°, as far as a place 10 cm off shifts what is 2 m away."""

NEIGHBOURHOOD = 9
"""Side in steps of the square whose mean and contrast are taken out, odd: 34°, a picture on a wall
or a piece of furniture; exposure, and the light of a window across the room, are larger."""

MIN_CONTRAST = 0.02
"""Grey, 0..1, that is added to a neighbourhood's contrast: a blank wall's, whose shades are no
details, is about as large."""

MIN_COVERAGE = 0.5
"""Least alpha of a drawn pixel that counts: merged splats leave gaps in what is solid."""


@dataclass(frozen=True, slots=True, eq=False)
class Panorama:
    """Low-resolution panorama.

    Attributes:
        details: (ROWS, COLUMNS) grey against its neighbourhood, in its contrasts.
        weight: (ROWS, COLUMNS) solid angle, relative; 0 where nothing is seen.
    """

    details: FloatArray
    weight: FloatArray


@cache
def _directions() -> Points:
    """(ROWS, COLUMNS, 3) unit vectors; the azimuth grows from +X to +Y, the rows upwards."""
    elevation = LOWEST_RAD + STEP_RAD * np.arange(ROWS)
    azimuth = STEP_RAD * (np.arange(COLUMNS) + 0.5)
    flat = np.cos(elevation)[:, None]
    return np.stack(
        [
            flat * np.cos(azimuth),
            flat * np.sin(azimuth),
            np.broadcast_to(np.sin(elevation)[:, None], (ROWS, COLUMNS)),
        ],
        axis=2,
    )


def panorama_of(grey: FloatArray, usable: NDArray[np.bool_]) -> Panorama:
    """The details of a picture that is laid out as a panorama.

    Args:
        grey: (ROWS, COLUMNS) 0..1.
        usable: where something is seen.
    """
    weight = usable.astype(np.float32)
    side = NEIGHBOURHOOD // 2 + 3
    around, mask = _beyond(grey, side), _beyond(weight, side)
    inner = (slice(side, -side), slice(side, -side))
    share = np.maximum(blurred(mask, BLUR_STEPS), np.float32(1e-6))
    fine: FloatArray = blurred(mask * around, BLUR_STEPS) / share
    share: FloatArray = np.maximum(box_blurred(mask, NEIGHBOURHOOD), np.float32(1e-6))
    mean = box_blurred(mask * fine, NEIGHBOURHOOD) / share
    square = box_blurred(mask * fine * fine, NEIGHBOURHOOD) / share
    contrast = np.sqrt(np.maximum(square - mean * mean, 0.0)) + np.float32(MIN_CONTRAST)
    details = ((fine - mean) / contrast)[inner]
    solid = np.cos(LOWEST_RAD + STEP_RAD * np.arange(ROWS))[:, None]
    return Panorama(
        np.where(usable, details, 0).astype(np.float32), (weight * solid).astype(np.float32)
    )


def _beyond(picture: FloatArray, side: int) -> FloatArray:
    """A panorama with what lies beyond its border: round the horizon it goes on."""
    higher = np.concatenate([picture[:1]] * side + [picture] + [picture[-1:]] * side)
    return np.concatenate([higher[:, -side:], higher, higher[:, :side]], axis=1)


def live_panorama(frame: Frame, world_from_rig: Pose) -> Panorama:
    """Panorama of a camera's live pictures, turned like this; its position doesn't matter.

    Args:
        frame: pictures of all lenses.
        world_from_rig: only its rotation is used.
    """
    rays = _directions().reshape(-1, 3) @ world_from_rig.rotation
    grey = np.zeros(len(rays), np.float32)
    nearest = np.full(len(rays), -np.inf)
    for lens, rig_from_lens, image in zip(
        frame.rig.lenses, frame.rig.rig_from_lens, frame.images, strict=True
    ):
        # A panorama's pixel is many of a lens's: shrink first, so that none is skipped.
        scale = min(1.0, 1.5 / (STEP_RAD * lens.f_px))
        size = (round(scale * lens.width_px), round(scale * lens.height_px))
        small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        picture = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float32) / np.float32(255)
        in_lens = rays @ rig_from_lens.rotation
        pixels, valid = lens.resized(*size).project(in_lens)
        x, y = (pixels - 0.5).astype(np.float32).T
        seen = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).ravel()
        # Of two lenses that see a direction, the one that sees it nearer to its axis.
        better = valid & (in_lens[:, 2] > nearest)
        grey[better] = seen[better]
        nearest[better] = in_lens[better, 2]
    shape = (ROWS, COLUMNS)
    return panorama_of(grey.reshape(shape), np.isfinite(nearest).reshape(shape))


UP_F_PX = 40.0
"""px per radian of the drawing, by a lens that looks straight up: 2.6 times a panorama's."""

UP_ANGLE_RAD = math.radians(150.0)
"""Half its field of view: down to the lowest row."""


@cache
def _up_lens() -> tuple[Fisheye, FloatArray, FloatArray]:
    """A lens that looks along world Z, and where it sees each pixel of a panorama."""
    size = 2 * math.ceil(UP_F_PX * UP_ANGLE_RAD)
    lens = Fisheye(size, size, UP_F_PX, 0.5 * size, 0.5 * size, UP_ANGLE_RAD)
    pixels, _ = lens.project(_directions().reshape(-1, 3))
    x, y = (pixels - 0.5).astype(np.float32).T.reshape(2, ROWS, COLUMNS)
    return lens, x, y


def drawn_panorama(posed: tuple[PosedSplats, ...], renderer: Renderer, place: Points) -> Panorama:
    """Panorama of splats from a place.

    Args:
        posed: what is drawn.
        renderer: draws splats.
        place: (3,) world metres.
    """
    lens, x, y = _up_lens()
    rendering = renderer.render(posed, lens, Pose(np.eye(3), place), RenderOptions(sh_degree=0))
    colour = np.clip(rendering.rgb, np.float32(0), np.float32(1))
    covered = np.maximum(rendering.alpha, np.float32(1e-3))
    picture = cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY) / covered
    picture, alpha = (cv2.blur(a, (2, 2)) for a in (picture, rendering.alpha))
    grey, coverage = (cv2.remap(a, x, y, cv2.INTER_LINEAR) for a in (picture, alpha))
    return panorama_of(
        np.asarray(grey, np.float32), np.asarray(coverage, np.float32) > MIN_COVERAGE
    )
