"""Refines the 360° camera's pose against the room's splats.

A marker's estimate is off by tenths of a degree, which alone costs centimetres on the floor. The
room is drawn where the marker says; its steep pixels, lifted to 3D by their drawn depth, are
matched to the live pictures by robust Gauss-Newton over six degrees of freedom, coarse to fine,
through all lenses at once. People and movable objects are outliers.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from devices.messages import Frame
from scenes.cameras import Fisheye
from scenes.pose import Pose, rotation_from_vector
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.splats import SplatCloud
from tracking.background.images import expose, fit_exposure
from tracking.window.contour import sample
from tracking.window.filters import blurred, grey, resized, slopes

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

BLURS_PX = (6.0, 4.0, 2.5, 1.6)
"""Smoothing of the rounds, in px of a lens with `BLUR_AT_F_PX` px per radian. The rounds below 3.5
lower what is left in `lab` and `desk` at 640 px: 0.064° to 0.038°, 0.073° to 0.066°. Over ten
directions of a marker's error, a foreign room from afar keeps 0.22° to 0.26° all the same: where
points are chosen, both pictures are steep at the wrong pose."""

BLUR_AT_F_PX = 400.0
POINTS_PER_LENS = 6000
STEPS = 6
RANGE_M = (0.3, 12.0)
LEAST_FACING = 0.5
"""Surfaces more slanted than this cosine are not looked at."""

LARGEST_TURN_RAD = np.deg2rad(4.0)
LARGEST_SHIFT_M = 0.15
"""A refinement beyond this is rejected."""

LEAST_DETAIL_CORRELATION = 0.12
"""Details of the room must correlate this well with the live ones. At eighteen wrong poses in three
views of a foreign room they gave -0.12 ± 0.08, at the right ones 0.20 to 0.75: this is three
standard deviations above chance."""

PRIOR_TURN_RAD = np.deg2rad(0.5)
PRIOR_SHIFT_M = 0.01
"""Standard deviations of a marker's estimate."""

COLOUR_SIGMA = 0.05
CUTOFF = 3.0
"""Tukey's constant: residuals beyond so many standard deviations say nothing."""

DETAIL_RATIO = 5.0
"""Structure this many times coarser than the blur is left out."""

CORRELATION = 25.0
"""Neighbouring pixels share the scan's errors: so many of them count as one."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A refined camera pose.

    Attributes:
        world_from_rig: the pose.
        sigma: (6,) standard deviations: rotation in radians, translation in metres, rig axes.
        detail_correlation: -1..1, correlation of the drawn details with the live ones.
        turn_rad: by which the refinement turned the marker's pose, used or not.
        shift_m: by which it shifted it.
        refusal: why the refined pose is not used; empty if it is.
    """

    world_from_rig: Pose
    sigma: NDArray[np.float64]
    detail_correlation: float
    turn_rad: float
    shift_m: float
    refusal: str = ""

    @property
    def trusted(self) -> bool:
        """Whether the refined pose is used."""
        return not self.refusal

    @staticmethod
    def unrefined(world_from_rig: Pose) -> Calibration:
        """A pose that is taken as it is, right to a milliradian and a millimetre."""
        return Calibration(world_from_rig, np.full(6, 1e-3), 1.0, 0.0, 0.0)

    def described(self) -> str:
        """One line for a report."""
        moved = f"{np.degrees(self.turn_rad):.2f}°, {1000 * self.shift_m:.0f} mm"
        if self.refusal:
            return f"camera NOT refined ({self.refusal}); poses carry the marker's error"
        degrees = np.degrees(float(np.linalg.norm(self.sigma[:3])))
        millimetres = 1000 * float(np.linalg.norm(self.sigma[3:]))
        return f"camera refined by {moved}, to ±{degrees:.2f}°, {millimetres:.0f} mm"


@dataclass(frozen=True, slots=True, eq=False)
class _Lens:
    """Steep pixels of one lens's drawing."""

    camera: Fisheye
    rig_from_lens: Pose
    points_in_world: Points
    values: FloatArray
    slopes: FloatArray
    weights: Points
    live: FloatArray


