"""The lens that a `transforms.json` describes, and pictures without its distortion.

Sources of the keys: nerfstudio's "Data conventions" page and its camera models; instant-ngp's
`nerf_loader.cu`; COLMAP's camera models.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Pinhole

SIZE_TOLERANCE = 0.01
"""Relative difference of two aspect ratios up to which they are the same."""
FISHEYE_MODELS = frozenset(
    {"OPENCV_FISHEYE", "FISHEYE", "RADIAL_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "KANNALA_BRANDT"}
)
"""All of them the angle's polynomial of Kannala and Brandt, with one to four coefficients."""
PERSPECTIVE_MODELS = frozenset(
    {"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE", ""}
)
RATIONAL_MODELS = frozenset({"FULL_OPENCV"})
MODELS = FISHEYE_MODELS | PERSPECTIVE_MODELS | RATIONAL_MODELS

FISHEYE_KEYS = ("k1", "k2", "k3", "k4")
PERSPECTIVE_KEYS = ("k1", "k2", "p1", "p2", "k3")
RATIONAL_KEYS = (*PERSPECTIVE_KEYS, "k4", "k5", "k6")
IS_FISHEYE = "is_fisheye"
READ_KEYS = frozenset(
    {"camera_model", IS_FISHEYE, "w", "h", "fl_x", "fl_y", "cx", "cy"}
    | {"camera_angle_x", "camera_angle_y", "x_fov", "y_fov"}
)
HARMLESS_KEYS = frozenset(
    {
        "aabb_scale",
        "applied_scale",
        "applied_transform",
        "auto_scale_poses_override",
        "colmap_im_id",
        "depth_file_path",
        "depth_path",
        "enable_depth_loading",
        "fisheye_crop_radius",
        "from_na",
        "integer_depth_scale",
        "n_extra_learnable_dims",
        "offset",
        "orientation_override",
        "ply_file_path",
        "render_aabb",
        "scale",
        "sharpness",
        "test_filenames",
        "timestamp",
        "train_filenames",
        "up",
        "val_filenames",
    }
)
"""Of other programs' training and of the pictures' order; poses and lens do not depend on them."""
LENS_LIKE = re.compile(
    r"^[kpsb]\d+$|^(xi|alpha|beta|skew)$|fish|lens|distort|project|theta|camera_(model|type|mode)"
    r"|radial|tangential|prism|lat_?long|equirect|spheric|omni|panoram|vr180",
    re.IGNORECASE,
)
"""Names under which programs describe a lens."""
OFF = frozenset({"", "none", "false", "no", "0"})


class LensError(ValueError):
    """The lens cannot be taken from the file.

    Attributes:
        what: is wrong.
        remedy: what to do.
    """

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"{what}; {remedy}")
        self.what = what
        self.remedy = remedy


@dataclass(frozen=True, slots=True)
class Distorted:
    """A camera as the file gives it.

    Attributes:
        camera: its pinhole part.
        coefficients: k1, k2, p1, p2, k3 (and k4, k5, k6) of OpenCV, or k1..k4 of its fisheye model.
        fisheye: which of the two.
    """

    camera: Pinhole
    coefficients: tuple[float, ...]
    fisheye: bool


def lens_of(values: Mapping[str, Any], picture: NDArray[np.uint8]) -> Distorted:
    """The camera of one frame, scaled to the picture that is there.

    Args:
        values: the file's keys, the frame's over them.
        picture: (H, W, 3).

    Raises:
        LensError: a value is missing or makes no sense, the picture has another shape, or the lens
            is described in a way that is not understood.
    """
    keys, fisheye = _model(values)
    coefficients = tuple(_number(values, key, 0.0) or 0.0 for key in keys)
    _refuse_unread(values, {*READ_KEYS, *keys})
    height, width = picture.shape[:2]
    size = stated_size(values)
    if size is not None and not fits(picture, size):
        raise LensError(
            f"the picture is {width}×{height} px, the file says {size[0]:g}×{size[1]:g}",
            "give the pictures that the poses were found with",
        )
    told_width, told_height = size or (float(width), float(height))
    scale = width / told_width
    fx, fy = (
        _focal(values, "x", told_width),
        _focal(values, "y", told_height),
    )
    if fx is None and fy is None:
        raise LensError("neither fl_x nor camera_angle_x is given", "export it with intrinsics")
    fx, fy = fx or fy or 0.0, fy or fx or 0.0
    cx, cy = _number(values, "cx", told_width / 2), _number(values, "cy", told_height / 2)
    camera = Pinhole(
        width, height, fx * scale, fy * scale, (cx or 0.0) * scale, (cy or 0.0) * scale
    )
    return Distorted(camera, coefficients, fisheye)


