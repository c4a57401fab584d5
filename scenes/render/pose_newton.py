# pyright: standard
"""The pose of one splat object from one picture: exact Gauss-Newton steps on grey and silhouette.

One native call draws the object at a pose and carries the derivatives with respect to the pose
along (forward mode), so that JᵀJ and Jᵀr come with the picture. Residuals of a pixel with drawn
grey G (over black), alpha A, background B, target grey Y and target silhouette S are

    gain · G + bias · A + (1 - A) · B - Y     and     A - S,

squared and weighted. Which splat reaches which pixel counts as fixed within a step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.pose_step import moved, twists_of_object
from scenes.render.renderer import PosedSplats, RenderOptions

FloatArray = NDArray[np.float64]
Picture = NDArray[np.float32]
Mask = NDArray[np.bool_]

DegreesOfFreedom = Literal[3, 4, 6]

STEP_ENTRIES: dict[int, tuple[int, ...]] = {3: (0, 1, 5), 4: (0, 1, 2, 5), 6: (0, 1, 2, 3, 4, 5)}
"""Entries of a step (x, y, z, rx, ry, rz; see `pose_step`) that are free: x, y(, z), yaw or all."""

UPPER_TRIANGLE = {size: np.triu_indices(size) for size in (5, 6, 8)}
"""Rows and columns of the upper triangle of JᵀJ, gain and bias included, row by row."""

LUMA = (0.299, 0.587, 0.114)
"""Grey of red, green and blue (ITU-R BT.601), as cameras and OpenCV make it."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseTarget:
    """What the drawn object is compared with; every array is (H, W), float32 but for the mask.

    Attributes:
        grey: the picture's grey, 0..1.
        silhouette: how much of each pixel the object should cover, 0..1.
        grey_weight: weight of a squared grey residual, >= 0; None means 1 everywhere.
        silhouette_weight: weight of a squared silhouette residual, >= 0; None means 1.
        background: grey seen where the object lets light through; None means black, which suits a
            `grey` that was multiplied by the silhouette.
        occluder_depth_m: splats further than this (z for a pinhole, range for a fisheye) are
            hidden; None and inf mean nothing is in front. `silhouette` is then the visible part's.
        occluder_mask: bool, where something at no known depth hides the whole object; None means
            nowhere.
    """

    grey: Picture
    silhouette: Picture
    grey_weight: Picture | None = None
    silhouette_weight: Picture | None = None
    background: Picture | None = None
    occluder_depth_m: Picture | None = None
    occluder_mask: Mask | None = None


@dataclass(frozen=True, slots=True)
class Brightness:
    """The object's grey in the picture is `gain` · drawn grey + `bias` · alpha."""

    gain: float = 1.0
    bias: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class NormalEquations:
    """One Gauss-Newton step's sums: P unknowns, the free entries of the step, then gain and bias.

    Attributes:
        jtj: (P, P) float64, JᵀWJ.
        jtr: (P,) float64, JᵀWr: half the gradient of the cost.
        grey_cost: sum of weighted squared grey residuals.
        silhouette_cost: sum of weighted squared silhouette residuals.
        grey: (H, W) float32 drawn grey over black, without gain and bias.
        alpha: (H, W) float32.
    """

    jtj: FloatArray
    jtr: FloatArray
    grey_cost: float
    silhouette_cost: float
    grey: Picture
    alpha: Picture

    @property
    def cost(self) -> float:
        """Sum of all weighted squared residuals."""
        return self.grey_cost + self.silhouette_cost


@dataclass(frozen=True, slots=True)
class SolverOptions:
    """How `solve_pose` steps.

    Attributes:
        degrees_of_freedom: 3 (x, y, yaw), 4 (x, y, z, yaw) or 6, about the world's axes.
        max_steps: pictures drawn at most, the first one included.
        solve_brightness: also solve for gain and bias; otherwise they stay as given.
        damping: first Levenberg damping, relative to the diagonal of JᵀJ.
        smallest_shift_m: a step smaller than this ...
        smallest_turn_rad: ... and this ends the search.
    """

    degrees_of_freedom: DegreesOfFreedom = 6
    max_steps: int = 8
    solve_brightness: bool = False
    damping: float = 1e-3
    smallest_shift_m: float = 1e-4
    smallest_turn_rad: float = 2e-4


