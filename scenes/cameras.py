"""Camera models. Rays and points are in OpenCV camera axes; pixels are (x, y), first centre 0.5.

A pixel coordinate (0.5, 0.5) is the centre of the top-left pixel, as in COLMAP.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scenes.pose import Pose

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Camera(Protocol):
    """What every camera model can do. Sizes in pixels."""

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


@dataclass(frozen=True, slots=True)
class Fisheye:
    """Equidistant fisheye, r = f·θ (paper eq. 1), valid beyond 90° off axis.

    Attributes:
        f_px: pixels per radian.
        max_angle: half field of view in radians, at most π.

    Raises:
        ValueError: a size, focal length or angle is out of range.
    """

    width_px: int
    height_px: int
    f_px: float
    cx: float
    cy: float
    max_angle: float

    def __post_init__(self) -> None:
        _check_size("Fisheye", self.width_px, self.height_px)
        _check_focal("Fisheye", self.f_px)
        if not 0 < self.max_angle <= math.pi:
            raise ValueError(f"Fisheye.max_angle: {self.max_angle} rad, wanted 0 < angle <= π")

    @staticmethod
    def from_fov(size_px: int, fov: float) -> Fisheye:
        """Square lens image whose circle of `fov` radians touches the border."""
        half = 0.5 * size_px
        return Fisheye(size_px, size_px, size_px / fov, half, half, 0.5 * fov)

    def project(self, points: ArrayLike) -> tuple[FloatArray, BoolArray]:
        """(N, 3) camera points -> (N, 2) px, (N,) valid: inside the lens circle and the image."""
        p = np.atleast_2d(np.asarray(points, dtype=np.float64))
        off_axis = np.hypot(p[:, 0], p[:, 1])
        theta = np.arctan2(off_axis, p[:, 2])
        r_per_off_axis = np.where(off_axis > 1e-12, theta / np.maximum(off_axis, 1e-12), 0.0)
        pixels = np.stack(
            [
                self.f_px * r_per_off_axis * p[:, 0] + self.cx,
                self.f_px * r_per_off_axis * p[:, 1] + self.cy,
            ],
            axis=1,
        )
        valid = (theta <= self.max_angle) & (np.linalg.norm(p, axis=1) > 1e-9)
        return pixels, valid & _inside(pixels, self.width_px, self.height_px)

    def unproject(self, pixels: ArrayLike) -> FloatArray:
        """(N, 2) px -> (N, 3) unit rays."""
        p = np.atleast_2d(np.asarray(pixels, dtype=np.float64))
        x, y = (p[:, 0] - self.cx) / self.f_px, (p[:, 1] - self.cy) / self.f_px
        theta = np.hypot(x, y)
        sine_per_theta = np.asarray(np.sinc(theta / np.pi), dtype=np.float64)
        rays = np.stack([x * sine_per_theta, y * sine_per_theta, np.cos(theta)], axis=1)
        return np.asarray(rays, dtype=np.float64)


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
    return {"model": "equidistant", **size, **k}


def camera_from_json(values: dict[str, Any]) -> Pinhole | Fisheye:
    """Inverse of `camera_to_json`.

    Raises:
        ValueError: the model is unknown or a field is missing.
    """
    fields = dict(values)
    model = fields.pop("model", None)
    kinds: dict[str, type[Pinhole] | type[Fisheye]] = {"pinhole": Pinhole, "equidistant": Fisheye}
    if model not in kinds:
        raise ValueError(f"camera model {model!r}: wanted one of {sorted(kinds)}")
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
        raise ValueError("rig: every lens must be an equidistant fisheye")
    return Rig(fisheyes, tuple(poses))


def _inside(pixels: FloatArray, width_px: int, height_px: int) -> BoolArray:
    x, y = pixels[:, 0], pixels[:, 1]
    return (x >= 0) & (x <= width_px) & (y >= 0) & (y <= height_px)
