"""Templates: small pictures of an object by yaw and elevation, compared all at once.

A position is cut out of a lens picture, upright and at the object's size there, so that one
template serves every distance and every part of the lens.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import lens_of
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.splats import SplatCloud
from tracking.kernels import native
from tracking.window.filters import resized

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

YAWS = 24
ELEVATIONS_RAD = (0.2, 0.5, 0.8, 1.1)
"""From how far above the horizon an object is drawn; the nearest serves."""

SIDE_PX = 96
SMALL_PX = 32
"""Side of a picture as it is drawn, and as it is compared."""

DISTANCE = 4.2
"""Of the drawing camera, in radii of the object."""

FIELD_RAD = math.radians(30)
HALF_WIDTH = DISTANCE * math.tan(0.5 * FIELD_RAD)
"""Half a picture's width in radii of the object."""

MIN_SHOWN_PX = 12.0
COLOUR_SPREAD = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Templates:
    """Small pictures of an object.

    Attributes:
        alpha: (E, Y, N) float32 by elevation, yaw and pixel.
        colours: (E, Y, N, 3) float32, not premultiplied.
    """

    alpha: FloatArray
    colours: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Cuts:
    """Cuts of the live picture at some places, upright and as large as a template.

    Attributes:
        colours: (P, N, 3) float32 0..1.
        own: (P, N) float32 0..1, changed and of the object's colours.
        free: (P, N) float32 0..1, not covered by anything foreign.
        azimuth_rad: (P,) direction from each place to the lens, about up.
        elevation_rad: (P,) of the lens above each place.
    """

    colours: FloatArray
    own: FloatArray
    free: FloatArray
    azimuth_rad: Points
    elevation_rad: Points

    @staticmethod
    def joined(parts: Sequence[Cuts]) -> Cuts:
        """All places of some cuts, in order; at least one part."""
        return Cuts(
            np.concatenate([part.colours for part in parts]),
            np.concatenate([part.own for part in parts]),
            np.concatenate([part.free for part in parts]),
            np.concatenate([part.azimuth_rad for part in parts]),
            np.concatenate([part.elevation_rad for part in parts]),
        )

    def some(self, chosen: NDArray[np.intp]) -> Cuts:
        """The places with these indices."""
        return Cuts(
            self.colours[chosen],
            self.own[chosen],
            self.free[chosen],
            self.azimuth_rad[chosen],
            self.elevation_rad[chosen],
        )


def drawn_around(
    splats: SplatCloud,
    renderer: Renderer,
    centre_m: Points,
    radius_m: float,
    elevation_rad: float,
    *,
    side_px: int = SIDE_PX,
) -> FloatArray:
    """(Y, H, W, 4) RGBA pictures of an object at evenly spaced yaws, seen from +x."""
    camera = Pinhole.from_fov(side_px, side_px, FIELD_RAD)
    towards = np.array([math.cos(elevation_rad), 0.0, math.sin(elevation_rad)])
    world_from_camera = look_at(centre_m + DISTANCE * radius_m * towards, centre_m)
    options = RenderOptions(threads=1, antialias=True)
    pictures: list[FloatArray] = []
    for k in range(YAWS):
        posed = PosedSplats(splats, Pose.from_yaw(2 * math.pi * k / YAWS))
        drawn = renderer.render((posed,), camera, world_from_camera, options)
        pictures.append(np.concatenate([drawn.rgb, drawn.alpha[..., None]], axis=2))
    return np.stack(pictures)


def templates_of(pictures: list[FloatArray]) -> Templates:
    """From `drawn_around` at each of `ELEVATIONS_RAD`."""
    small: FloatArray = np.array(
        [[resized(picture, (SMALL_PX, SMALL_PX)) for picture in level] for level in pictures]
    ).reshape(len(pictures), YAWS, SMALL_PX * SMALL_PX, 4)
    alpha = np.ascontiguousarray(small[..., 3])
    colours = small[..., :3] / np.maximum(alpha, 0.05)[..., None]
    colours = np.ascontiguousarray(colours.astype(np.float32))
    return Templates(alpha, colours)


def cut_out(
    picture: FloatArray,
    camera: Fisheye,
    world_from_lens: Pose,
    centres: Points,
    radius_m: float,
) -> Cuts:
    """Cut places out of one lens.

    Args:
        picture: (H, W, 5) red, green, blue, own, foreground.
        camera: of the picture.
        world_from_lens: its pose.
        centres: (P, 3) world places of the object's centre.
        radius_m: of the object.
    """
    colours, own, free = native.cut_out(
        np.ascontiguousarray(picture),
        np.ascontiguousarray(centres),
        lens=lens_of(camera),
        world_from_lens=world_from_lens.matrix()[:3].ravel().tolist(),
        side=SMALL_PX,
        half_m=HALF_WIDTH * radius_m,
    )
    away = centres - world_from_lens.translation
    shape = (len(centres), SMALL_PX * SMALL_PX)
    return Cuts(
        colours.reshape(*shape, 3),
        own.reshape(shape),
        free.reshape(shape),
        np.arctan2(-away[:, 1], -away[:, 0]),
        np.arctan2(-away[:, 2], np.hypot(away[:, 0], away[:, 1])),
    )


def compare(cuts: Cuts, templates: Templates) -> tuple[FloatArray, FloatArray]:
    """(P, Y) overlap 0..1 and correlation -1..1 of colours of every place with every yaw.

    Yaw k is k · 360° / Y *relative to the direction from the place to the lens*. Products of
    matrices: five times as fast as a kernel that goes from template to template.
    """
    levels = np.abs(cuts.elevation_rad[:, None] - np.array(ELEVATIONS_RAD)).argmin(axis=1)
    overlap = np.zeros((len(levels), YAWS), np.float32)
    correlation = np.zeros_like(overlap)
    for level in np.unique(levels):
        here = np.flatnonzero(levels == level)
        some, alpha = cuts.some(here), templates.alpha[level]
        own = some.own * some.free
        overlap[here] = _overlap(some, own, alpha)
        correlation[here] = _correlation(some.colours, own, alpha, templates.colours[level])
    return overlap, correlation


def _overlap(cuts: Cuts, own: FloatArray, alpha: FloatArray) -> FloatArray:
    """(P, Y) shared part of a place's own pixels and a template, of what either covers."""
    shared = own @ alpha.T
    either = cuts.free @ alpha.T + own.sum(axis=1, keepdims=True) - shared
    return np.where(either > MIN_SHOWN_PX, shared / np.maximum(either, 1.0), 0.0)


def _correlation(
    live: FloatArray, weight: FloatArray, alpha: FloatArray, drawn: FloatArray
) -> FloatArray:
    """(P, Y) of colours about their means, where a place's weight meets a template's alpha."""
    total = np.maximum(weight @ alpha.T, 1e-3)
    both = live_power = drawn_power = np.zeros_like(total)
    for channel in range(3):
        seen, shown = live[..., channel], alpha * drawn[..., channel]
        first = (weight * seen) @ alpha.T / total
        second = weight @ shown.T / total
        both = both + (weight * seen) @ shown.T / total - first * second
        live_power = live_power + (weight * seen**2) @ alpha.T / total - first**2
        drawn_power = drawn_power + weight @ (shown * drawn[..., channel]).T / total - second**2
    power = np.maximum(live_power, COLOUR_SPREAD) * np.maximum(drawn_power, COLOUR_SPREAD)
    return np.where(total > MIN_SHOWN_PX, both / np.sqrt(power), 0.0).astype(np.float32)