@dataclass(frozen=True, slots=True, eq=False)
class PoseSolution:
    """Where a search ended.

    Attributes:
        world_from_object: the best pose found.
        brightness: gain and bias at that pose.
        equations: the sums at that pose.
        steps: pictures drawn.
        converged: whether the last accepted step was below the smallest.
    """

    world_from_object: Pose
    brightness: Brightness
    equations: NormalEquations
    steps: int
    converged: bool


def normal_equations(
    renderer: NativeRenderer,
    posed: PosedSplats,
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    target: PoseTarget,
    *,
    degrees_of_freedom: DegreesOfFreedom = 6,
    brightness: Brightness | None = None,
    solve_brightness: bool = False,
    options: RenderOptions | None = None,
) -> NormalEquations:
    """Draw one object and sum what a Gauss-Newton step needs; deterministic for any thread count.

    Args:
        renderer: keeps the prepared cloud and the threads.
        posed: the object at the pose to improve.
        camera: usually a small one that covers the object alone.
        world_from_camera: its pose.
        target: pictures of the camera's size.
        degrees_of_freedom: 3 (x, y, yaw), 4 (x, y, z, yaw) or 6.
        brightness: gain and bias at which the residuals are taken.
        solve_brightness: make gain and bias the last two unknowns.
        options: `background` is ignored.

    Raises:
        ValueError: names the argument, what it got and what it wants; also where greys, weights or
            brightness are so large that the sums overflow.
    """
    if degrees_of_freedom not in get_args(DegreesOfFreedom):
        raise ValueError(f"degrees_of_freedom: got {degrees_of_freedom}, wanted 3, 4 or 6")
    brightness = brightness or Brightness()
    if not np.isfinite([brightness.gain, brightness.bias]).all():
        raise ValueError(f"brightness: got {brightness}, wanted finite numbers")
    entries = STEP_ENTRIES[degrees_of_freedom]
    twists = twists_of_object(world_from_camera, posed.world_from_object)[list(entries)]
    upper, gradient, (grey_cost, silhouette_cost), grey, alpha = renderer.pose_normals(
        posed,
        camera,
        world_from_camera,
        options or RenderOptions(),
        twists=np.ascontiguousarray(twists),
        target=_flat_target(target, (camera.height_px, camera.width_px)),
        luma=LUMA,
        brightness=(brightness.gain, brightness.bias),
    )
    if not np.isfinite([*upper, *gradient, grey_cost, silhouette_cost]).all():
        raise ValueError(
            f"normal equations: sums are not finite (drawn grey up to {np.abs(grey).max():.3g}, "
            f"target up to {np.abs(target.grey).max():.3g}, {brightness}), wanted greys, weights "
            "and brightness whose products fit float32"
        )
    unknowns = len(entries) + 2
    rows, columns = UPPER_TRIANGLE[unknowns]
    jtj = np.zeros((unknowns, unknowns))
    jtj[rows, columns] = jtj[columns, rows] = upper
    kept = unknowns if solve_brightness else len(entries)
    shape = (camera.height_px, camera.width_px)
    return NormalEquations(
        jtj[:kept, :kept],
        np.asarray(gradient)[:kept],
        grey_cost,
        silhouette_cost,
        grey.reshape(shape),
        alpha.reshape(shape),
    )