def calibrate(
    frame: Frame,
    nominal_world_from_rig: Pose,
    room: SplatCloud,
    renderer: Renderer,
    *,
    objects: tuple[PosedSplats, ...] = (),
) -> Calibration:
    """Refine a camera pose that is right to about half a degree and a centimetre.

    Args:
        frame: live pictures of all lenses.
        nominal_world_from_rig: `world_from_rig` to start from.
        room: splats of what stands still.
        renderer: draws splats.
        objects: movable objects at their expected poses; drawn with the room.
    """
    pose = nominal_world_from_rig
    posed = (PosedSplats(room, Pose.identity()), *objects)
    information = np.eye(6)
    lenses: list[_Lens] = []
    for blur in BLURS_PX:
        lenses = [
            _prepare(frame, index, pose, posed, renderer, blur_px=blur)
            for index in range(len(frame.images))
        ]
        for _ in range(STEPS):
            step, information = _step(lenses, pose, nominal_world_from_rig)
            pose = pose @ Pose(rotation_from_vector(step[:3]), step[3:])
            if np.abs(step[:3]).max() < 2e-6 and np.abs(step[3:]).max() < 1e-5:
                break
    correlation = _detail_correlation(lenses, pose)
    moved = nominal_world_from_rig.inverse() @ pose
    turn = float(np.arccos(np.clip((np.trace(moved.rotation) - 1) / 2, -1, 1)))
    shift = float(np.linalg.norm(moved.translation))
    refusal = _refusal(turn, shift, correlation)
    sigma = np.sqrt(np.diag(np.linalg.inv(information)))
    used = nominal_world_from_rig if refusal else pose
    return Calibration(used, sigma, correlation, turn, shift, refusal)


def _refusal(turn_rad: float, shift_m: float, detail_correlation: float) -> str:
    """Why a refined pose is not used; empty if it is."""
    if not turn_rad < LARGEST_TURN_RAD:
        limit = np.degrees(LARGEST_TURN_RAD)
        return f"it turned by {np.degrees(turn_rad):.1f}°, limit {limit:.0f}°: check the marker"
    if not shift_m < LARGEST_SHIFT_M:
        return f"it moved by {shift_m:.2f} m, limit {LARGEST_SHIFT_M:g} m: check the marker"
    if not detail_correlation > LEAST_DETAIL_CORRELATION:
        return (
            f"the room's details correlate with the picture by {detail_correlation:.2f}, wanted "
            f"{LEAST_DETAIL_CORRELATION:g}: is this the room, and is it lit?"
        )
    return ""


def _scale(residual: Points) -> float:
    """Robust standard deviation of residuals about 0, within what a scan may be off."""
    return min(max(1.5 * float(np.median(np.abs(residual))), 0.006), COLOUR_SIGMA)


def _prepare(
    frame: Frame,
    index: int,
    world_from_rig: Pose,
    posed: tuple[PosedSplats, ...],
    renderer: Renderer,
    *,
    blur_px: float,
) -> _Lens:
    """Draw one lens and pick the steep pixels of the drawing."""
    camera, rig_from_lens = frame.rig.lenses[index], frame.rig.rig_from_lens[index]
    world_from_lens = world_from_rig @ rig_from_lens
    drawn = renderer.render(posed, camera, world_from_lens, RenderOptions())
    blur = blur_px * camera.f_px / BLUR_AT_F_PX
    background_image = np.clip(drawn.rgb, 0, 1)
    exposure = fit_exposure(frame.images[index], background_image, drawn.alpha)
    y, x = np.mgrid[0 : camera.height_px, 0 : camera.width_px].astype(np.float32)
    radius2 = ((x + 0.5) / camera.width_px * 2 - 1) ** 2 + (
        (y + 0.5) / camera.height_px * 2 - 1
    ) ** 2
    background_image = expose(background_image, exposure, radius2=radius2)
    drawn_detail = _detail(grey(background_image), blur)
    live = cv2.cvtColor(frame.images[index], cv2.COLOR_RGB2GRAY).astype(np.float32) / 255.0
    live_detail = _detail(np.asarray(live, dtype=np.float32), blur)
    gx, gy = slopes(drawn_detail)
    usable = (drawn.alpha > 0.95) & (drawn.depth > RANGE_M[0]) & (drawn.depth < RANGE_M[1])
    usable &= radius2 < (0.97 * camera.circle_px * 2 / camera.width_px) ** 2
    usable &= _continuous(drawn.depth)
    facing = _facing(drawn.depth, camera.f_px)
    usable &= facing > LEAST_FACING
    live_x, live_y = slopes(live_detail)
    # A scan's speckle is steep too; only gradients common to both pictures count.
    common_slope = np.sqrt(np.maximum(gx * live_x + gy * live_y, 0.0))
    rows, columns = _steepest(common_slope * facing, usable)
    rays = camera.unproject(np.stack([columns + 0.5, rows + 0.5], axis=1))
    points = world_from_lens @ (rays * drawn.depth[rows, columns].astype(np.float64)[:, None])
    steepness = np.stack([gx + live_x, gy + live_y], axis=2)[rows, columns] * np.float32(0.5)
    weights = facing[rows, columns].astype(np.float64) ** 2
    values = drawn_detail[rows, columns]
    return _Lens(camera, rig_from_lens, points, values, steepness, weights, live_detail)


def _facing(range_m: FloatArray, f_px: float) -> FloatArray:
    """(H, W) cosine between the line of sight and the surface's normal.

    Splats that overlap on a slanted surface hide each other from behind, which slides its texture
    away from the viewer; a surface seen face on has no such error.
    """
    smooth = blurred(range_m, 2.0)
    gx, gy = slopes(smooth)
    slant = f_px * np.hypot(gx, gy) / np.maximum(smooth, 0.1)
    return (1.0 / np.sqrt(1.0 + slant * slant)).astype(np.float32)


