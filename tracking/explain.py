"""Small objects: the pose at which one drawn into the empty room explains the live picture best.

At twenty pixels an outline is a contact shadow's as much as the object's own; the colours of the
object and of what is behind it tell them apart (dense likelihood, Nelder & Mead 1965).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.render.renderer import Renderer
from tracking.background import expose
from tracking.evidence import Evidence, Scene
from tracking.model import RENDER_OPTIONS, TrackModel
from tracking.pictures import blurred, resized
from tracking.sketch import draw

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

AROUND_PX = 10
"""How far around the drawn object the picture counts."""

LENS_BLUR_PX = 0.6
STRANGE = 0.15
"""A colour farther off than this, of 0..1 channels, is something else: how far does not matter."""

SOLID = 0.7
LEAST_SOLID_PX = 10
LIGHT_GAIN, LIGHT_BIAS = (0.4, 1.6), (-0.2, 0.3)
"""Blur and light change an object's contrast and level within these."""

STEP_M, STEP_RAD = 0.04, 0.2
STEP_PRICE = 4.0
"""First steps, and what a step away from the start costs, in pixels wholly unexplained."""

EVALUATIONS = 60


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """A part of the live picture, and what it would show without the object.

    Attributes:
        camera: of the part.
        world_from_camera: its pose.
        live: (H, W, 3) 0..1.
        empty: (H, W, 3) the empty room at the live picture's exposure.
        free: (H, W) 0..1, not covered by a nearer object.
    """

    camera: Fisheye
    world_from_camera: Pose
    live: FloatArray
    empty: FloatArray
    free: FloatArray


def explained(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_start: Pose
) -> tuple[Pose, float]:
    """The pose near a start, on its height, that explains most of what has changed there.

    Returns:
        The pose, and how much of that it explains: 0 nothing, 1 all, below 0 makes it worse.
    """
    setting = _setting(scene, model, evidence, world_from_start)
    if setting is None:
        return world_from_start, 0.0

    def pose_of(steps: Points) -> Pose:
        shift = np.array([steps[0] * STEP_M, steps[1] * STEP_M, 0.0])
        return Pose.from_yaw(
            world_from_start.yaw() + STEP_RAD * float(steps[2]),
            world_from_start.translation + shift,
        )

    def cost(steps: Points) -> float:
        shown, _ = _shown(setting, model, pose_of(steps), scene.renderer)
        return _strange_px(shown, setting) + STEP_PRICE * float(steps @ steps)

    simplex = np.vstack([np.zeros(3), np.eye(3)])
    options = {"maxfev": EVALUATIONS, "initial_simplex": simplex, "xatol": 0.02, "fatol": 0.1}
    found = minimize(cost, np.zeros(3), method="Nelder-Mead", options=options)
    changed = _strange_px(setting.empty, setting)
    return pose_of(np.asarray(found.x, dtype=np.float64)), 1.0 - float(found.fun) / changed


def resemblances(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_starts: Sequence[Pose]
) -> Points:
    """(N,) how much poses at one place look like the picture, at most 1.

    The mean of the share they explain of what has changed there, and the correlation of colours.
    """
    setting = _setting(scene, model, evidence, world_from_starts[0])
    if setting is None:
        return np.zeros(len(world_from_starts))
    changed = _strange_px(setting.empty, setting)
    found = []
    for pose in world_from_starts:
        shown, likeness = _shown(setting, model, pose, scene.renderer)
        found.append(0.5 * (1.0 - _strange_px(shown, setting) / changed + max(likeness, 0.0)))
    return np.array(found)


def _shown(
    setting: Setting, model: TrackModel, pose: Pose, renderer: Renderer
) -> tuple[FloatArray, float]:
    """The object drawn over the empty room in the live picture's light; likeness of colours."""
    drawn = renderer.render(
        (model.splats_at(pose),), setting.camera, setting.world_from_camera, RENDER_OPTIONS
    )
    rgb, alpha = blurred(drawn.rgb, LENS_BLUR_PX), blurred(drawn.alpha, LENS_BLUR_PX)
    behind = np.asarray((1.0 - alpha)[..., None] * setting.empty, dtype=np.float32)
    solid = alpha * setting.free > SOLID
    if solid.sum() < LEAST_SOLID_PX:
        return rgb + behind, 0.0
    seen, own = setting.live[solid], rgb[solid] / alpha[solid][:, None]
    first, second = own - own.mean(axis=0), seen - seen.mean(axis=0)
    both, power = float((first * second).sum()), max(float((first * first).sum()), 1e-6)
    likeness = both / math.sqrt(power * max(float((second * second).sum()), 1e-6))
    gain = min(max(both / power, LIGHT_GAIN[0]), LIGHT_GAIN[1])
    bias = np.clip(seen.mean(axis=0) - gain * own.mean(axis=0), *LIGHT_BIAS)
    shown = gain * rgb + bias * alpha[..., None] + behind
    return np.asarray(shown, dtype=np.float32), likeness


def _strange_px(shown: FloatArray, setting: Setting) -> float:
    """How many pixels of the live picture are not as shown."""
    apart = shown - setting.live
    apart2 = np.einsum("hwc,hwc->hw", apart, apart)
    return max(float((setting.free * apart2 / (apart2 + STRANGE**2)).sum()), 1e-3)


def _setting(scene: Scene, model: TrackModel, evidence: Evidence, start: Pose) -> Setting | None:
    """The surroundings of an object at a pose; None if nothing of it is in the window."""
    drawn = draw(model, start, evidence, scene.renderer)
    side = 2 * AROUND_PX + 1
    near = cv2.dilate((drawn.alpha > 0.3).astype(np.uint8), np.ones((side, side), np.uint8))
    rows, columns = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    if len(rows) == 0:
        return None
    part = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    camera = replace(
        evidence.camera,
        width_px=int(columns[-1] - columns[0] + 1),
        height_px=int(rows[-1] - rows[0] + 1),
        cx=evidence.camera.cx - int(columns[0]),
        cy=evidence.camera.cy - int(rows[0]),
    )
    return Setting(
        camera,
        evidence.world_from_camera,
        np.ascontiguousarray(evidence.live[part]),
        np.ascontiguousarray(_empty(scene, evidence)[part]),
        np.ascontiguousarray(1.0 - evidence.hidden[part]),
    )


def _empty(scene: Scene, evidence: Evidence) -> FloatArray:
    """(H, W, 3) the empty room in a window, as the live camera would record it."""
    view = evidence.view
    lens = scene.frame.rig.lenses[view.lens]
    height, width = evidence.live.shape[:2]
    plate = resized(
        np.ascontiguousarray(scene.plates.images[view.lens][view.part]), (width, height)
    )
    x = (view.left + (np.arange(width) + 0.5) * view.shrink) * 2 / lens.width_px - 1
    y = (view.top + (np.arange(height) + 0.5) * view.shrink) * 2 / lens.height_px - 1
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32)
    return expose(resized(plate, (width, height)), scene.exposures[view.lens], radius2=radius2)