def solve_pose(
    renderer: NativeRenderer,
    start: PosedSplats,
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    target: PoseTarget,
    *,
    solver: SolverOptions | None = None,
    brightness: Brightness | None = None,
    options: RenderOptions | None = None,
) -> PoseSolution:
    """Levenberg-Marquardt from a starting pose (Nocedal & Wright 2006, section 10.3).

    Args:
        renderer: as in `normal_equations`, like the arguments not named here.
        start: the object at the pose to start from.
        camera: the camera the target was seen by.
        world_from_camera: its pose.
        target: what to fit.
        solver: how to step.
        brightness: gain and bias to start from, or to keep.
        options: how to draw.

    Raises:
        ValueError: names the argument, what it got and what it wants.
    """
    solver = solver or SolverOptions()
    if solver.max_steps < 1:
        raise ValueError(f"solver.max_steps: got {solver.max_steps}, wanted at least 1")

    def evaluate(posed: PosedSplats, light: Brightness) -> NormalEquations:
        return normal_equations(
            renderer,
            posed,
            camera,
            world_from_camera,
            target,
            degrees_of_freedom=solver.degrees_of_freedom,
            brightness=light,
            solve_brightness=solver.solve_brightness,
            options=options,
        )

    light = brightness or Brightness()
    best, damping = start, solver.damping
    equations = evaluate(best, light)
    converged = False
    steps = 1
    while steps < solver.max_steps and not converged:
        change = _damped_step(equations, damping)
        step = np.zeros(6)
        free = STEP_ENTRIES[solver.degrees_of_freedom]
        step[list(free)] = change[: len(free)]
        trial = replace(best, world_from_object=moved(best.world_from_object, step))
        trial_light = light
        if solver.solve_brightness:
            trial_light = Brightness(light.gain + change[-2], light.bias + change[-1])
        found = evaluate(trial, trial_light)
        steps += 1
        if found.cost <= equations.cost:
            best, light, equations = trial, trial_light, found
            damping = max(damping * 0.1, 1e-7)
        else:
            damping *= 10.0
        converged = bool(
            np.linalg.norm(step[:3]) < solver.smallest_shift_m
            and np.linalg.norm(step[3:]) < solver.smallest_turn_rad
        )
    return PoseSolution(best.world_from_object, light, equations, steps, converged)


def _damped_step(equations: NormalEquations, damping: float) -> FloatArray:
    """Minus (JᵀJ + damping · diag)⁻¹ Jᵀr; entries that change nothing stay 0."""
    diagonal = np.diag(equations.jtj)
    is_live = diagonal > 0
    step = np.zeros(len(diagonal))
    if is_live.any():
        matrix = equations.jtj[np.ix_(is_live, is_live)] + np.diag(damping * diagonal[is_live])
        step[is_live] = -np.linalg.lstsq(matrix, equations.jtr[is_live], rcond=None)[0]
    return step


def _flat_target(
    target: PoseTarget, shape: tuple[int, int]
) -> tuple[Picture, Picture, Picture, Picture, Picture, Picture]:
    """Grey, its weight, background, silhouette, its weight, occluder: as the kernel wants."""
    return (
        _flat("grey", target.grey, shape, 0.0),
        _flat("grey_weight", target.grey_weight, shape, 1.0),
        _flat("background", target.background, shape, 0.0),
        _flat("silhouette", target.silhouette, shape, 0.0),
        _flat("silhouette_weight", target.silhouette_weight, shape, 1.0),
        _flat_occluder(target, shape),
    )


def _flat_occluder(target: PoseTarget, shape: tuple[int, int]) -> Picture:
    """Depth and mask as one: a splat's depth is positive, so that depth 0 hides every splat."""
    depth_m = _flat("occluder_depth_m", target.occluder_depth_m, shape, np.inf)
    mask = target.occluder_mask
    if mask is None:
        return depth_m
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != shape:
        raise ValueError(f"target.occluder_mask: got {_described(mask)}, wanted bool {shape}")
    return np.where(mask.ravel(), np.float32(0.0), depth_m)


def _flat(name: str, values: Picture | None, shape: tuple[int, int], otherwise: float) -> Picture:
    if values is None:
        return np.full(shape[0] * shape[1], otherwise, dtype=np.float32)
    if not isinstance(values, np.ndarray) or values.dtype != np.float32 or values.shape != shape:
        raise ValueError(f"target.{name}: got {_described(values)}, wanted float32 {shape}")
    is_bad = np.isnan(values) if name == "occluder_depth_m" else ~np.isfinite(values)
    if name.endswith("weight"):
        is_bad |= values < 0
    if is_bad.any():
        wanted = {"grey_weight": "finite and >= 0", "silhouette_weight": "finite and >= 0"}
        raise ValueError(
            f"target.{name}: {int(is_bad.sum())} of {values.size} values are bad, such as "
            f"{values[is_bad][0]}, wanted {wanted.get(name, 'no NaN')}"
        )
    return np.ascontiguousarray(values).ravel()


def _described(values: object) -> str:
    if isinstance(values, np.ndarray):
        return f"{values.dtype} {values.shape}"
    return type(values).__name__
