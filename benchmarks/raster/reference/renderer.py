# pyright: standard
"""The reference renderer: the definition of a picture in readable float64, and the tests' oracle.

Each splat is projected by EWA (Zwicker et al. 2001, "EWA volume splatting") and blended into every
pixel of its footprint, nearest first. It follows `scenes.render.renderer`, and decides beyond it:

- A pinhole's Jacobian is frozen beyond 15 % of the picture's size outside its border.
- A fisheye draws nothing outside its lens circle (`max_angle`): background, alpha 0. Splats
  whose centre lies further than 1.15 · `max_angle` off axis, or within 0.05 rad of straight behind,
  are skipped, unless they are wide.
- Splats deeper than 1e15 m are skipped: sums of such depths overflow float32.
- The order is that of depth rounded to float32; ties go by object, then by place in the cloud.
- Colours are clamped below at 0, before blending; opacities above 1 count as 1.
- The splat that takes a pixel's transmittance below the stop is the last one blended there.
- `ids` holds the object of the single splat with the largest blend weight, the first of equals.
- Damaged splats are left out: a value that is not finite, a scale that is not positive, a
  quaternion of zeros, a mean beyond 1000 km, a scale beyond 10 km or a coefficient beyond 1e15.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.raster.reference.projection import focal_px, project
from scenes.cameras import Fisheye, Pinhole, pixel_centres
from scenes.harmonics import basis
from scenes.pose import Pose, rotation_from_quaternion
from scenes.render.renderer import (
    ALPHA_MAX,
    ALPHA_MIN,
    LOW_PASS_PX2,
    TILE_PX,
    TRANSMITTANCE_STOP,
    PosedSplats,
    Rendering,
    RenderOptions,
)
from scenes.render.request import check_request
from scenes.splats import SplatCloud

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MAX_MEAN_M = 1e6
MAX_SCALE_M = 1e4
MAX_SH = 1e15
MAX_DEPTH_M = 1e15


class ReferenceRenderer:
    """Draws splats in float64, one after the other: slow, for small scenes."""

    def render(
        self,
        objects: Sequence[PosedSplats],
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions | None = None,
    ) -> Rendering:
        """Draw all objects in one global order; see `scenes.render.renderer` for the semantics.

        Raises:
            ValueError: names the argument, what it got and what it wants.
        """
        options = options or RenderOptions()
        check_request(objects, camera, options)
        return _blend(_all_footprints(objects, camera, world_from_camera, options), camera, options)

    def shares(
        self,
        objects: Sequence[PosedSplats],
        index: int,
        camera: Pinhole | Fisheye,
        world_from_camera: Pose,
        options: RenderOptions,
    ) -> Rendering:
        """As `NativeRenderer.shares`."""
        check_request(objects, camera, options)
        options = replace(options, background=(0.0, 0.0, 0.0), sh_degree=0)
        marked = []
        for k, prints in enumerate(_all_footprints(objects, camera, world_from_camera, options)):
            sums = np.zeros((len(prints.depths), 3))
            sums[:, 0] = k == index
            sums[:, 1 if k == index else 2] = prints.depths
            marked.append(replace(prints, colours=sums))
        return _blend(marked, camera, options)


def _all_footprints(
    objects: Sequence[PosedSplats],
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    options: RenderOptions,
) -> list[Footprints]:
    camera_from_world = world_from_camera.inverse()
    return [
        footprints_of(posed.cloud, camera_from_world @ posed.world_from_object, camera, options)
        for posed in objects
    ]


@dataclass(frozen=True, slots=True)
class Footprints:
    """The drawable splats of one object on the picture plane, in the cloud's order."""

    pixels: FloatArray  # (N, 2)
    covariances: FloatArray  # (N, 2, 2), px², low pass included
    opacities: FloatArray  # (N,)
    colours: FloatArray  # (N, 3)
    depths: FloatArray  # (N,)
    is_wide: BoolArray  # (N,) drawn along rays; `pixels` and `covariances` mean nothing then
    means: FloatArray  # (N, 3) in camera axes
    whitenings: FloatArray  # (N, 3, 3) A with A Σ Aᵀ = 1, Σ blurred, of points in camera axes


