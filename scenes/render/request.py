# pyright: standard
"""Checks of every renderer's arguments, and their messages."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from scenes.cameras import Fisheye, Pinhole
from scenes.render.renderer import PosedSplats, RenderOptions, tiles_of
from scenes.splats import SH_COUNTS, SplatCloud

MAX_THREADS = 256
"""Threads of a rendering."""
MAX_SIDE_PX = 32_768
"""Sides of a picture, px."""
MAX_BACKGROUND = 1e15
"""Gradients are products of colours, which must stay within float32."""
FOCAL_PX = (1e-3, 1e7)
MAX_CENTRE_PX = 1e7
"""Beyond these float32 holds neither the squares of a picture's slopes nor single pixels."""


def check_request(
    objects: Sequence[PosedSplats], camera: Pinhole | Fisheye, options: RenderOptions
) -> None:
    """Refuse what no renderer can draw.

    Raises:
        TypeError: an object or the camera is of the wrong type.
        ValueError: names the argument, what it got and what it wants.
    """
    for index, posed in enumerate(objects):
        check_is_posed(posed, index)
        check_cloud(posed.cloud, index)
    check_view(camera, options)


def check_is_posed(posed: object, index: int) -> None:
    """Refuse what is no posed cloud, as `objects[index]`.

    Raises:
        TypeError: names the argument, what it got and what it wants.
    """
    if not isinstance(posed, PosedSplats):
        raise TypeError(f"objects[{index}]: got {type(posed).__name__}, wanted PosedSplats")


def check_view(camera: Pinhole | Fisheye, options: RenderOptions) -> None:
    """Refuse cameras and options that no renderer can draw with.

    Raises:
        TypeError: the camera is of the wrong type.
        ValueError: names the argument, what it got and what it wants.
    """
    if not isinstance(camera, (Pinhole, Fisheye)):
        raise TypeError(f"camera: got {type(camera).__name__}, wanted Pinhole or Fisheye")
    if max(camera.width_px, camera.height_px) > MAX_SIDE_PX:
        raise ValueError(
            f"camera: {camera.width_px}×{camera.height_px} px, "
            f"wanted at most {MAX_SIDE_PX} each way"
        )
    _check_lens(camera)
    _check_options(options)
    _check_background(options, camera)
    _check_scope(options, camera)


def _check_lens(camera: Pinhole | Fisheye) -> None:
    focals = (camera.f_px,) if isinstance(camera, Fisheye) else (camera.fx, camera.fy)
    shortest, longest = FOCAL_PX
    if not all(shortest <= focal <= longest for focal in focals):
        raise ValueError(f"camera: focal length {focals} px, wanted {shortest:g} to {longest:g} px")
    if not (abs(camera.cx) <= MAX_CENTRE_PX and abs(camera.cy) <= MAX_CENTRE_PX):
        raise ValueError(
            f"camera: centre ({camera.cx}, {camera.cy}) px, wanted finite numbers of at most "
            f"{MAX_CENTRE_PX:g} px"
        )


def check_cloud(cloud: SplatCloud, index: int) -> None:
    """Refuse a cloud whose arrays do not belong together, as `objects[index].cloud`.

    Raises:
        ValueError: names the array, what it got and what it wants.
    """
    n = len(cloud.means)
    wanted: dict[str, tuple[int | str, ...]] = {
        "means": (n, 3),
        "scales": (n, 3),
        "rotations": (n, 4),
        "opacities": (n,),
        "sh": (n, "1, 4, 9 or 16", 3),
    }
    for name, shape in wanted.items():
        array = getattr(cloud, name)
        fits = (
            isinstance(array, np.ndarray)
            and array.dtype == np.float32
            and array.flags.c_contiguous
            and array.ndim == len(shape)
            and all(
                size == want if isinstance(want, int) else size in SH_COUNTS
                for size, want in zip(array.shape, shape, strict=True)
            )
        )
        if not fits:
            sizes = ", ".join(str(size) for size in shape)
            raise ValueError(
                f"objects[{index}].cloud.{name}: got {described(array)}, "
                f"wanted contiguous float32 ({sizes})"
            )


def _check_options(options: RenderOptions) -> None:
    if options.sh_degree not in (0, 1, 2, 3):
        raise ValueError(f"options.sh_degree: got {options.sh_degree}, wanted 0, 1, 2 or 3")
    if not (math.isfinite(options.near_m) and options.near_m > 0):
        raise ValueError(f"options.near_m: got {options.near_m}, wanted finite and above 0 m")
    if not options.exact_above_rad > 0:
        raise ValueError(
            f"options.exact_above_rad: got {options.exact_above_rad}, wanted above 0 rad, or inf"
        )
    if not 0 <= options.threads <= MAX_THREADS:
        raise ValueError(f"options.threads: got {options.threads}, wanted 0 (all) to {MAX_THREADS}")


def _check_background(options: RenderOptions, camera: Pinhole | Fisheye) -> None:
    background = options.background
    if not isinstance(background, np.ndarray):
        if len(background) != 3 or not all(abs(v) <= MAX_BACKGROUND for v in background):
            raise ValueError(
                f"options.background: got {background}, wanted three finite numbers of at most "
                f"{MAX_BACKGROUND:g}"
            )
        return
    shape = (camera.height_px, camera.width_px, 3)
    if background.dtype != np.float32 or background.shape != shape:
        raise ValueError(
            f"options.background: got {described(background)}, wanted float32 {shape} or a colour"
        )
    is_bad = ~(np.abs(background) <= MAX_BACKGROUND)
    if is_bad.any():
        raise ValueError(
            f"options.background: got {is_bad.sum()} of {background.size} values not finite or "
            f"beyond {MAX_BACKGROUND:g}, wanted none"
        )


def _check_scope(options: RenderOptions, camera: Pinhole | Fisheye) -> None:
    region, mask = options.region, options.tile_mask
    if region is not None:
        is_whole = len(region) == 4 and all(isinstance(v, (int, np.integer)) for v in region)
        fits = is_whole and (
            min(region[:2]) >= 0
            and min(region[2:]) >= 1
            and region[0] + region[2] <= camera.width_px
            and region[1] + region[3] <= camera.height_px
        )
        if not fits:
            raise ValueError(
                f"options.region: got {region}, wanted whole (left, top, width, height) of at "
                f"least 1×1 px within {camera.width_px}×{camera.height_px} px"
            )
    if mask is not None and not (
        isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == tiles_of(camera)
    ):
        raise ValueError(
            f"options.tile_mask: got {described(mask)}, wanted bool {tiles_of(camera)}"
        )


def refuse_parts(options: RenderOptions, reason: str) -> None:
    """Refuse a region or a tile mask, saying why."""
    if options.region is not None or options.tile_mask is not None:
        raise ValueError(f"options: got a region or a tile_mask, wanted none: {reason}")


def refuse_exact(options: RenderOptions, reason: str) -> None:
    """Refuse to draw wide splats exactly, saying why."""
    if math.isfinite(options.exact_above_rad):
        raise ValueError(
            f"options.exact_above_rad: got {options.exact_above_rad}, wanted inf: {reason}"
        )


def described(value: object) -> str:
    """Describe an argument for messages: dtype and shape, or its type."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape}"
    return type(value).__name__