def _detail(picture: FloatArray, blur_px: float) -> FloatArray:
    """The picture without its finest and its coarsest structure: no noise, no shadows, no lamps."""
    fine = blurred(picture, blur_px)
    size = (picture.shape[1], picture.shape[0])
    coarse = blurred(resized(fine, (size[0] // 4, size[1] // 4)), DETAIL_RATIO * blur_px / 4)
    return fine - resized(coarse, size)


def _continuous(depth: FloatArray) -> NDArray[np.bool_]:
    """Where neighbouring depths agree to 10 %: drawn depth means nothing across an edge."""
    kernel = np.ones((5, 5), np.uint8)
    return cv2.dilate(depth, kernel) - cv2.erode(depth, kernel) < 0.1 * np.maximum(depth, 0.1)


def _steepest(
    steep: FloatArray, usable: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pixels to look at: the steepest of each cell of a grid, so that no poster takes them all."""
    height, width = steep.shape
    cell = max(4, int(np.sqrt(height * width / POINTS_PER_LENS)))
    rows, columns = height // cell, width // cell
    masked = np.where(usable, steep, -1.0)[: rows * cell, : columns * cell]
    blocks = masked.reshape(rows, cell, columns, cell).transpose(0, 2, 1, 3)
    flat = blocks.reshape(rows * columns, cell * cell)
    best = np.argmax(flat, axis=1)
    value = flat[np.arange(len(flat)), best]
    block = np.flatnonzero(value > 0.002)
    row = block // columns * cell + best[block] // cell
    column = block % columns * cell + best[block] % cell
    return row, column


def _detail_correlation(lenses: list[_Lens], pose: Pose) -> float:
    """Correlation of drawn and live details at a pose."""
    drawn = np.concatenate([lens.values for lens in lenses]).astype(np.float64)
    live = drawn + np.concatenate([_linearise(lens, pose)[1] for lens in lenses])
    norm = float(np.sqrt((drawn @ drawn) * (live @ live)))
    return float(drawn @ live) / norm if norm > 1e-9 else 0.0


def _step(lenses: list[_Lens], pose: Pose, nominal_world_from_rig: Pose) -> tuple[Points, Points]:
    """One robust Gauss-Newton step (6,) in the rig's axes and its information."""
    jacobians: list[Points] = []
    residuals: list[Points] = []
    share = np.concatenate([lens.weights for lens in lenses])
    for lens in lenses:
        jacobian, residual = _linearise(lens, pose)
        jacobians.append(jacobian)
        residuals.append(residual)
    jacobian, residual = np.concatenate(jacobians), np.concatenate(residuals)
    residual = residual - np.median(residual)
    scale = _scale(residual)
    agree = np.clip(1.0 - (residual / (CUTOFF * scale)) ** 2, 0.0, None) ** 2
    weight = agree * share
    weighted = jacobian * (weight / (scale**2 * CORRELATION))[:, None]
    prior = np.diag([1 / PRIOR_TURN_RAD**2] * 3 + [1 / PRIOR_SHIFT_M**2] * 3)
    apart = pose.inverse() @ nominal_world_from_rig
    turn = 0.5 * np.array(
        [
            apart.rotation[2, 1] - apart.rotation[1, 2],
            apart.rotation[0, 2] - apart.rotation[2, 0],
            apart.rotation[1, 0] - apart.rotation[0, 1],
        ]
    )
    information = weighted.T @ jacobian + prior
    right = -weighted.T @ residual + prior @ np.concatenate([turn, apart.translation])
    step = np.linalg.solve(information, right)
    return np.asarray(step, dtype=np.float64), information


def _linearise(lens: _Lens, pose: Pose) -> tuple[Points, Points]:
    """(N, 6) derivative of grey value by a rig-frame twist, and (N,) residual live - drawn."""
    in_rig = pose.inverse() @ lens.points_in_world
    lens_from_rig = lens.rig_from_lens.inverse()
    pixels, _ = lens.camera.project(lens_from_rig @ in_rig)
    residual = sample(lens.live, pixels).astype(np.float64) - lens.values
    jacobian = np.empty((len(pixels), 6))
    small = 1e-4
    for axis in range(6):
        # The rig moves by the twist, so points seen from it move by its inverse.
        unit = np.zeros(3)
        unit[axis % 3] = small
        moved = in_rig - np.cross(unit, in_rig) if axis < 3 else in_rig - unit
        shifted, _ = lens.camera.project(lens_from_rig @ moved)
        jacobian[:, axis] = ((shifted - pixels) / small * lens.slopes).sum(axis=1)
    return jacobian, residual
