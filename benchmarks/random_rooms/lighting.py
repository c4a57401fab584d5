"""The light of a random room, cheaply: lamps and the window by a few shadow rays, and openness.

The share of every lamp is kept apart, so that the same room can be shown under other light.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.mesh import TexturedMesh
from scenes.rays import RayScene
from scenes.samples.light import AreaLight, Texels, linear_light, lit, texels_of
from scenes.samples.pictures.atlas import grid_faces, mesh_from_surfaces
from scenes.samples.shapes import Surface

FloatArray = NDArray[np.float64]
Float32Array = NDArray[np.float32]

COARSER = 3.0
"""Light is found at texels three times as wide as traced light's: 8 cm on walls, 3 cm elsewhere."""

AROUND = 32
"""Directions in which openness is tested; its deviation is below 6 % of full light."""

REACH_M = 0.9
"""Distance beyond which nothing darkens a corner; walls of a room are 2 m and more apart."""

ACROSS = 3
"""Shadow rays along each side of a lamp: shadows have nine steps, blurred by the texels."""

BOUNCED = 0.55
"""Light from all around against the mean light of lamps and window; rooms are mostly pale."""

BRIGHTEST = 1.15
"""A tenth of all texels may be brighter than this factor on their albedo; a camera that exposes for
the whole room clips no more."""

OFF_SURFACE_M = 3e-3
"""Rays begin this far in front of a surface."""

WHITE_BALANCE = 0.6
"""How much of the light's own colour the camera takes away."""


@dataclass(frozen=True, slots=True, eq=False)
class RoomLight:
    """Light at coarse texels, by source.

    Attributes:
        surfaces: what is lit.
        texels: where it is known.
        sources: (S, N, 3) linear factors on albedo; the first is light from all around, which all
            the others together cause.
        exposure: (3,) factor that brings the floor to the room's level.
    """

    surfaces: tuple[Surface, ...]
    texels: Texels
    sources: Float32Array
    exposure: Float32Array

    def mesh(self, weights: FloatArray) -> TexturedMesh:
        """The room as one mesh under its light.

        Args:
            weights: (S - 1, 3) of each lamp and channel; ones give the light of the scan.
        """
        mean = weights.mean(axis=0, keepdims=True)
        every = np.concatenate([mean, weights]).astype(np.float32)
        light = np.einsum("snc,sc->nc", self.sources, every) * self.exposure
        fine = texels_of(self.surfaces)
        finer = np.concatenate(
            [
                cv2.resize(field, shape[::-1], interpolation=cv2.INTER_LINEAR).reshape(-1, 3)
                for field, shape in zip(self._fields(light), fine.shapes, strict=True)
            ]
        )
        return mesh_from_surfaces(lit(self.surfaces, finer.astype(np.float32)), width_px=4096)

    def _fields(self, light: Float32Array) -> list[Float32Array]:
        fields: list[Float32Array] = []
        first = 0
        for rows, columns in self.texels.shapes:
            fields.append(light[first : first + rows * columns].reshape(rows, columns, 3))
            first += rows * columns
        return fields


def room_light(
    surfaces: Sequence[Surface],
    lights: Sequence[AreaLight],
    rng: np.random.Generator,
    *,
    level: float,
) -> RoomLight:
    """The light of a room.

    Args:
        surfaces: everything that stays; the first is the floor.
        lights: what shines, at least one.
        rng: turns the directions in which openness is tested.
        level: mean brightness of the floor as a factor on sRGB values, 0..1.
    """
    texels = texels_of(surfaces, coarser=COARSER)
    scene = RayScene(_triangles(surfaces))
    origins = texels.centres + OFF_SURFACE_M * texels.normals
    direct = [_direct(scene, origins, texels.normals, light) for light in lights]
    floor = slice(0, int(np.prod(texels.shapes[0])))
    total = np.sum([source[floor].mean(axis=0) for source in direct], axis=0)
    around = BOUNCED * _openness(scene, origins, texels.normals, rng)[:, None] * total
    sources = np.stack([around, *direct]).astype(np.float32)
    white = sources[:, floor].sum(axis=0).mean(axis=0)
    balanced = WHITE_BALANCE * white + (1 - WHITE_BALANCE) * white.mean()
    wanted = float(linear_light(np.array([255.0 * level]))[0])
    brightest = float(np.percentile(sources.sum(axis=0).mean(axis=1) / white.mean(), 90))
    exposure = min(wanted, BRIGHTEST / brightest) / balanced
    return RoomLight(tuple(surfaces), texels, sources, exposure.astype(np.float32))


def _triangles(surfaces: Sequence[Surface]) -> FloatArray:
    """(T, 3, 3) of all that can cast a shadow; panes and lamps themselves do not."""
    parts = [
        surface.points.reshape(-1, 3)[grid_faces(*surface.points.shape[:2])]
        for surface in surfaces
        if surface.glow == 0
    ]
    return np.concatenate(parts)


def _direct(
    scene: RayScene, origins: FloatArray, normals: FloatArray, light: AreaLight
) -> FloatArray:
    """(N, 3) light that arrives straight from a lamp."""
    facing = np.cross(light.u, light.v)
    area = float(np.linalg.norm(facing))
    facing = facing / area
    total = np.zeros(len(origins))
    steps = (np.arange(ACROSS) + 0.5) / ACROSS
    for s in steps:
        for t in steps:
            ray = light.corner + s * light.u + t * light.v - origins
            square = np.maximum((ray**2).sum(axis=1), 0.02)
            towards = ray / np.sqrt(square)[:, None]
            strength = np.maximum((towards * normals).sum(axis=1), 0.0)
            strength *= np.maximum(-towards @ facing, 0.0) / (np.pi * square)
            lit_here = np.flatnonzero(strength > 0)
            free = ~scene.blocked(origins[lit_here], 0.985 * ray[lit_here])
            total[lit_here] += strength[lit_here] * free
    return total[:, None] * (area / ACROSS**2) * np.array(light.radiance)


def _openness(
    scene: RayScene, origins: FloatArray, normals: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """(N,) how open the surroundings are, 0..1, cosine-weighted."""
    k = np.arange(AROUND) + 0.5
    z = 1 - 2 * k / AROUND
    angle = np.pi * (1 + 5**0.5) * k + rng.uniform(0, 2 * np.pi)
    r = np.sqrt(1 - z * z)
    openness = np.zeros(len(origins))
    for direction in np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1):
        tilted = normals + 0.999 * direction
        tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
        distance = scene.cast(origins, tilted).distance
        openness += np.minimum(distance / REACH_M, 1.0) / AROUND
    return openness
