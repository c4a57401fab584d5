"""The light at a place in a scanned room: what its own surfaces send there.

Photos hold no light beyond white, so windows and lamps count as white: the light of what shines is
understated, and with it how much darker its opposite side is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, pixel_centres
from scenes.frames import look_at
from scenes.harmonics import basis
from scenes.pose import Pose, rotation_from_quaternion
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.splats import SH_C0, SplatCloud

GAMMA = 2.2
"""Exponent that takes sRGB values to light, near enough for ratios."""
PICTURE_PX = 48
"""Side of the two pictures in which the surroundings are seen: irradiance is smooth (Ramamoorthi
and Hanrahan 2001: nine numbers hold it to 1 %), so 4 degrees a pixel are enough."""
COSINE_BANDS = np.array([math.pi] + [2.0 * math.pi / 3.0] * 3 + [math.pi / 4.0] * 5)
"""Factor of a cosine lobe for each harmonic of the light (Ramamoorthi and Hanrahan 2001, eq. 8)."""
MIN_IRRADIANCE = 1e-3
MAX_GAIN = 2.5
"""A surface becomes at most so much lighter or darker than in the scan, in light: beyond that the
estimate, which knows no light brighter than white, is wrong rather than the surface."""
MIN_KEY_SINE = 0.35
"""Lowest elevation of the main light: from lower its shadows fall on walls, not on the floor."""
SHOWN = 0.8
"""Light on a surface halfway turned to the main light, as a share of what makes it look as its
texture: a person's colours then look as under the light of the built-in rooms."""

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Irradiance:
    """Irradiance at a place, by direction of the surface.

    Attributes:
        coefficients: (9, 3) spherical harmonics to degree 2 of linear RGB.
    """

    coefficients: Array

    def on(self, normals: Array, flatness: Array) -> Array:
        """(N, 3) linear RGB on surfaces.

        Args:
            normals: (N, 3) unit vectors.
            flatness: (N,) 0..1; what is round takes its light from everywhere.
        """
        fade = flatness[:, None] ** np.array([0] + [1] * 3 + [2] * 5)
        value = (basis(normals, 2) * fade) @ self.coefficients
        return np.maximum(value, MIN_IRRADIANCE)


def irradiance_at(place: Array, room: SplatCloud, renderer: Renderer) -> Irradiance:
    """The light that a room sends to a place (3,) in it, world metres."""
    lens = Fisheye.from_fov(PICTURE_PX, math.pi)
    pixels = pixel_centres(lens)
    off_axis = np.hypot(*(pixels - (lens.cx, lens.cy)).T) / lens.f_px
    inside = off_axis <= 0.5 * math.pi
    rays = lens.unproject(pixels[inside])
    # An equidistant lens stretches its rim: a pixel there sees less of the sphere.
    solid_angle = np.sinc(off_axis[inside] / math.pi) / lens.f_px**2
    total = np.zeros((9, 3))
    for towards in ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)):
        world_from_lens = look_at(place, place + np.array(towards))
        drawn = renderer.render(
            [PosedSplats(room, Pose.identity())], lens, world_from_lens, RenderOptions()
        )
        seen = drawn.rgb.reshape(-1, 3)[inside]
        light = np.clip(seen, 0.0, 1.0).astype(np.float64) ** GAMMA
        directions = rays @ world_from_lens.rotation.T
        total += (basis(directions, 2) * solid_angle[:, None]).T @ light
    return Irradiance(COSINE_BANDS[:, None] * total)


def relit(
    cloud: SplatCloud,
    *,
    before: Irradiance,
    world_from_object_before: Pose,
    now: Irradiance,
    world_from_object: Pose,
) -> SplatCloud:
    """An object's splats in the light of another place.

    Args:
        cloud: in the object's frame, as it looked where it was scanned.
        before: the light there.
        world_from_object_before: how it stood there.
        now: the light where it stands.
        world_from_object: how it stands.
    """
    normals, flatness = _normals(cloud)
    was = before.on(normals @ world_from_object_before.rotation.T, flatness)
    comes = now.on(normals @ world_from_object.rotation.T, flatness)
    gain = np.clip(comes / was, 1.0 / MAX_GAIN, MAX_GAIN) ** (1.0 / GAMMA)
    gain32 = gain.astype(np.float32)
    sh = cloud.sh * gain32[:, None, :]
    sh[:, 0] += (gain32 - 1.0) * np.float32(0.5 / SH_C0)
    return SplatCloud(cloud.means, cloud.scales, cloud.rotations, cloud.opacities, sh)


def main_light(irradiance: Irradiance) -> tuple[Array, float, float]:
    """Direction (3,) of the main light, and the shares of light from everywhere and from there.

    The irradiance is taken for `ambient + key · max(0, n·l)`, whose mean over all directions is
    `ambient + key / 4` and whose slope is `key / 2`.
    """
    grey = irradiance.coefficients.mean(axis=1)
    mean = SH_C0 * float(grey[0])
    axes = np.eye(3)
    slope = np.array([float(basis(axis[None], 1)[0, 1:] @ grey[1:4]) for axis in axes])
    size = float(np.linalg.norm(slope))
    direction = slope / size if size > 1e-9 else axes[2]
    direction[2] = max(direction[2], MIN_KEY_SINE)
    direction /= np.linalg.norm(direction)
    key = 2.0 * size
    ambient = max(mean - 0.25 * key, 0.1 * mean)
    scale = SHOWN / max(ambient + 0.5 * key, 1e-9)
    return direction, scale * ambient, scale * key


def _normals(cloud: SplatCloud) -> tuple[Array, Array]:
    """(N, 3) shortest axes, facing away from the object's middle, and (N,) how flat splats are."""
    scales = np.sort(cloud.scales.astype(np.float64), axis=1)
    flatness = 1.0 - scales[:, 0] / np.maximum(scales[:, 1], 1e-12)
    rotations = rotation_from_quaternion(cloud.rotations).astype(np.float64)
    shortest = np.argmin(cloud.scales, axis=1)
    normals = np.take_along_axis(rotations, shortest[:, None, None], axis=2)[..., 0]
    means = cloud.means.astype(np.float64)
    inwards = ((means - means.mean(axis=0)) * normals).sum(axis=1) < 0
    return np.where(inwards, -1.0, 1.0)[:, None] * normals, flatness
