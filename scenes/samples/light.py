# pyright: standard
"""Puts the room's light into its pictures. Which light falls where was traced once and is kept.

Light is known at a grid of texels on every surface; `trace_light` finds it, `light_file` keeps it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.mesh import BoxPart
from scenes.quad import QrCode
from scenes.samples.shapes import Picture, Surface, cells

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]

WALL_TEXEL_M = 0.028
"""Side of a texel of light on a large surface, metres."""
SMALL_TEXEL_M = 0.011
"""Side of a texel of light on furniture, metres."""
SMALL_AREA_M2 = 1.5
"""Surfaces below this area get the finer texels: they are furniture."""
SHOULDER = 0.75
"""Brightness above which highlights are compressed instead of clipped."""


@dataclass(frozen=True, slots=True, eq=False)
class AreaLight:
    """A rectangle that shines to the side of `u × v`.

    Attributes:
        corner: (3,) metres.
        u: (3,) one edge, metres.
        v: (3,) the other edge, metres.
        radiance: linear RGB.
    """

    corner: FloatArray
    u: FloatArray
    v: FloatArray
    radiance: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class UnlitRoom:
    """Fixed part of a room, before there is light.

    Attributes:
        name: of the room.
        surfaces: everything that blocks, bounces or receives light.
        solids: boxes that stop objects.
        codes: printed codes.
        lights: what shines.
        reference: (3,) point in metres; exposure and white balance are set for level ground there.
        level: light at `reference` after exposure, as a factor on sRGB values, 0..1.
    """

    name: str
    surfaces: tuple[Surface, ...]
    solids: tuple[BoxPart, ...]
    codes: tuple[QrCode, ...]
    lights: tuple[AreaLight, ...]
    reference: FloatArray
    level: float


@dataclass(frozen=True, slots=True, eq=False)
class Texels:
    """Small patches that are lit, over all surfaces in order.

    Attributes:
        centres: (N, 3) metres.
        across: (N, 3) from one edge of the patch to the other along the surface's columns, metres.
        down: (N, 3) the same along its rows.
        normals: (N, 3) unit.
        shapes: (rows, columns) of every surface.
    """

    centres: FloatArray
    across: FloatArray
    down: FloatArray
    normals: FloatArray
    shapes: tuple[tuple[int, int], ...]


def texels_of(surfaces: Sequence[Surface], *, coarser: float = 1.0) -> Texels:
    """The grid of texels of every surface, `coarser` times wider; one texel for those that glow."""
    parts, shapes = [], []
    for surface in surfaces:
        points = surface.points
        width = float(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1).max())
        height = float(np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0).max())
        pitch = SMALL_TEXEL_M if width * height < SMALL_AREA_M2 else WALL_TEXEL_M
        pitch *= coarser
        shape = (1, 1) if surface.glow > 0 else (cells(height, pitch), cells(width, pitch))
        (at_t, slope_t), (at_s, slope_s) = (
            _interpolation(n, k) for n, k in zip(shape, points.shape[:2], strict=True)
        )
        centre, down, across = (
            (np.tensordot(a, points, (1, 0)).transpose(0, 2, 1) @ b.T).transpose(0, 2, 1)
            for a, b in ((at_t, at_s), (slope_t, at_s), (at_t, slope_s))
        )
        parts.append([grid.reshape(-1, 3) for grid in (centre, across, down)])
        shapes.append(shape)
    centres, across, down = (np.concatenate([part[k] for part in parts]) for k in range(3))
    normals = np.cross(down, across)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return Texels(centres, across, down, normals, tuple(shapes))


def lit(surfaces: Sequence[Surface], light: Float32Array) -> list[Surface]:
    """The surfaces with the light multiplied into their pictures; those that glow stay as they are.

    Args:
        surfaces: the room's.
        light: (N, 3) linear factors on the linear albedo, for every texel of `texels_of(surfaces)`.
    """
    result, first = [], 0
    for surface, shape in zip(surfaces, texels_of(surfaces).shapes, strict=True):
        here = slice(first, first + shape[0] * shape[1])
        first = here.stop
        if surface.glow == 0:
            field = light[here].reshape(*shape, 3)
            surface = replace(surface, picture=_expose(surface.picture, field))
        result.append(surface)
    return result


def linear_light(srgb: NDArray[Any]) -> Float32Array:
    """Linear light 0..1 of sRGB 0..255."""
    value = np.asarray(srgb, dtype=np.float32) / 255.0
    curve = ((value + 0.055) / 1.055) ** 2.4
    return np.where(value <= 0.04045, value / 12.92, curve).astype(np.float32)


def _interpolation(texels: int, points: int) -> tuple[FloatArray, FloatArray]:
    """(texels, points) weights of linear interpolation at texel centres, and of a texel's span."""
    position = (np.arange(texels) + 0.5) / texels * (points - 1)
    left = np.minimum(position.astype(np.int64), points - 2)
    rows = np.arange(texels)
    value, span = np.zeros((texels, points)), np.zeros((texels, points))
    value[rows, left], value[rows, left + 1] = 1 - (position - left), position - left
    span[rows, left] = -(points - 1) / texels
    span[rows, left + 1] = (points - 1) / texels
    return value, span


def _expose(albedo: Picture, light: Float32Array) -> Picture:
    """An sRGB albedo under linear light, as sRGB; as fine as the finer of the two."""
    h, w = (max(a, b) for a, b in zip(albedo.shape[:2], light.shape[:2], strict=True))
    full = cv2.resize(light, (w, h), interpolation=cv2.INTER_LINEAR).reshape(h, w, 3)
    colour = cv2.resize(linear_light(albedo), (w, h), interpolation=cv2.INTER_LINEAR)
    bright = colour.reshape(h, w, 3) * full
    over = np.maximum(bright - SHOULDER, 0.0)
    room = 1.0 - SHOULDER
    bright = np.minimum(bright, SHOULDER) + room * (1.0 - np.exp(-over / room))
    return _encode(bright.astype(np.float32))


def _encode(linear: Float32Array) -> Picture:
    """Linear light 0..1 to sRGB 0..255."""
    value = np.clip(linear, 0.0, 1.0)
    srgb = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return (255.0 * srgb + 0.5).astype(np.uint8)
