"""Camera models. Rays and points are in OpenCV camera axes; pixels are (x, y), first centre 0.5.

A pixel coordinate (0.5, 0.5) is the centre of the top-left pixel, as in COLMAP.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.pose import Pose

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Camera(Protocol):
    """Camera model: projection and rays. Sizes in pixels."""

    @property
    def width_px(self) -> int:
        """Image width."""
        ...

    @property
    def height_px(self) -> int:
        """Image height."""
        ...

    def project(self, points: ArrayLike) -> tuple[FloatArray, BoolArray]:
        """(N, 3) points in the camera frame -> (N, 2) pixels and (N,) valid."""
        ...

    def unproject(self, pixels: ArrayLike) -> FloatArray:
        """(N, 2) pixels -> (N, 3) unit rays in the camera frame."""
        ...


def _check_size(name: str, width_px: int, height_px: int) -> None:
    if width_px < 1 or height_px < 1:
        raise ValueError(f"{name}: size {width_px}×{height_px} px, wanted at least 1×1")


def _check_focal(name: str, *focals: float) -> None:
    if not all(math.isfinite(f) and f > 0 for f in focals):
        raise ValueError(f"{name}: focal length {focals} px, wanted finite and > 0")


@dataclass(frozen=True, slots=True)
class Pinhole:
    """Perspective camera without distortion: u = fx x/z + cx.

    Raises:
        ValueError: the size or a focal length is not positive.
    """

    width_px: int
    height_px: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        _check_size("Pinhole", self.width_px, self.height_px)
        _check_focal("Pinhole", self.fx, self.fy)

    @staticmethod
    def from_fov(width_px: int, height_px: int, horizontal_fov: float) -> Pinhole:
        """Square pixels, centred; `horizontal_fov` in radians, below π."""
        if not 0 < horizontal_fov < math.pi:
            raise ValueError(f"Pinhole: field of view {horizontal_fov} rad, wanted 0..π exclusive")
        f = 0.5 * width_px / math.tan(0.5 * horizontal_fov)
        return Pinhole(width_px, height_px, f, f, 0.5 * width_px, 0.5 * height_px)

    def project(self, points: ArrayLike) -> tuple[FloatArray, BoolArray]:
        """(N, 3) camera points -> (N, 2) px, (N,) valid: in front and inside the image."""
        p = np.atleast_2d(np.asarray(points, dtype=np.float64))
        in_front = p[:, 2] > 1e-9
        z = np.where(in_front, p[:, 2], 1.0)
        pixels = np.stack(
            [self.fx * p[:, 0] / z + self.cx, self.fy * p[:, 1] / z + self.cy], axis=1
        )
        return pixels, in_front & _inside(pixels, self.width_px, self.height_px)

    def unproject(self, pixels: ArrayLike) -> FloatArray:
        """(N, 2) px -> (N, 3) unit rays."""
        p = np.atleast_2d(np.asarray(pixels, dtype=np.float64))
        rays = np.stack(
            [(p[:, 0] - self.cx) / self.fx, (p[:, 1] - self.cy) / self.fy, np.ones(len(p))], axis=1
        )
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def opencv_matrix(self) -> FloatArray:
        """(3, 3) camera matrix as OpenCV and Open3D have it: whole numbers are pixel centres."""
        cx, cy = self.cx - 0.5, self.cy - 0.5
        return np.array([[self.fx, 0.0, cx], [0.0, self.fy, cy], [0.0, 0.0, 1.0]])


NO_DISTORTION = (0.0, 0.0, 0.0, 0.0)
"""Coefficients of an equidistant fisheye."""


@dataclass(frozen=True, slots=True)
class Fisheye:
    """Fisheye r = f·d(θ), d = θ + k1·θ³ + k2·θ⁵ + k3·θ⁷ + k4·θ⁹, valid beyond 90° off axis.

    Without coefficients it is equidistant, r = f·θ (paper eq. 1); with them it is the model of
    Kannala & Brandt 2006, "A generic camera model", as in OpenCV and COLMAP. Beyond `max_angle`
    d goes on along its tangent, so that what lies just outside the lens still has a place.

    Attributes:
        f_px: pixels per radian on the axis.
        max_angle: half field of view in radians, at most π.
        distortion: k1 to k4.

    Raises:
        ValueError: a size, focal length or angle is out of range, or d does not grow with θ.
    """

    width_px: int
    height_px: int
    f_px: float
    cx: float
    cy: float
    max_angle: float
    distortion: tuple[float, float, float, float] = NO_DISTORTION

    def __post_init__(self) -> None:
        _check_size("Fisheye", self.width_px, self.height_px)
        _check_focal("Fisheye", self.f_px)
        if not 0 < self.max_angle <= math.pi:
            raise ValueError(f"Fisheye.max_angle: {self.max_angle} rad, wanted 0 < angle <= π")
        if len(self.distortion) != 4 or not all(math.isfinite(k) for k in self.distortion):
            raise ValueError(f"Fisheye.distortion: {self.distortion}, wanted four finite numbers")
        turn = _first_turn(self.distortion)
        if turn <= self.max_angle:
            raise ValueError(
                f"Fisheye.distortion: with {self.distortion} the picture folds back {turn:.4f} rad "
                f"off axis, wanted radii that grow up to max_angle, {self.max_angle:.4f} rad: "
                "give a smaller max_angle or other coefficients"
            )

    @staticmethod
    def from_fov(size_px: int, fov: float) -> Fisheye:
        """Square equidistant lens image whose circle of `fov` radians touches the border."""
        half = 0.5 * size_px
        return Fisheye(size_px, size_px, size_px / fov, half, half, 0.5 * fov)

    @property
    def is_equidistant(self) -> bool:
        """Whether all coefficients are 0."""
        return not any(self.distortion)

    @property
    def circle_px(self) -> float:
        """Radius of the lens circle."""
        return float(self.radius_px(np.array(self.max_angle)))

    def resized(self, width_px: int, height_px: int) -> Fisheye:
        """The same lens on a picture of another size; the width sets the scale."""
        scale = width_px / self.width_px
        return replace(
            self,
            width_px=width_px,
            height_px=height_px,
            f_px=self.f_px * scale,
            cx=self.cx * scale,
            cy=self.cy * scale,
        )

    def radius_px(self, angles: FloatArray) -> FloatArray:
        """Distance from the picture's centre at angles off axis, radians."""
        return self.f_px * self._growth(angles)

    def radius_slope(self, angles: FloatArray) -> FloatArray:
        """d'(θ): growth of the radius over that on the axis."""
        powers = _slope_coefficients(self.distortion)
        return _in_squares(powers, np.minimum(angles, self.max_angle))

    def radius_bend(self, angles: FloatArray) -> FloatArray:
        """d''(θ), 1/rad; 0 beyond `max_angle`, where the radius goes on along its tangent."""
        powers = [2 * n * k for n, k in enumerate(_slope_coefficients(self.distortion)) if n]
        bend = angles * _in_squares(powers, angles)
        return np.where(angles <= self.max_angle, bend, 0.0)

    def _growth(self, angles: FloatArray) -> FloatArray:
        """The radius over the focal length, d(θ)."""
        if self.is_equidistant:
            return angles
        inside = np.minimum(angles, self.max_angle)
        beyond = self.radius_slope(angles) * (angles - inside)
        return inside * _in_squares((1.0, *self.distortion), inside) + beyond

    def angles_at(self, radii_px: FloatArray) -> FloatArray:
        """Inverse of `radius_px`."""
        return self._inverse_growth(np.asarray(radii_px, dtype=np.float64) / self.f_px)

    def _inverse_growth(self, wanted: FloatArray) -> FloatArray:
        """The angles of values of d, by Newton's method kept between bounds; to 1e-12 rad."""
        if self.is_equidistant:
            return wanted
        low, high = np.zeros_like(wanted), np.full_like(wanted, self.max_angle)
        angles = np.clip(wanted, 0.0, self.max_angle)
        for _ in range(60):
            error = self._growth(angles) - wanted
            low, high = np.where(error < 0, angles, low), np.where(error > 0, angles, high)
            step = angles - error / self.radius_slope(angles)
            # A step out of the bounds is replaced by halving them.
            following = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
            is_done = bool(np.all(np.abs(following - angles) < 1e-14))
            angles = following
            if is_done:
                break
        edge = self.circle_px / self.f_px
        slope = float(self.radius_slope(np.array(self.max_angle)))
        return np.where(wanted > edge, self.max_angle + (wanted - edge) / slope, angles)

    def project(self, points: ArrayLike) -> tuple[FloatArray, BoolArray]:
        """(N, 3) camera points -> (N, 2) px, (N,) valid: inside the lens circle and the image."""
        p = np.atleast_2d(np.asarray(points, dtype=np.float64))
        off_axis = np.hypot(p[:, 0], p[:, 1])
        theta = np.arctan2(off_axis, p[:, 2])
        growth = self._growth(theta)
        per_off_axis = np.where(off_axis > 1e-12, growth / np.maximum(off_axis, 1e-12), 0.0)
        gain = self.f_px * per_off_axis
        pixels = np.stack([gain * p[:, 0] + self.cx, gain * p[:, 1] + self.cy], axis=1)
        valid = (theta <= self.max_angle) & (np.linalg.norm(p, axis=1) > 1e-9)
        return pixels, valid & _inside(pixels, self.width_px, self.height_px)

    def unproject(self, pixels: ArrayLike) -> FloatArray:
        """(N, 2) px -> (N, 3) unit rays."""
        p = np.atleast_2d(np.asarray(pixels, dtype=np.float64))
        x, y = (p[:, 0] - self.cx) / self.f_px, (p[:, 1] - self.cy) / self.f_px
        radius = np.hypot(x, y)
        theta = self._inverse_growth(radius)
        sine_per_radius = np.asarray(np.sinc(theta / np.pi), dtype=np.float64)
        if not self.is_equidistant:
            sine_per_radius *= theta / np.where(radius > 0, radius, 1.0)
        rays = np.stack([x * sine_per_radius, y * sine_per_radius, np.cos(theta)], axis=1)
        return np.asarray(rays, dtype=np.float64)


