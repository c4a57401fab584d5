"""Small objects: the pose at which one drawn into the empty room explains the live picture best.

At twenty pixels an outline is a contact shadow's as much as the object's own; the colours of the
object and of what is behind it tell them apart (dense likelihood, Nelder & Mead 1965).
"""

from __future__ import annotations

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

AROUND_PX = 6
"""How far around the drawn object the picture counts."""

LENS_BLUR_PX = 0.6
STRANGE = 0.15
"""A colour farther off than this, of 0..1 channels, is something else: how far does not matter."""

ON_OBJECT = 0.1
"""Where at least so much of the object is drawn, with a pixel around it, its detail is compared."""

DETAIL_PX = 3.0
"""What differs from its surroundings of this size is detail."""

DOUBT_PX = 8.0
"""Where only so few pixels have changed, half of what they say counts."""
LIGHT_RANGE = (0.4, 2.5)
SHADE_RANGE = (0.35, 1.0)
LIGHT_BLUR_PX = 4.0
"""An object's sides may be this much darker or lighter than in its scan, and the empty room in the
object's shadow; how smoothly that goes."""

STEP_M, STEP_RAD = 0.04, 0.2
STEP_PRICE = 4.0
"""First steps, and what a step away from the start costs, in pixels wholly unexplained."""

EVALUATIONS = 60
ROUGHLY, CLOSELY = 24, 36
"""How many poses are tried near a believed one; to come near the best, and to tell it closely."""


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """A part of the live picture, and what it would show without the object.

    Attributes:
        camera: of the part.
        world_from_camera: its pose.
        live: (H, W, 3) 0..1.
        empty: (H, W, 3) what the live picture would show there without anything new.
        free: (H, W) 0..1, not covered by a nearer object.
        changed_px: in how many pixels the live picture differs from the empty room.
        live_detail: (H, W, 3) fine structure of the live picture.
        empty_detail: (H, W, 3) and of the empty room.
    """

    camera: Fisheye
    world_from_camera: Pose
    live: FloatArray
    empty: FloatArray
    free: FloatArray
    changed_px: float
    live_detail: FloatArray
    empty_detail: FloatArray


def explained(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_start: Pose
) -> tuple[Pose, float]:
    """The pose near a start, on its height, at which the object explains the picture best.

    Returns:
        The pose, and how much it resembles the picture there, as in `resemblances`.
    """
    return _best(scene, model, evidence, world_from_start, EVALUATIONS, STEP_PRICE)


def roughly_explained(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_start: Pose
) -> tuple[Pose, float]:
    """The same, told with less effort; `closely_explained` goes on from there."""
    return _best(scene, model, evidence, world_from_start, ROUGHLY, STEP_PRICE)


def closely_explained(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_rough: Pose
) -> tuple[Pose, float]:
    """The same from a rough pose, which nothing but the picture speaks for: it has no pull."""
    return _best(scene, model, evidence, world_from_rough, CLOSELY, 0.0)


def _best(
    scene: Scene,
    model: TrackModel,
    evidence: Evidence,
    world_from_start: Pose,
    evaluations: int,
    price: float,
) -> tuple[Pose, float]:
    """The best of so many poses tried near a start, where steps away have a price."""
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
        return _strange_px(shown, setting.live, setting.free) + price * float(steps @ steps)

    simplex = np.vstack([np.zeros(3), np.eye(3)])
    options = {"maxfev": evaluations, "initial_simplex": simplex, "xatol": 0.02, "fatol": 0.1}
    found = minimize(cost, np.zeros(3), method="Nelder-Mead", options=options)
    pose = pose_of(np.asarray(found.x, dtype=np.float64))
    return pose, _resemblance(setting, model, pose, scene.renderer)


def resemblances(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_starts: Sequence[Pose]
) -> Points:
    """(N,) how much poses at one place look like the picture, at most 1, 0 for by chance.

    The mean of the share of pixels that the object explains, and of how much more of the picture's
    detail there is its own than the empty room's.
    """
    setting = _setting(scene, model, evidence, world_from_starts[0])
    if setting is None:
        return np.zeros(len(world_from_starts))
    return np.array(
        [_resemblance(setting, model, pose, scene.renderer) for pose in world_from_starts]
    )


def _resemblance(setting: Setting, model: TrackModel, pose: Pose, renderer: Renderer) -> float:
    shown, alpha = _shown(setting, model, pose, renderer)
    on_object = setting.free * (blurred(alpha, LENS_BLUR_PX) > ON_OBJECT)
    detail = _detail_shared(_detail(shown), setting.live_detail, on_object)
    without = max(_detail_shared(setting.empty_detail, setting.live_detail, on_object), 0.0)
    return 0.5 * (_share_explained(shown, setting) + detail - without)


