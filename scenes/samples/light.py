"""Puts the room's light into its pictures: soft window and lamp light, bounced about by radiosity.

Direct light is sampled over the lights' areas with shadow rays. Bounced light is solved per
triangle (Goral et al. 1984, with ray-cast form factors), then gathered once more per light texel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.rays import RayScene
from scenes.samples.atlas import grid_faces
from scenes.samples.shapes import Picture, Surface, cells

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]

BOUNCES = 5
TRIANGLE_RAYS = 48
TEXEL_RAYS = 40
WALL_TEXEL_M = 0.04
SMALL_TEXEL_M = 0.014
SMALL_AREA_M2 = 1.5
"""Surfaces below this area get the finer light texels: they are furniture."""
OFF_SURFACE_M = 2e-3
GOLDEN = 0.6180339887498949
MISS = -1
BRIGHTEST = 4.0
"""Bounced light is limited to this multiple of its median: a few bright triangles next to a light
would otherwise show as sparks wherever a ray happens to meet them."""
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
        samples: (along u, along v) shadow rays per light texel.
    """

    corner: FloatArray
    u: FloatArray
    v: FloatArray
    radiance: tuple[float, float, float]
    samples: tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class _Texels:
    """Points that are lit: positions and normals (N, 3), and the grid size per surface."""

    where: FloatArray
    normals: FloatArray
    shapes: list[tuple[int, int]]


@dataclass(frozen=True, slots=True, eq=False)
class _World:
    """The triangles that block and bounce light."""

    scene: RayScene
    centres: FloatArray
    normals: FloatArray
    albedo: Float32Array


def lit(
    surfaces: Sequence[Surface],
    lights: Sequence[AreaLight],
    *,
    reference: FloatArray,
    level: float,
    rng: np.random.Generator,
) -> list[Surface]:
    """The surfaces with the light multiplied into their pictures; those that glow stay as they are.

    Args:
        surfaces: everything that blocks, bounces or receives light.
        lights: at least one.
        reference: (3,) point in metres; exposure and white balance are set for level ground there.
        level: light at `reference` after exposure, as a factor on sRGB values, 0..1.
        rng: source of the sampling.
    """
    world = _world(surfaces)
    bounced = _radiosity(world, lights, rng)
    texels = _texels(surfaces)
    light, valid = _gathered(world, bounced, lights, texels.where, texels.normals, TEXEL_RAYS, rng)
    around = reference + np.concatenate(
        [rng.uniform(-0.4, 0.4, (64, 2)), np.zeros((64, 1))], axis=1
    )
    up = np.broadcast_to(np.array([0.0, 0.0, 1.0]), around.shape)
    white = _gathered(world, bounced, lights, around, up, TEXEL_RAYS, rng)[0].mean(axis=0)
    balanced = 0.35 * white + 0.65 * white.mean()
    light *= (_linear(np.array([level * 255.0]))[0] / balanced).astype(np.float32)
    result, first = [], 0
    for surface, (rows, columns) in zip(surfaces, texels.shapes, strict=True):
        here = slice(first, first + rows * columns)
        first = here.stop
        if surface.glow > 0:
            result.append(surface)
            continue
        field = _smoothed(light[here].reshape(rows, columns, 3), valid[here].reshape(rows, columns))
        result.append(replace(surface, picture=_exposed(surface.picture, field)))
    return result


def _world(surfaces: Sequence[Surface]) -> _World:
    corners, albedo = [], []
    for surface in surfaces:
        rows, columns = surface.points.shape[:2]
        corners.append(surface.points.reshape(-1, 3)[grid_faces(rows, columns)])
        coarse = cv2.resize(
            _linear(surface.picture), (columns - 1, rows - 1), interpolation=cv2.INTER_AREA
        ).reshape(-1, 3)
        reflected = np.zeros_like(coarse) if surface.glow > 0 else coarse
        albedo.append(np.concatenate([reflected, reflected]))
    triangles = np.concatenate(corners)
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(cross, axis=1)
    real = length > 1e-12
    return _World(
        RayScene(triangles[real]),
        triangles[real].mean(axis=1),
        cross[real] / length[real, None],
        np.concatenate(albedo)[real].astype(np.float32),
    )