def _in_squares(coefficients: Sequence[float], angles: FloatArray) -> FloatArray:
    """The polynomial c0 + c1·θ² + c2·θ⁴ and so on."""
    values = np.polynomial.polynomial.polyval(angles * angles, coefficients)
    return np.asarray(values, dtype=np.float64)


def _slope_coefficients(distortion: Sequence[float]) -> list[float]:
    """c0 to c4 of d'(θ) = c0 + c1·θ² + c2·θ⁴ and so on."""
    return [(2 * n + 1) * k for n, k in enumerate((1.0, *distortion))]


@lru_cache(maxsize=64)
def _first_turn(distortion: tuple[float, float, float, float]) -> float:
    """The smallest angle at which d(θ) stops growing, radians; inf if there is none.

    Remembered: a window's camera is made many times a picture, always of the same lens.
    """
    if not any(distortion):
        return math.inf
    slopes = np.array(_slope_coefficients(distortion))
    # What is too small to matter up to π would only spoil the roots.
    slopes[np.abs(slopes) * math.pi ** (2 * np.arange(5)) < 1e-12] = 0.0
    last = int(np.flatnonzero(slopes)[-1])
    squares = np.asarray(
        np.polynomial.polynomial.polyroots(slopes[: last + 1]), dtype=np.complex128
    )
    real = squares.real[(np.abs(squares.imag) <= 1e-9 * np.abs(squares)) & (squares.real > 0)]
    return float(np.sqrt(real.min())) if len(real) else math.inf