def _shown(
    setting: Setting, model: TrackModel, pose: Pose, renderer: Renderer
) -> tuple[FloatArray, FloatArray]:
    """The object drawn over the empty room in the live picture's light; its alpha."""
    drawn = renderer.render(
        (model.splats_at(pose),), setting.camera, setting.world_from_camera, RENDER_OPTIONS
    )
    rgb, alpha = blurred(drawn.rgb, LENS_BLUR_PX), blurred(drawn.alpha, LENS_BLUR_PX)
    light = _light(rgb, alpha * setting.free, setting.live, limits=LIGHT_RANGE)
    shown = rgb * light[..., None] + (1.0 - alpha)[..., None] * setting.empty
    return np.asarray(shown, dtype=np.float32), alpha


def _detail(picture: FloatArray) -> FloatArray:
    """(H, W, 3) fine structure of a picture."""
    return np.asarray(picture - blurred(picture, DETAIL_PX), dtype=np.float32)


def _detail_shared(first: FloatArray, second: FloatArray, weight: FloatArray) -> float:
    """-1..1: how alike the fine structures of two pictures are, in strength as well.

    Light, shadows and faults of an empty room are smooth; flat floor is not like a plain object,
    which has an outline.
    """
    weights = np.repeat(weight.ravel(), 3)
    a, b = first.ravel(), second.ravel()
    power = float(weights @ (a * a + b * b))
    return 2.0 * float(weights @ (a * b)) / max(power, 1e-6)


def _light(
    drawn: FloatArray, weight: FloatArray, live: FloatArray, *, limits: tuple[float, float]
) -> FloatArray:
    """(H, W) how much lighter each part of a drawn picture is seen live.

    Sides turn towards the light and away from it, shadows fall: all of that is smooth beside what
    is drawn on things.
    """
    both = weight * np.einsum("hwc,hwc->hw", drawn, live)
    power = weight * np.einsum("hwc,hwc->hw", drawn, drawn)
    ratio = blurred(both, LIGHT_BLUR_PX) / np.maximum(blurred(power, LIGHT_BLUR_PX), 1e-6)
    return np.clip(ratio, *limits).astype(np.float32)


def _share_explained(shown: FloatArray, setting: Setting) -> float:
    """1 if the picture is as shown, 0 if it is as near to what is there without the object.

    Something large that has changed is not explained by a small object, and a large object is not
    seen where little has changed: the larger of the two changes counts.
    """
    most = max(setting.changed_px, _strange_px(setting.empty, shown, setting.free))
    return (most - _strange_px(shown, setting.live, setting.free)) / (most + DOUBT_PX)


def _strange_px(first: FloatArray, second: FloatArray, free: FloatArray) -> float:
    """In how many pixels two pictures differ, of those that are free."""
    apart = first - second
    apart2 = np.einsum("hwc,hwc->hw", apart, apart)
    return float((free * apart2 / (apart2 + STRANGE**2)).sum())


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
    live = np.ascontiguousarray(evidence.live[part])
    empty = np.ascontiguousarray(_empty(scene, evidence)[part])
    free = np.ascontiguousarray(1.0 - evidence.hidden[part])
    return Setting(
        camera,
        evidence.world_from_camera,
        live,
        empty,
        free,
        _strange_px(empty, live, free),
        _detail(live),
        _detail(empty),
    )


def _empty(scene: Scene, evidence: Evidence) -> FloatArray:
    """(H, W, 3) a window without the object: the empty room, as the live camera records it.

    It is shaded like that; what shows another object is as in the live picture.
    """
    view = evidence.view
    lens = scene.frame.rig.lenses[view.lens]
    height, width = evidence.live.shape[:2]
    part = np.ascontiguousarray(scene.plates.images[view.lens][view.part])
    plate = resized(part, (width, height))
    x = (view.left + (np.arange(width) + 0.5) * view.shrink) * 2 / lens.width_px - 1
    y = (view.top + (np.arange(height) + 0.5) * view.shrink) * 2 / lens.height_px - 1
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32)
    room = expose(plate, scene.exposures[view.lens], radius2=radius2)
    others = _others(evidence)[..., None]
    shade = _light(room, np.ones_like(others[..., 0]), evidence.live, limits=SHADE_RANGE)
    shaded = room * shade[..., None]
    return np.asarray(others * evidence.live + (1.0 - others) * shaded, dtype=np.float32)


def _others(evidence: Evidence) -> FloatArray:
    """(H, W) 0..1: how much of a window other objects cover, before or behind."""
    view = evidence.view
    rows, columns = view.part
    others = np.zeros((rows.stop - rows.start, columns.stop - columns.start), np.float32)
    for layer in evidence.layers:
        height, width = layer.alpha.shape
        top, bottom = max(layer.top, rows.start), min(layer.top + height, rows.stop)
        left, right = max(layer.left, columns.start), min(layer.left + width, columns.stop)
        if top < bottom and left < right:
            drawn = layer.alpha[top - layer.top : bottom - layer.top]
            drawn = drawn[:, left - layer.left : right - layer.left]
            part = others[top - rows.start : bottom - rows.start]
            part = part[:, left - columns.start : right - columns.start]
            np.maximum(part, drawn, out=part)
    return resized(others, (evidence.live.shape[1], evidence.live.shape[0]))
