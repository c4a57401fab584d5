"""Focal length, centre and distortion of a fisheye: their effect on its picture, and changes.

A lens's radius is f·(θ + k1·θ³ + k2·θ⁵ + k3·θ⁷ + k4·θ⁹). The powers are correlated, so what is
fitted are sums of them of which each moves the picture in a way of its own: odd polynomials of the
angle over the rim's that are orthogonal over the lens circle, each of root mean square 1. Like
displacements their amounts are in radians, pixels over the focal length, and so hold at any size of
picture. A lens that is sold is (0.017, -0.009, -0.003, 0.0002) from an equidistant one.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Camera, Fisheye
from scenes.pose import Pose

Points = NDArray[np.float64]

TERMS = 5
"""Terms of the radius: the focal length and four of distortion."""

SHAPE = TERMS + 2
"""Numbers of a lens: the terms, then the centre's x and y."""

POWERS = 2.0 * np.arange(TERMS) + 1.0
"""Of the angle in the radius."""

UNTURNED = Pose.identity()
"""Of two lenses that look the same way."""

NAMES = (
    "focal length",
    "distortion 1",
    "distortion 2",
    "distortion 3",
    "distortion 4",
    "centre x",
    "centre y",
)
"""Names of the parameters in messages that one of them was not observed."""


def shape_of(camera: Fisheye, f_px: float) -> Points:
    """(SHAPE,) the lens's numbers in radians of a focal length in px."""
    scaled = np.array([1.0, *camera.distortion]) * camera.max_angle**POWERS
    terms = np.linalg.solve(_terms(), camera.f_px / f_px * scaled)
    return np.array([*terms, camera.cx / f_px, camera.cy / f_px])


def by_shape(camera: Fisheye, pixels: Points) -> Points:
    """(N, 2, SHAPE) displacement of pixels, in radians, by each number of the lens.

    Args:
        camera: the lens.
        pixels: (N, 2) px.
    """
    apart = pixels - (camera.cx, camera.cy)
    radii = np.hypot(apart[:, 0], apart[:, 1])
    share = np.minimum(camera.angles_at(radii) / camera.max_angle, 1.0)
    around = apart / np.maximum(radii, 1e-9)[:, None]
    columns = np.zeros((len(pixels), 2, SHAPE))
    columns[:, :, :TERMS] = around[:, :, None] * (share[:, None] ** POWERS @ _terms())[:, None, :]
    columns[:, 0, TERMS] = columns[:, 1, TERMS + 1] = 1.0
    return columns


def reshaped(camera: Fisheye, change: Points) -> Fisheye:
    """The lens after a change of its numbers, or after as much of it as leaves it a lens.

    Args:
        camera: before.
        change: (SHAPE,) radians.

    Raises:
        ValueError: no part of the change leaves a lens whose radius grows up to its rim.
    """
    for share in (1.0, 0.5, 0.25, 0.125):
        try:
            return _reshaped(camera, share * change)
        except ValueError:
            continue
    return _reshaped(camera, change / 16.0)


def rms_px(a: Camera, b: Camera, *, max_angle: float, b_from_a: Pose = UNTURNED) -> float:
    """Root mean square distance of two lenses' pixels over the lens circle.

    Args:
        a: one lens.
        b: the other, of the same size.
        max_angle: half field of view that is compared, radians.
        b_from_a: its turn is taken into account: a lens whose centre is off shows nearly what it
            should if it is turned as much.
    """
    rays = circle_rays(max_angle)
    apart = a.project(rays)[0] - b.project(rays @ b_from_a.rotation.T)[0]
    return math.sqrt(float(np.mean(apart[:, 0] ** 2 + apart[:, 1] ** 2)))


def sigma_px(camera: Fisheye, covariance: Points, *, max_angle: float) -> float:
    """Root mean square standard deviation of the lens's pixels over the lens circle.

    Args:
        camera: the lens.
        covariance: (SHAPE, SHAPE) of its numbers.
        max_angle: half field of view that is looked at, radians.
    """
    pixels, _ = camera.project(circle_rays(max_angle))
    columns = by_shape(camera, pixels)
    variance: Points = np.einsum("nia,ab,nib->n", columns, covariance, columns)
    return camera.f_px * math.sqrt(float(np.mean(variance)))


def circle_rays(max_angle: float, *, rings: int = 40, spokes: int = 24) -> Points:
    """(N, 3) unit rays spread evenly over a lens circle's area."""
    angles = max_angle * np.sqrt((np.arange(rings) + 0.5) / rings)
    turns = 2.0 * math.pi * (np.arange(spokes) + 0.5) / spokes
    angle, turn = (grid.ravel() for grid in np.meshgrid(angles, turns, indexing="ij"))
    sine = np.sin(angle)
    return np.column_stack([sine * np.cos(turn), sine * np.sin(turn), np.cos(angle)])


def _reshaped(camera: Fisheye, change: Points) -> Fisheye:
    radius = np.array([1.0, *camera.distortion])
    radius = radius + _terms() @ change[:TERMS] / camera.max_angle**POWERS
    k = radius[1:] / radius[0]
    return replace(
        camera,
        f_px=float(camera.f_px * radius[0]),
        cx=float(camera.cx + camera.f_px * change[TERMS]),
        cy=float(camera.cy + camera.f_px * change[TERMS + 1]),
        distortion=(float(k[0]), float(k[1]), float(k[2]), float(k[3])),
    )


@cache
def _terms() -> Points:
    """(TERMS, TERMS) of each power of the angle's share, how much there is in each term."""
    # Evenly over the circle's area.
    share = np.sqrt((np.arange(4000) + 0.5) / 4000)
    _, upper = np.linalg.qr(share[:, None] ** POWERS)
    terms = np.linalg.inv(upper) * math.sqrt(len(share)) * np.sign(np.diag(upper))
    terms.setflags(write=False)
    return np.asarray(terms, dtype=np.float64)