def stated_size(values: Mapping[str, Any]) -> tuple[float, float] | None:
    """Width and height of a frame's picture, where the file gives both.

    Raises:
        LensError: one of them is no positive number.
    """
    size = _number(values, "w"), _number(values, "h")
    if size[0] is None or size[1] is None:
        return None
    if min(size[0], size[1]) <= 0:
        raise LensError(
            f"the file says its pictures have {size[0]:g}×{size[1]:g} px",
            "export it from the app again",
        )
    return size[0], size[1]


def fits(picture: NDArray[np.uint8], size: tuple[float, float]) -> bool:
    """Whether a picture has the shape of that size, whatever its resolution."""
    height, width = picture.shape[:2]
    return abs(size[1] * width / size[0] - height) <= SIZE_TOLERANCE * height


def ignored_keys(keys: Iterable[str]) -> tuple[str, ...]:
    """Those of a file's keys that nothing is known of."""
    known = READ_KEYS | HARMLESS_KEYS | {*RATIONAL_KEYS}
    return tuple(sorted(key for key in keys if key not in known and not LENS_LIKE.search(key)))


def pinhole_picture(
    picture: NDArray[np.uint8], lens: Distorted
) -> tuple[NDArray[np.uint8], Pinhole]:
    """The picture as a pinhole of that focal length would have taken it; border pixels repeat."""
    if not lens.fisheye and not any(lens.coefficients):
        return picture, lens.camera
    c = lens.camera
    matrix = c.opencv_matrix()
    maps = (cv2.fisheye if lens.fisheye else cv2).initUndistortRectifyMap(
        matrix,
        np.array(lens.coefficients),
        np.eye(3),
        matrix,
        (c.width_px, c.height_px),
        cv2.CV_32FC1,
    )
    flat = cv2.remap(picture, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(flat, dtype=np.uint8), c


def _model(values: Mapping[str, Any]) -> tuple[tuple[str, ...], bool]:
    """The coefficients that count, and whether they are a fisheye's."""
    stated = values.get("camera_model")
    model = "" if stated is None else str(stated)
    if model.upper() not in MODELS:
        raise LensError(f"camera_model {model!r} is not supported", "export pinhole pictures")
    is_fisheye = _is_on(values.get(IS_FISHEYE))
    if is_fisheye and model and model.upper() not in FISHEYE_MODELS:
        raise LensError(
            f"camera_model {model!r} and {IS_FISHEYE} contradict each other",
            "take out the one that is wrong; a fisheye's camera_model is OPENCV_FISHEYE",
        )
    if is_fisheye or model.upper() in FISHEYE_MODELS:
        return FISHEYE_KEYS, True
    return (RATIONAL_KEYS if model.upper() in RATIONAL_MODELS else PERSPECTIVE_KEYS), False


def _refuse_unread(values: Mapping[str, Any], read: set[str]) -> None:
    """A key that seems to describe the lens, and is neither read nor zero, is no small matter."""
    for key, value in values.items():
        if key in read or key in HARMLESS_KEYS or not LENS_LIKE.search(key):
            continue
        is_plain = isinstance(value, str) and value.upper() in PERSPECTIVE_MODELS
        if _is_on(value) and not is_plain:
            raise LensError(
                f"{key} is {value!r}, which seems to describe the lens and is not understood",
                "export pinhole pictures, or take the key out if it has nothing to do with the "
                "lens",
            )


def _is_on(value: Any) -> bool:
    if isinstance(value, str):
        return value.strip().lower() not in OFF
    if isinstance(value, Mapping):
        return any(_is_on(part) for part in cast("Mapping[str, Any]", value).values())
    if isinstance(value, list | tuple):
        return any(_is_on(part) for part in cast("list[Any]", value))
    return bool(value)


def _focal(values: Mapping[str, Any], axis: str, extent: float) -> float | None:
    """Focal length along an axis in pixels, from a length or an angle."""
    key = f"fl_{axis}"
    focal = _number(values, key)
    if focal is None:
        angle = _number(values, f"camera_angle_{axis}")
        degrees = _number(values, f"{axis}_fov")
        if angle is None and degrees is not None:
            angle = math.radians(degrees)
        if angle is None or not 0 < angle < math.pi:
            return None
        return 0.5 * extent / math.tan(0.5 * angle)
    if focal <= 0:
        raise LensError(f"{key} is {focal:g}", "wanted a positive number of pixels")
    return focal


def _number(values: Mapping[str, Any], key: str, default: float | None = None) -> float | None:
    value = values.get(key, default)
    if value is None:
        return default
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise LensError(f"{key} is {value!r}", "wanted a finite number")
    return float(value)