def _texels(surfaces: Sequence[Surface]) -> _Texels:
    where, normals, shapes = [], [], []
    for surface in surfaces:
        points = surface.points
        across = float(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1).max())
        down = float(np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0).max())
        pitch = SMALL_TEXEL_M if across * down < SMALL_AREA_M2 else WALL_TEXEL_M
        shape = (1, 1) if surface.glow > 0 else (cells(down, pitch), cells(across, pitch))
        (at_t, slope_t), (at_s, slope_s) = (
            _interpolation(n, k) for n, k in zip(shape, points.shape[:2], strict=True)
        )
        grid = [
            (np.tensordot(a, points, (1, 0)).transpose(0, 2, 1) @ b.T).transpose(0, 2, 1)
            for a, b in ((at_t, at_s), (slope_t, at_s), (at_t, slope_s))
        ]
        normal = np.cross(grid[1], grid[2]).reshape(-1, 3)
        where.append(grid[0].reshape(-1, 3))
        normals.append(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12))
        shapes.append(shape)
    return _Texels(np.concatenate(where), np.concatenate(normals), shapes)


def _interpolation(texels: int, points: int) -> tuple[FloatArray, FloatArray]:
    """(texels, points) weights of linear interpolation at texel centres, and of its slope."""
    position = (np.arange(texels) + 0.5) / texels * (points - 1)
    left = np.minimum(position.astype(np.int64), points - 2)
    rows = np.arange(texels)
    value, slope = np.zeros((texels, points)), np.zeros((texels, points))
    value[rows, left], value[rows, left + 1] = 1 - (position - left), position - left
    slope[rows, left], slope[rows, left + 1] = -1.0, 1.0
    return value, slope


def _radiosity(
    world: _World, lights: Sequence[AreaLight], rng: np.random.Generator
) -> Float32Array:
    """(T, 3) light that leaves each triangle."""
    direct = _direct(world, lights, world.centres, world.normals, rng)
    hits = np.stack(
        [ids for ids, _ in _hemisphere(world, world.centres, world.normals, TRIANGLE_RAYS, rng)]
    )
    leaving = world.albedo * direct
    for _ in range(BOUNCES):
        padded = np.concatenate([leaving, np.zeros((1, 3), dtype=np.float32)])
        arriving = sum((padded[row] for row in hits), np.zeros_like(leaving)) / len(hits)
        leaving = world.albedo * (direct + arriving)
    ceiling = BRIGHTEST * float(np.median(leaving[leaving.max(axis=1) > 0]))
    leaving *= np.minimum(1.0, ceiling / np.maximum(leaving.max(axis=1, keepdims=True), 1e-9))
    return leaving.astype(np.float32)


def _gathered(
    world: _World,
    bounced: Float32Array,
    lights: Sequence[AreaLight],
    where: FloatArray,
    normals: FloatArray,
    rays: int,
    rng: np.random.Generator,
) -> tuple[Float32Array, NDArray[np.bool_]]:
    """Light (N, 3) at points, and whether they see the room rather than the inside of something."""
    light = _direct(world, lights, where, normals, rng)
    padded = np.concatenate([bounced, np.zeros((1, 3), dtype=np.float32)])
    buried = np.zeros(len(where), dtype=np.int32)
    for ids, inside in _hemisphere(world, where, normals, rays, rng):
        light += padded[ids] / rays
        buried += inside
    return light, buried < rays // 2


def _hemisphere(
    world: _World, where: FloatArray, normals: FloatArray, rays: int, rng: np.random.Generator
) -> list[tuple[NDArray[np.int32], NDArray[np.bool_]]]:
    """Per cosine-weighted ray: triangle seen by each point (-1: none) and whether from behind."""
    facing = normals.astype(np.float32)
    origins = where.astype(np.float32) + np.float32(OFF_SURFACE_M) * facing
    spin = rng.random(len(where), dtype=np.float32)
    tilt = rng.random(len(where), dtype=np.float32)
    up_axis, x_axis = np.eye(3, dtype=np.float32)[[2, 0]]
    first = np.cross(np.where(np.abs(facing[:, 2:]) < 0.9, up_axis, x_axis), facing)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(facing, first)
    result = []
    for k in range(rays):
        r2 = (k + tilt) / rays
        angle = np.float32(2 * np.pi) * (spin + np.float32(k * GOLDEN % 1.0))
        r, up = np.sqrt(r2), np.sqrt(1 - r2)
        ray = (r * np.cos(angle))[:, None] * first + (r * np.sin(angle))[:, None] * second
        ray += up[:, None] * facing
        hits = world.scene.cast(origins, ray)
        behind = np.einsum("nd,nd->n", ray, hits.normals) > 0
        behind &= hits.triangle >= 0
        result.append((np.where(behind, MISS, hits.triangle).astype(np.int32), behind))
    return result


