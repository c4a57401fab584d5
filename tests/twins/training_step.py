"""A training step put together of readable parts: the oracle of `Trainee.step`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.raster.reference.backward import backward
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.train.optimiser.rows import LOG_SCALE, LOGIT, MEAN, ROTATION, SH, TrainingRows
from scenes.render.gradients import ObjectGradients, Recording, record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.render.training import DepthBounds, Distance, Exposure
from scenes.splats import SH_C0, SplatCloud
from tests.twins import adam, loss


def step(
    rows: TrainingRows,
    photo: NDArray[np.uint8],
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    *,
    rates: NDArray[np.float32],
    exposure: Exposure,
    options: RenderOptions,
    bounds: DepthBounds | None = None,
    depth_price: float = 0.0,
) -> tuple[TrainingRows, Distance]:
    """Draw, compare, differentiate, move: as `scenes.render.training.Trainee.step`."""
    cloud = rows.to_cloud()

    def drawn(cloud: SplatCloud) -> Recording:
        posed = PosedSplats(cloud, Pose.identity())
        return record(NativeRenderer(), [posed], camera, world_from_camera, options)

    recording = drawn(cloud)
    rgb = recording.rendering.rgb.astype(np.float64)
    target = photo.astype(np.float64) / 255
    found, d_rgb = loss.distance(rgb, target, exposure)
    drawn_by = recording.gradients(d_rgb.astype(np.float32)).objects[0]
    gradient = _row_gradients(rows, drawn_by)
    if bounds is not None and depth_price > 0:
        gradient += _row_gradients(
            rows, _off_bounds(cloud, camera, world_from_camera, options, bounds, depth_price)
        )
    seen = loss.as_seen(rgb, exposure)
    grey = replace(cloud, sh=np.zeros((len(cloud), 1, 3), dtype=np.float32))
    error = _shown(drawn(grey), np.abs(seen - target).mean(axis=2))
    is_seen = (gradient != 0).any(axis=1) | (error > 0)
    moved = adam.step(rows, gradient, is_seen, rates)
    return replace(moved, error=(rows.error + error).astype(np.float32)), found


def _off_bounds(
    cloud: SplatCloud,
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    options: RenderOptions,
    bounds: DepthBounds,
    price: float,
) -> ObjectGradients:
    """Gradients of what weight off the bounds costs, mean over the pixels."""
    rate = price / bounds.near.size

    def priced(depth: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        off, slope = loss.price_off_bounds(depth, bounds)
        return rate * off, rate * slope

    posed = PosedSplats(cloud, Pose.identity())
    return backward([posed], camera, world_from_camera, options, price=priced).objects[0]


def _row_gradients(rows: TrainingRows, drawn: ObjectGradients) -> NDArray[np.float64]:
    """(N, 11 + 3K) gradients of the raw numbers, from those of the values drawn."""
    out = np.empty(rows.values.shape)
    out[:, MEAN] = drawn.means
    out[:, LOG_SCALE] = drawn.scales * np.exp(rows.values[:, LOG_SCALE])
    # Drawn were unit quaternions; the length of the raw ones divides their gradient.
    norms = np.linalg.norm(rows.values[:, ROTATION], axis=1, keepdims=True)
    out[:, ROTATION] = drawn.rotations / norms
    out[:, LOGIT] = drawn.opacities * rows.opacities * (1 - rows.opacities)
    out[:, SH] = drawn.sh.reshape(len(rows), -1)
    return out


def _shown(recording: Recording, error: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) sum over pixels of blend weight × error: the slope by a colour that nothing clamps."""
    d_rgb = np.zeros((*error.shape, 3), dtype=np.float32)
    d_rgb[..., 0] = error
    return recording.gradients(d_rgb).objects[0].sh[:, 0, 0].astype(np.float64) / SH_C0
