"""The gradient figures of `nexus bench raster`: how exact, how fast, how surely a pose is found."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose, rotation_angle
from scenes.render.gradients import record
from scenes.render.native import NativeRenderer
from scenes.render.pose_newton import (
    LUMA,
    DegreesOfFreedom,
    PoseTarget,
    SolverOptions,
    normal_equations,
    solve_pose,
)
from scenes.render.pose_step import moved
from scenes.render.reference.differences import ExactCloud, FrozenPicture, difference, drawable
from scenes.render.renderer import PosedSplats, Rendering, RenderOptions
from scenes.render.stages import stages_of
from studio.bench.splat_scenes import (
    bench_object,
    bench_room,
    object_camera,
    random_cloud,
    room_camera,
)
from studio.console.rows import Row, at_least, at_most

FloatArray = NDArray[np.float64]

ERROR_BAR = 1e-4
STEP_BARS_MS: dict[tuple[int, DegreesOfFreedom], float] = {
    (5_000, 4): 3.0,
    (5_000, 6): 3.6,
    (20_000, 4): 5.0,
    (20_000, 6): 6.0,
}
CONVERGED_BAR, STARTS, MAX_STEPS = 0.95, 40, 6
BACKWARD_BAR = 2.3
CROP_PX = 160
VALUES = ("means", "scales", "rotations", "opacities", "sh")


def gradient_rows(
    native: NativeRenderer, seed: int, *, repeats: int, quick: bool = False
) -> list[Row]:
    """All figures that need derivatives; times are medians with quartile ranges.

    Args:
        native: what is measured.
        seed: of every scene.
        repeats: of every time.
        quick: only what does not depend on the machine: the error and the convergence.
    """
    rng = np.random.default_rng([seed, 3])
    rows = [_error_row(native, seed), _converged_row(native, rng)]
    if quick:
        return rows
    for count in (5_000, 20_000):
        rows += _step_rows(native, count, rng, repeats)
    return [*rows, _backward_row(native, rng, repeats)]


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


def _step_rows(
    native: NativeRenderer, count: int, rng: np.random.Generator, repeats: int
) -> list[Row]:
    """One Gauss-Newton step on one core, drawing included."""
    posed = PosedSplats(bench_object(count, rng), Pose.identity())
    camera, pose = object_camera(CROP_PX)
    options = RenderOptions(threads=1)
    target = _target(native.render([posed], camera, pose, options))
    rows = []
    freedoms: Sequence[DegreesOfFreedom] = (4, 6)
    for freedom in freedoms:

        def step(freedom: DegreesOfFreedom = freedom) -> None:
            normal_equations(
                native, posed, camera, pose, target, degrees_of_freedom=freedom, options=options
            )

        step()
        median, spread = _quartiles([_seconds(step) * 1e3 for _ in range(repeats)])
        name = f"raster.gauss_newton_{count // 1000}k_{freedom}dof.1t.ms"
        bar = STEP_BARS_MS[count, freedom]
        rows.append(at_most(name, median, "ms", bar=bar, spread=spread))
    return rows


def _converged_row(native: NativeRenderer, rng: np.random.Generator) -> Row:
    """Share of starts, 5° and 2 cm away, from which 6 steps end within 0.1° and 1 mm."""
    cloud = bench_object(5_000, rng)
    camera, pose = object_camera(CROP_PX)
    target = _target(native.render([PosedSplats(cloud, Pose.identity())], camera, pose))
    solver = SolverOptions(max_steps=MAX_STEPS)
    found = 0
    for _ in range(STARTS):
        shift, turn = rng.normal(size=(2, 3))
        shift *= 0.02 / np.linalg.norm(shift)
        turn *= np.radians(5.0) / np.linalg.norm(turn)
        start = PosedSplats(cloud, moved(Pose.identity(), np.concatenate([shift, turn])))
        end = solve_pose(native, start, camera, pose, target, solver=solver).world_from_object
        is_near = float(np.linalg.norm(end.translation)) < 1e-3
        found += is_near and rotation_angle(end.rotation) < np.radians(0.1)
    return at_least("raster.gauss_newton.converged", found / STARTS, "", bar=CONVERGED_BAR)


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


def _target(rendering: Rendering) -> PoseTarget:
    return PoseTarget((rendering.rgb @ np.array(LUMA, np.float32)), rendering.alpha)


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def _cpu_seconds(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def _quartiles(values: Sequence[float]) -> tuple[float, float]:
    """Median and quartile range."""
    low, median, high = np.percentile(values, [25, 50, 75])
    return float(median), float(high - low)
