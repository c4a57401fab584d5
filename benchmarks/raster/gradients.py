"""The gradient figures of `nexus bench raster`: how exact, how fast."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.raster.reference.differences import ExactCloud, FrozenPicture, difference, drawable
from benchmarks.raster.splat_scenes import (
    bench_room,
    random_cloud,
    room_camera,
)
from benchmarks.raster.stages import stages_of
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from studio.console.rows import Row, at_most

FloatArray = NDArray[np.float64]

ERROR_BAR = 1e-4
BACKWARD_BAR = 2.3
VALUES = ("means", "scales", "rotations", "opacities", "sh")


def gradient_rows(
    native: NativeRenderer, seed: int, *, repeats: int, quick: bool = False
) -> list[Row]:
    """All figures that need derivatives; times are medians with quartile ranges.

    Args:
        native: what is measured.
        seed: of every scene.
        repeats: of every time.
        quick: only what does not depend on the machine: the error.
    """
    rng = np.random.default_rng([seed, 3])
    rows = [_error_row(native, seed)]
    return rows if quick else [*rows, _backward_row(native, rng, repeats)]


def _error_row(native: NativeRenderer, seed: int) -> Row:
    """Largest relative error of any splat's gradient, over both lenses and SH 0 to 3.

    Relative to the gradient's norm, or to a hundredth of the largest splat's where that is more.
    """
    errors = []
    for degree in range(4):
        for lens in (
            Pinhole.from_fov(40, 32, np.radians(70.0)),
            Fisheye.from_fov(40, np.radians(220.0)),
        ):
            rng = np.random.default_rng([seed, 4, degree])
            options = RenderOptions(sh_degree=degree, antialias=degree % 2 == 1)
            errors.append(_gradient_error(native, lens, options, rng))
    return at_most("raster.gradient.rel_error.max", float(np.max(errors)), "", bar=ERROR_BAR)


def _gradient_error(
    native: NativeRenderer,
    lens: Pinhole | Fisheye,
    options: RenderOptions,
    rng: np.random.Generator,
) -> float:
    pose = Pose.from_yaw(0.3, (0.0, 0.0, 2.0))
    cloud = random_cloud(12, rng, sh_degree=options.sh_degree, spread_m=0.5)
    cloud = replace(cloud, scales=np.minimum(cloud.scales, np.float32(0.3)))
    posed = PosedSplats(cloud.select(drawable(cloud, pose, lens, Pose.identity(), options)), pose)
    y, x = np.indices((lens.height_px, lens.width_px))
    d_rgb = np.sin(np.stack([0.3 * x + 0.2 * y, 0.5 * y - 1.0, 0.4 * x - 0.3 * y], axis=2))
    d_rgb = d_rgb.astype(np.float32)
    found = record(native, [posed], lens, Pose.identity(), options).gradients(d_rgb).objects[0]
    frozen = FrozenPicture([posed], lens, Pose.identity(), options)

    def loss(cloud: ExactCloud) -> float:
        return float((frozen.draw(clouds=[cloud]).rgb * d_rgb).sum())

    worst = 0.0
    for name in VALUES:
        wanted = _differences(frozen.clouds[0], name, loss)
        got = getattr(found, name).reshape(wanted.shape)
        norms = np.linalg.norm(wanted, axis=1)
        error = np.linalg.norm(got - wanted, axis=1) / np.maximum(norms, 1e-2 * norms.max())
        worst = max(worst, float(error.max()))
    return worst


def _differences(cloud: ExactCloud, name: str, loss: Callable[[ExactCloud], float]) -> FloatArray:
    """(N, values per splat) gradients of one array by central differences."""
    base: FloatArray = getattr(cloud, name)
    flat = base.reshape(len(cloud), -1)
    slopes = np.zeros(flat.shape)
    for place in np.ndindex(*flat.shape):

        def at(t: float, place: tuple[int, ...] = place) -> float:
            values = flat.copy()
            values[place] += t
            return loss(replace(cloud, **{name: values.reshape(base.shape)}))

        slopes[place] = difference(at)
    return slopes


def _backward_row(native: NativeRenderer, rng: np.random.Generator, repeats: int) -> Row:
    """Blending backwards over blending, a room of 50k splats at 480×360: CPU time, one thread."""
    posed = PosedSplats(bench_room(50_000, rng), Pose.identity())
    camera, pose = room_camera(480, 360)
    shape = (camera.height_px, camera.width_px)
    d_rgb = rng.normal(size=(*shape, 3)).astype(np.float32)
    d_alpha = rng.normal(size=shape).astype(np.float32)
    stages = stages_of(native, [posed], camera, pose, RenderOptions(threads=1))
    stages.project()
    stages.sort()
    stages.bin()
    ratios = []
    for _ in range(1 + repeats):
        forward = _cpu_seconds(stages.draw)
        ratios.append(_cpu_seconds(lambda: stages.blend_back(d_rgb, d_alpha)) / forward)
    # The first round also gets its memory from the system.
    median, spread = _quartiles(ratios[1:])
    return at_most("raster.backward_vs_forward", median, "x", bar=BACKWARD_BAR, spread=spread)


def _cpu_seconds(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def _quartiles(values: Sequence[float]) -> tuple[float, float]:
    """Median and quartile range."""
    low, median, high = np.percentile(values, [25, 50, 75])
    return float(median), float(high - low)