def footprints_of(
    cloud: SplatCloud, camera_from_object: Pose, camera: Pinhole | Fisheye, options: RenderOptions
) -> Footprints:
    """The drawable splats of a cloud on the picture plane, in the cloud's order."""
    cloud = cloud.select(is_sound(cloud))
    means = camera_from_object @ cloud.means.astype(np.float64)
    pixels, depths, jacobians, drawable = project(camera, means)
    ranges = np.linalg.norm(means, axis=1)
    is_wide = cloud.scales.max(axis=1, initial=0.0) > options.exact_above_rad * ranges
    drawable = (drawable | is_wide) & (depths >= options.near_m) & (depths <= MAX_DEPTH_M)

    cloud = cloud.select(drawable)
    pixels, depths, jacobians = pixels[drawable], depths[drawable], jacobians[drawable]
    means, ranges, is_wide = means[drawable], ranges[drawable], is_wide[drawable]
    gradients = jacobians @ camera_from_object.rotation
    sharp = gradients @ cloud.covariances() @ np.swapaxes(gradients, 1, 2)
    covariances = sharp + LOW_PASS_PX2 * np.eye(2)
    opacities = np.minimum(cloud.opacities.astype(np.float64), 1.0)
    if options.antialias:
        sharp_det = np.maximum(np.linalg.det(sharp), 0.0)
        gain = np.sqrt(sharp_det / np.linalg.det(covariances))
        opacities = opacities * np.where(is_wide, 1.0, gain)
    eye_in_object = camera_from_object.inverse().translation
    colours = _colours(cloud, eye_in_object, options.sh_degree)
    blur_m = np.sqrt(LOW_PASS_PX2) * ranges / focal_px(camera)
    scales = np.hypot(cloud.scales.astype(np.float64), blur_m[:, None])
    axes = camera_from_object.rotation @ rotation_from_quaternion(cloud.rotations)
    whitenings = np.swapaxes(axes, 1, 2) / scales[:, :, None]
    return Footprints(pixels, covariances, opacities, colours, depths, is_wide, means, whitenings)


def is_sound(cloud: SplatCloud) -> BoolArray:
    """(N,) whether all values of a splat are finite and within what can be drawn."""
    finite = np.ones(len(cloud), dtype=np.bool_)
    for array in (cloud.means, cloud.scales, cloud.rotations, cloud.opacities, cloud.sh):
        finite &= np.isfinite(array).all(axis=tuple(range(1, array.ndim)))
    return (
        finite
        & (np.abs(cloud.means) <= MAX_MEAN_M).all(axis=1)
        & ((cloud.scales > 0) & (cloud.scales <= MAX_SCALE_M)).all(axis=1)
        & (cloud.rotations != 0).any(axis=1)
        & (np.abs(cloud.sh) <= MAX_SH).all(axis=(1, 2))
    )


def _colours(cloud: SplatCloud, eye_in_object: FloatArray, degree: int) -> FloatArray:
    """(N, 3) colours seen from the eye, clamped below at 0."""
    directions = cloud.means.astype(np.float64) - eye_in_object
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    degree = min(cloud.sh_degree, degree)
    values = basis(directions / np.where(lengths > 0, lengths, 1.0), degree)
    coefficients = cloud.sh[:, : (degree + 1) ** 2].astype(np.float64)
    summed = np.einsum("nk,nkc->nc", values, coefficients)
    return np.maximum(0.5 + summed, 0.0)


def _blend(
    footprints: Sequence[Footprints], camera: Pinhole | Fisheye, options: RenderOptions
) -> Rendering:
    height, width = camera.height_px, camera.width_px
    transmittance = np.ones((height, width))
    rgb = np.zeros((height, width, 3))
    depth = np.zeros((height, width))
    ids = np.full((height, width), -1, dtype=np.int32)
    heaviest = np.zeros((height, width))

    for layer in blend_layers(footprints, camera, options, transmittance):
        prints, i = footprints[layer.object_id], layer.splat
        window, weight = layer.window, layer.weight
        rgb[window] += weight[..., None] * prints.colours[i]
        depth[window] += weight * prints.depths[i]
        is_heavier = weight > heaviest[window]
        heaviest[window] = np.where(is_heavier, weight, heaviest[window])
        ids[window] = np.where(is_heavier, layer.object_id, ids[window])

    alpha = 1.0 - transmittance
    background = np.asarray(options.background, dtype=np.float64)
    mean_depth = np.where(alpha > 0, depth / np.where(alpha > 0, alpha, 1.0), 0.0)
    return Rendering(
        (rgb + transmittance[..., None] * background).astype(np.float32),
        alpha.astype(np.float32),
        mean_depth.astype(np.float32),
        ids,
    )


@dataclass(frozen=True, slots=True)
class _Layer:
    """Contribution of one splat to the pixels of its window."""

    object_id: int
    splat: int  # its place in its object's footprints
    window: tuple[slice, slice]
    alpha: FloatArray  # 0 where the splat is not drawn
    weight: FloatArray  # alpha · transmittance in front of the splat


def blend_layers(
    footprints: Sequence[Footprints],
    camera: Pinhole | Fisheye,
    options: RenderOptions,
    transmittance: FloatArray,
) -> Iterator[_Layer]:
    """The splats that reach the picture, nearest first; each takes its share of `transmittance`."""
    is_drawn = inside_lens(camera) & in_scope(camera, options)
    rays = pixel_rays(camera)
    for object_id, i in draw_order(footprints):
        prints = footprints[object_id]
        window = _window(prints, i, *is_drawn.shape)
        if window is None:
            continue
        through = transmittance[window]
        is_live = is_drawn[window] & (through >= TRANSMITTANCE_STOP)
        alpha = np.where(is_live, _alpha(prints, i, window, rays), 0.0)
        weight = alpha * through
        transmittance[window] = through - weight
        yield _Layer(object_id, i, window, alpha, weight)