@dataclass(frozen=True, slots=True)
class Rig:
    """Several lenses on one rigid body; a 360° camera has a front and a back fisheye.

    Attributes:
        lenses: one camera per lens.
        rig_from_lens: one pose per lens; the rig's axes are the front lens's (OpenCV).
    """

    lenses: tuple[Fisheye, ...]
    rig_from_lens: tuple[Pose, ...]

    def __post_init__(self) -> None:
        if len(self.lenses) != len(self.rig_from_lens) or not self.lenses:
            raise ValueError(
                f"Rig: {len(self.lenses)} lenses and {len(self.rig_from_lens)} poses, "
                "wanted as many poses as lenses and at least one"
            )


def pixel_centres(camera: Camera) -> FloatArray:
    """(H·W, 2) pixel centres in row-major order."""
    columns = np.arange(camera.width_px, dtype=np.float64) + 0.5
    rows = np.arange(camera.height_px, dtype=np.float64) + 0.5
    x, y = np.meshgrid(columns, rows)
    return np.asarray(np.stack([x.ravel(), y.ravel()], axis=1), dtype=np.float64)


def camera_to_json(camera: Pinhole | Fisheye) -> dict[str, Any]:
    """Plain values for files and messages; angles in radians, lengths in pixels."""
    size = {"width_px": camera.width_px, "height_px": camera.height_px}
    if isinstance(camera, Pinhole):
        k = {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
        return {"model": "pinhole", **size, **k}
    k = {"f_px": camera.f_px, "cx": camera.cx, "cy": camera.cy, "max_angle": camera.max_angle}
    if camera.is_equidistant:
        return {"model": "equidistant", **size, **k}
    return {"model": "kannala_brandt", **size, **k, "distortion": list(camera.distortion)}


def camera_from_json(values: dict[str, Any]) -> Pinhole | Fisheye:
    """Inverse of `camera_to_json`.

    Raises:
        ValueError: the model is unknown or a field is missing.
    """
    fields = dict(values)
    model = fields.pop("model", None)
    kinds: dict[str, type[Pinhole] | type[Fisheye]] = {
        "pinhole": Pinhole,
        "equidistant": Fisheye,
        "kannala_brandt": Fisheye,
    }
    if model not in kinds:
        raise ValueError(f"camera model {model!r}: wanted one of {sorted(kinds)}")
    if "distortion" in fields:
        fields["distortion"] = tuple(fields["distortion"])
    try:
        return kinds[model](**fields)
    except TypeError as error:
        raise ValueError(f"camera {values}: {error}") from None


def rig_to_json(rig: Rig) -> dict[str, Any]:
    """Plain values: lenses and `rig_from_lens` as wxyz quaternion + translation in metres."""
    return {
        "lenses": [camera_to_json(lens) for lens in rig.lenses],
        "rig_from_lens": [
            {"wxyz": pose.quaternion().tolist(), "translation": pose.translation.tolist()}
            for pose in rig.rig_from_lens
        ],
    }


def rig_from_json(values: dict[str, Any]) -> Rig:
    """Inverse of `rig_to_json`.

    Raises:
        ValueError: a field is missing or a lens is not a fisheye.
    """
    try:
        lenses = [camera_from_json(lens) for lens in values["lenses"]]
        poses = [Pose.from_quaternion(p["wxyz"], p["translation"]) for p in values["rig_from_lens"]]
    except KeyError as error:
        raise ValueError(f"rig: field {error} is missing") from None
    fisheyes = tuple(lens for lens in lenses if isinstance(lens, Fisheye))
    if len(fisheyes) != len(lenses):
        raise ValueError("rig: every lens must be a fisheye")
    return Rig(fisheyes, tuple(poses))


def _inside(pixels: FloatArray, width_px: int, height_px: int) -> BoolArray:
    x, y = pixels[:, 0], pixels[:, 1]
    return (x >= 0) & (x <= width_px) & (y >= 0) & (y <= height_px)
