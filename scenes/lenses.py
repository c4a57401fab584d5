"""The unified-sphere lens of 360° cameras' calibrations, and the fisheye nearest to it.

A ray is put on the unit sphere and looked at from `xi` behind its centre: m = (x, y) / (z + ξ).
Radial and tangential distortion then act on m as in Brown's model: u = f·m' + c. With ξ above 1 the
picture reaches beyond 90° off axis. Cameras state their lenses so; the renderer and the tracker
know `Fisheye`, which `as_fisheye` fits to such a lens, with what it leaves. Where that is too much,
`scenes.warp` takes the picture itself to the fisheye, with nothing left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scenes.cameras import BoolArray, Fisheye, FloatArray, Pinhole, camera_from_json, camera_to_json

MODEL = "unified_sphere"
"""Its name in files."""

STEEPEST = 0.1
"""Least growth of the radius with the angle, against that on the axis, up to which a lens is used:
nearer to where the picture folds back, a pixel does not determine an angle."""

LIMIT_STEPS = 3600
"""Angles from 0 to π at which the growth is looked at."""

FARTHEST = 20.0
"""Largest |m|, which with ξ below 1 grows without bound: of a pinhole, 87° off axis."""

SOLVED = 1e-14
"""Change of m at which its distortion counts as undone."""

START_RADII = 1024
"""Radii at which the radial distortion is known, from which the solution begins."""

NEWTON_STEPS = 12
"""Most steps to that; a lens that is sold takes three."""

FIT_ANGLES, FIT_TURNS = 200, 48
"""Directions off axis and around it at which a fisheye is fitted."""


@dataclass(frozen=True, slots=True)
class UnifiedSphere:
    """A lens by the unified sphere with radial and tangential distortion.

    Attributes:
        width_px: of the picture.
        height_px: of the picture.
        xi: distance of the eye from the sphere's centre, its radius being 1.
        fx: px per unit of m along x.
        fy: likewise along y.
        cx: of the axis, px.
        cy: likewise.
        k1: radial distortion by |m|².
        k2: by |m|⁴.
        k3: by |m|⁶.
        p1: tangential distortion.
        p2: likewise.
        max_angle: half field of view in radians; given, it is lowered to what the picture can show.

    Raises:
        ValueError: a size, focal length, ξ or angle is out of range, or a value is not finite.
    """

    width_px: int
    height_px: int
    xi: float
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    max_angle: float = math.pi

    def __post_init__(self) -> None:
        if self.width_px < 1 or self.height_px < 1:
            size = f"{self.width_px}×{self.height_px}"
            raise ValueError(f"UnifiedSphere: size {size} px, wanted at least 1×1")
        for field in fields(self):
            if not math.isfinite(getattr(self, field.name)):
                raise ValueError(f"UnifiedSphere.{field.name}: not finite, wanted a number")
        if not (self.fx > 0 and self.fy > 0):
            raise ValueError(
                f"UnifiedSphere: focal length {(self.fx, self.fy)} px, wanted both > 0"
            )
        if self.xi < 0:
            raise ValueError(f"UnifiedSphere.xi: {self.xi}, wanted 0 or more")
        if not 0 < self.max_angle <= math.pi:
            raise ValueError(
                f"UnifiedSphere.max_angle: {self.max_angle} rad, wanted 0 < angle <= π"
            )
        object.__setattr__(self, "max_angle", min(self.max_angle, self._foldless_angle()))

    @property
    def circle_px(self) -> float:
        """Mean radius of the lens circle."""
        growth = self._distorted(np.array([self._off_sphere(np.array(self.max_angle))]))[0]
        return math.sqrt(self.fx * self.fy) * float(growth)

    def resized(self, width_px: int, height_px: int) -> UnifiedSphere:
        """The same lens on a picture of another size; the width sets the scale."""
        scale = width_px / self.width_px
        return replace(
            self,
            width_px=width_px,
            height_px=height_px,
            fx=self.fx * scale,
            fy=self.fy * scale,
            cx=self.cx * scale,
            cy=self.cy * scale,
        )

    def project(self, points: ArrayLike) -> tuple[FloatArray, BoolArray]:
        """(N, 3) camera points -> (N, 2) px, (N,) valid: inside the lens circle and the image."""
        p = np.atleast_2d(np.asarray(points, dtype=np.float64))
        across = np.hypot(p[:, 0], p[:, 1])
        angles = np.arctan2(across, p[:, 2])
        gain = self._off_sphere(angles) / np.maximum(across, 1e-300)
        flat = p[:, :2] * gain[:, None]
        pixels = self._moved(flat)[0] * (self.fx, self.fy) + (self.cx, self.cy)
        x, y = pixels[:, 0], pixels[:, 1]
        inside = (x >= 0) & (x <= self.width_px) & (y >= 0) & (y <= self.height_px)
        seen = (angles <= self.max_angle) & (np.linalg.norm(p, axis=1) > 1e-9)
        return pixels, seen & inside

    def unproject(self, pixels: ArrayLike) -> FloatArray:
        """(N, 2) px -> (N, 3) unit rays."""
        p = np.atleast_2d(np.asarray(pixels, dtype=np.float64))
        wanted = (p - (self.cx, self.cy)) / (self.fx, self.fy)
        flat = self._undone(wanted)
        radius = np.hypot(flat[:, 0], flat[:, 1])
        angles = self._on_sphere(radius)
        sine = np.sin(angles) / np.maximum(radius, 1e-300)
        return np.column_stack([flat * sine[:, None], np.cos(angles)])

    def _off_sphere(self, angles: FloatArray) -> FloatArray:
        """|m| at angles off axis; beyond `max_angle` it goes on along its tangent."""
        inside = np.minimum(angles, self.max_angle)
        below = np.cos(inside) + self.xi
        slope = (1.0 + self.xi * math.cos(self.max_angle)) / (
            math.cos(self.max_angle) + self.xi
        ) ** 2
        return np.sin(inside) / below + slope * (angles - inside)

    def _on_sphere(self, radii: FloatArray) -> FloatArray:
        """Inverse of `_off_sphere`."""
        edge = float(self._off_sphere(np.array(self.max_angle)))
        inside = np.minimum(radii, edge)
        # Of m (z + ξ) = sin θ and z² + sin² θ = 1 the solution on the eye's far side.
        root = np.sqrt(np.maximum(1.0 + (1.0 - self.xi**2) * inside**2, 0.0))
        lifted = (self.xi + root) / (1.0 + inside**2)
        angles = np.arctan2(lifted * inside, lifted - self.xi)
        slope = (1.0 + self.xi * math.cos(self.max_angle)) / (
            math.cos(self.max_angle) + self.xi
        ) ** 2
        return np.where(radii > edge, self.max_angle + (radii - inside) / slope, angles)

    def _distorted(self, radii: FloatArray) -> FloatArray:
        """|m'| of |m| without tangential distortion."""
        squared = radii * radii
        return radii * (1.0 + squared * (self.k1 + squared * (self.k2 + squared * self.k3)))

    def _moved(self, flat: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N, 2) m' of m, and its (N, 2, 2) derivative; beyond the edge along the edge's slope."""
        radius = np.hypot(flat[:, 0], flat[:, 1])
        edge = float(self._off_sphere(np.array(self.max_angle)))
        shrink = np.minimum(1.0, edge / np.maximum(radius, 1e-300))
        at, beyond = flat * shrink[:, None], flat * (1.0 - shrink)[:, None]
        x, y = at[:, 0], at[:, 1]
        squared = x * x + y * y
        gain = 1.0 + squared * (self.k1 + squared * (self.k2 + squared * self.k3))
        steep = 2.0 * (self.k1 + squared * (2.0 * self.k2 + squared * 3.0 * self.k3))
        moved = at * gain[:, None]
        moved[:, 0] += 2.0 * self.p1 * x * y + self.p2 * (squared + 2.0 * x * x)
        moved[:, 1] += self.p1 * (squared + 2.0 * y * y) + 2.0 * self.p2 * x * y
        slopes = np.empty((len(flat), 2, 2))
        slopes[:, 0, 0] = gain + steep * x * x + 2.0 * self.p1 * y + 6.0 * self.p2 * x
        slopes[:, 0, 1] = steep * x * y + 2.0 * self.p1 * x + 2.0 * self.p2 * y
        slopes[:, 1, 0] = slopes[:, 0, 1]
        slopes[:, 1, 1] = gain + steep * y * y + 6.0 * self.p1 * y + 2.0 * self.p2 * x
        return moved + np.einsum("nij,nj->ni", slopes, beyond), slopes

    def _undone(self, wanted: FloatArray) -> FloatArray:
        """(N, 2) m of m', by Newton's method."""
        edge = float(self._off_sphere(np.array(self.max_angle)))
        radii = np.linspace(0.0, edge, START_RADII)
        length = np.hypot(wanted[:, 0], wanted[:, 1])
        start = np.interp(length, self._distorted(radii), radii)
        flat = wanted * (start / np.maximum(length, 1e-300))[:, None]
        for _ in range(NEWTON_STEPS):
            moved, slopes = self._moved(flat)
            left = wanted - moved
            (a, b), (c, d) = slopes[:, 0].T, slopes[:, 1].T
            step = np.stack([d * left[:, 0] - b * left[:, 1], a * left[:, 1] - c * left[:, 0]], 1)
            step /= (a * d - b * c)[:, None]
            flat += step
            if float(np.abs(step).max(initial=0.0)) < SOLVED:
                break
        return flat

    def _foldless_angle(self) -> float:
        """The angle up to which the radius grows well, radians."""
        angles = np.linspace(0.0, math.pi, LIMIT_STEPS + 1)
        below = np.cos(angles) + self.xi
        over = np.sin(angles) / np.where(below > 1e-9, below, np.inf)
        slope = (1.0 + self.xi * np.cos(angles)) / np.where(below > 1e-9, below, np.inf) ** 2
        squared = over * over
        steep = 1.0 + squared * (3 * self.k1 + squared * (5 * self.k2 + squared * 7 * self.k3))
        growth = slope * steep
        folded = np.flatnonzero((growth < STEEPEST * growth[0]) | (over > FARTHEST))
        if not len(folded):
            return math.pi
        return float(angles[max(int(folded[0]) - 1, 1)])


@dataclass(frozen=True, slots=True)
class FisheyeFit:
    """A fisheye in place of another lens.

    Attributes:
        fisheye: for the renderer and the tracker.
        rms_px: root mean square distance of its pixels from the lens's own, over the lens circle.
        max_px: the largest.
    """

    fisheye: Fisheye
    rms_px: float
    max_px: float


def as_fisheye(lens: UnifiedSphere, *, max_angle: float = math.radians(100.0)) -> FisheyeFit:
    """The fisheye of four coefficients nearest to a lens, in px over the lens circle.

    A fisheye has one focal length and is round, so what stays is mainly the difference of fx and
    fy, and the tangential distortion.

    Args:
        lens: to be replaced.
        max_angle: half field of view that is needed, radians; lowered to what the lens shows.

    Raises:
        ValueError: no fisheye whose radius grows is near to it.
    """
    reach = min(max_angle, lens.max_angle)
    # Evenly over the picture's area: as many rings inwards as outwards.
    angles = reach * np.sqrt((np.arange(FIT_ANGLES) + 0.5) / FIT_ANGLES)
    turns = 2.0 * math.pi * (np.arange(FIT_TURNS) + 0.5) / FIT_TURNS
    angle, turn = (grid.ravel() for grid in np.meshgrid(angles, turns, indexing="ij"))
    around = np.column_stack([np.cos(turn), np.sin(turn)])
    rays = np.column_stack([around * np.sin(angle)[:, None], np.cos(angle)])
    pixels, _ = lens.project(rays)
    # u = c + Σ a_n θ^(2n+1) · around is linear in c and a; scaled angles keep it well conditioned.
    powers = (angle / reach)[:, None] ** (2 * np.arange(5) + 1)
    columns = [powers * around[:, [axis]] for axis in range(2)]
    ones, none = np.ones((len(angle), 1)), np.zeros((len(angle), 1))
    design = np.concatenate(
        [np.hstack([columns[0], ones, none]), np.hstack([columns[1], none, ones])]
    )
    found = np.linalg.lstsq(design, pixels.T.ravel(), rcond=None)[0]
    scaled = found[:5] / reach ** (2 * np.arange(5) + 1)
    k = scaled[1:] / scaled[0]
    fisheye = Fisheye(
        lens.width_px,
        lens.height_px,
        f_px=float(scaled[0]),
        cx=float(found[5]),
        cy=float(found[6]),
        max_angle=reach,
        distortion=(float(k[0]), float(k[1]), float(k[2]), float(k[3])),
    )
    apart: FloatArray = fisheye.project(rays)[0] - pixels
    left = np.hypot(apart[:, 0], apart[:, 1])
    return FisheyeFit(fisheye, math.sqrt(float(np.mean(left**2))), float(left.max()))


def lens_to_json(lens: Pinhole | Fisheye | UnifiedSphere) -> dict[str, Any]:
    """Plain values for files and messages; angles in radians, lengths in pixels."""
    if not isinstance(lens, UnifiedSphere):
        return camera_to_json(lens)
    return {"model": MODEL, **{field.name: getattr(lens, field.name) for field in fields(lens)}}


def lens_from_json(values: dict[str, Any]) -> Pinhole | Fisheye | UnifiedSphere:
    """Inverse of `lens_to_json`.

    Raises:
        ValueError: the model is unknown, a field is missing or a value is out of range.
    """
    if values.get("model") != MODEL:
        return camera_from_json(values)
    given = {name: value for name, value in values.items() if name != "model"}
    try:
        return UnifiedSphere(**given)
    except TypeError as error:
        raise ValueError(f"lens {values}: {error}") from None