def _direct(
    world: _World,
    lights: Sequence[AreaLight],
    where: FloatArray,
    normals: FloatArray,
    rng: np.random.Generator,
) -> Float32Array:
    """(N, 3) light straight from the lights, per unit of albedo."""
    upright = normals.astype(np.float32)
    origins = where.astype(np.float32) + np.float32(OFF_SURFACE_M) * upright
    light = np.zeros((len(where), 3), dtype=np.float32)
    for lamp in lights:
        corner, u, v = (e.astype(np.float32) for e in (lamp.corner, lamp.u, lamp.v))
        facing = np.cross(u, v)
        area = float(np.linalg.norm(facing))
        facing = facing / np.float32(area)
        count = lamp.samples[0] * lamp.samples[1]
        radiance = np.asarray(lamp.radiance, dtype=np.float32)
        for i, j in np.ndindex(*lamp.samples):
            a, b = rng.random((2, len(where), 1), dtype=np.float32)
            a, b = (i + a) / lamp.samples[0], (j + b) / lamp.samples[1]
            ray = corner + a * u + b * v - origins
            square = np.einsum("nd,nd->n", ray, ray)
            cosines = np.maximum(np.einsum("nd,nd->n", ray, upright), 0) * np.maximum(
                -ray @ facing, 0
            )
            useful = np.flatnonzero(cosines > 0)
            blocked = world.scene.blocked(origins[useful], ray[useful])
            free = useful[~blocked]
            amount = cosines[free] * area / (np.pi * np.square(square[free]) * count)
            light[free] += np.minimum(amount, 4.0).astype(np.float32)[:, None] * radiance
    return light


def _smoothed(light: Float32Array, valid: NDArray[np.bool_]) -> Float32Array:
    """The sampling noise blurred away; texels inside things take their neighbours' light."""
    if min(light.shape[:2]) == 1 and light.size <= 3:
        return light
    weight = np.where(valid, 1.0, 1e-4).astype(np.float32)
    total = cv2.GaussianBlur(
        light * weight[..., None], (0, 0), 1.25, borderType=cv2.BORDER_REPLICATE
    )
    share = cv2.GaussianBlur(weight, (0, 0), 1.25, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(total.reshape(light.shape) / share.reshape(*light.shape[:2], 1), np.float32)


def _exposed(albedo: Picture, light: Float32Array) -> Picture:
    """An sRGB albedo under linear light, as sRGB; highlights roll off softly."""
    h, w = albedo.shape[:2]
    full = cv2.resize(light, (w, h), interpolation=cv2.INTER_LINEAR).reshape(h, w, 3)
    bright = _linear(albedo) * full
    over = np.maximum(bright - SHOULDER, 0.0)
    room = 1.0 - SHOULDER
    bright = np.minimum(bright, SHOULDER) + room * (1.0 - np.exp(-over / room))
    return _encoded(bright.astype(np.float32))


def _linear(srgb: NDArray[Any]) -> Float32Array:
    """Linear light 0..1 of sRGB 0..255."""
    value = np.asarray(srgb, dtype=np.float32) / 255.0
    curve = ((value + 0.055) / 1.055) ** 2.4
    return np.where(value <= 0.04045, value / 12.92, curve).astype(np.float32)


def _encoded(linear: Float32Array) -> Picture:
    """Linear light 0..1 to sRGB 0..255."""
    value = np.clip(linear, 0.0, 1.0)
    srgb = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return (255.0 * srgb + 0.5).astype(np.uint8)