def draw_order(footprints: Sequence[Footprints]) -> list[tuple[int, int]]:
    """(object, splat) pairs, nearest first."""
    pairs = [
        (index, i) for index, prints in enumerate(footprints) for i in range(len(prints.depths))
    ]
    depths = np.concatenate([np.zeros(0), *(prints.depths for prints in footprints)])
    order = np.argsort(depths.astype(np.float32), kind="stable")
    return [pairs[k] for k in order]


def inside_lens(camera: Pinhole | Fisheye) -> BoolArray:
    """(H, W) whether a pixel's centre is inside the lens circle."""
    if isinstance(camera, Pinhole):
        return np.ones((camera.height_px, camera.width_px), dtype=np.bool_)
    x = np.arange(camera.width_px) + 0.5 - camera.cx
    y = (np.arange(camera.height_px) + 0.5 - camera.cy)[:, None]
    return x * x + y * y <= camera.circle_px**2


def in_scope(camera: Pinhole | Fisheye, options: RenderOptions) -> BoolArray:
    """(H, W) whether a pixel lies in the region and in a tile that is to be drawn."""
    drawn = np.ones((camera.height_px, camera.width_px), dtype=np.bool_)
    if options.region is not None:
        left, top, width, height = options.region
        drawn[:] = False
        drawn[top : top + height, left : left + width] = True
    if options.tile_mask is not None:
        of_pixel = options.tile_mask.repeat(TILE_PX, axis=0).repeat(TILE_PX, axis=1)
        drawn &= of_pixel[: camera.height_px, : camera.width_px]
    return drawn


def _window(prints: Footprints, i: int, height: int, width: int) -> tuple[slice, slice] | None:
    """Rows and columns of a box that holds the pixels with alpha >= 1/255; None if there are none.

    A wide splat's box is the whole picture.
    """
    if prints.opacities[i] < ALPHA_MIN:
        return None
    if prints.is_wide[i]:
        return slice(0, height), slice(0, width)
    reach = 1.0 + np.sqrt(
        2 * np.log(prints.opacities[i] / ALPHA_MIN) * np.diag(prints.covariances[i])
    )
    first = np.maximum(np.ceil(prints.pixels[i] - reach - 0.5), 0)
    last = np.minimum(np.floor(prints.pixels[i] + reach - 0.5), [width - 1, height - 1])
    if not (first <= last).all():
        return None
    columns, rows = (slice(int(a), int(b) + 1) for a, b in zip(first, last, strict=True))
    return rows, columns


def _alpha(prints: Footprints, i: int, window: tuple[slice, slice], rays: FloatArray) -> FloatArray:
    """Alpha of one splat at the window's pixel centres, 0 where it is below the limit."""
    alpha = prints.opacities[i] * np.exp(-0.5 * squared_distances(prints, i, window, rays))
    return np.where(alpha >= ALPHA_MIN, np.minimum(alpha, ALPHA_MAX), 0.0)


def squared_distances(
    prints: Footprints, i: int, window: tuple[slice, slice], rays: FloatArray
) -> FloatArray:
    """Of the window's pixels from a splat, in its standard deviations.

    Args:
        prints: an object's splats.
        i: the splat.
        window: rows and columns.
        rays: (H, W, 3) unit directions of all pixels.
    """
    if prints.is_wide[i]:
        mean = prints.whitenings[i] @ prints.means[i]
        whitened = rays[window] @ prints.whitenings[i].T
        across = (np.cross(mean, whitened) ** 2).sum(axis=-1)
        distances = across / (whitened**2).sum(axis=-1)
        return np.where(whitened @ mean > 0, distances, mean @ mean)
    dx, dy = centre_offsets(prints, i, window)
    (xx, xy), (_, yy) = prints.covariances[i]
    return (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)


def centre_offsets(
    prints: Footprints, i: int, window: tuple[slice, slice]
) -> tuple[FloatArray, FloatArray]:
    """From one splat's centre to the window's pixel centres: (1, columns) and (rows, 1), px."""
    rows, columns = window
    dx = np.arange(columns.start, columns.stop) + 0.5 - prints.pixels[i, 0]
    dy = np.arange(rows.start, rows.stop) + 0.5 - prints.pixels[i, 1]
    return dx[None, :], dy[:, None]


def pixel_rays(camera: Pinhole | Fisheye) -> FloatArray:
    """(H, W, 3) unit directions of the pixels' centres."""
    return camera.unproject(pixel_centres(camera)).reshape(camera.height_px, camera.width_px, 3)
