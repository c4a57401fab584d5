"""Small objects: the pose at which one drawn into the empty room explains the live picture best.

At twenty pixels an outline is a contact shadow's as much as the object's own; the colours of the
object and of what is behind it tell them apart (dense likelihood, Nelder & Mead 1965).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from scenes.pose import Pose
from tracking.background import expose
from tracking.evidence import Evidence, Scene
from tracking.extent import part_of
from tracking.model import RENDER_OPTIONS, TrackModel
from tracking.native import Alone, Setting
from tracking.pictures import resized
from tracking.resemblance import CLOSELY, ROUGHLY, how_much_lighter
from tracking.window import Layer

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

AROUND_PX = 6
"""How far around an object's box the picture counts."""

SHADE_RANGE = (0.35, 1.0)
"""How much darker the empty room may be in the object's shadow."""

STEP_M, STEP_RAD = 0.04, 0.2
STEP_PRICE = 4.0
"""First steps, and what a step away from the start costs, in pixels wholly unexplained."""

TRIED_ROUGHLY, TRIED_CLOSELY, TRIED_KNOWN = 24, 36, 32
"""How many poses are tried near a believed one to come near the best, and to tell it closely; the
last of an object whose place is known."""

CLOSE_STEP_M, CLOSE_STEP_RAD = 0.025, 0.15
RESOLVED = 0.001
"""First steps where a pose is told closely, and differences of resemblance that end it."""

FINER = 2
"""There, objects are drawn with so many pixels each way per pixel: at a few pixels the many splats
of each widen the silhouette by a pixel, as if it were nearer."""


Upright = tuple[float, float, float, float]
"""x, y, z in metres and yaw in radians of `world_from_object`."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A part of the live picture in which an object is drawn.

    Attributes:
        roughly: what it shows, and would show without the object; for poses near the right one.
        closely: the same for poses that are right to a pixel.
        drawn: the object alone as its camera sees it.
        finely: the same with `FINER` pixels each way.
    """

    roughly: Setting
    closely: Setting
    drawn: Alone
    finely: Alone

    def strange(self, upright: Upright) -> float:
        """In how many pixels the picture is not what the object at a pose near by would make it."""
        return self.roughly.strange_at(self.drawn, [upright])[0]

    def close_resemblance(self, upright: Upright) -> float:
        """How much the object at just this pose resembles the picture."""
        return self.closely.resemblance_at(self.finely, [upright])[0]


def explained(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_start: Pose
) -> tuple[Pose, float]:
    """The pose near a start, on its height, at which the object explains the picture best.

    Returns:
        The pose, and how much the object at just this pose resembles the picture there, see
        `tracking.resemblance.Setting.resemblance`.
    """
    world_from_rough, _ = roughly_explained(scene, model, evidence, world_from_start)
    return closely_explained(scene, model, evidence, world_from_rough, tried=TRIED_KNOWN)


def roughly_explained(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_start: Pose
) -> tuple[Pose, float]:
    """The same with less effort and a pull to the start; `closely_explained` goes on from there."""
    place = surroundings_of(scene, model, evidence, world_from_start)
    if place is None:
        return world_from_start, 0.0

    def cost(steps: Points) -> float:
        strange_px = place.strange(_stepped(start, steps, STEP_M, STEP_RAD))
        return strange_px + STEP_PRICE * float(steps @ steps)

    start = upright_of(world_from_start)
    steps, _ = _least(cost, TRIED_ROUGHLY, resolved=0.1)
    found = _stepped(start, steps, STEP_M, STEP_RAD)
    return pose_of(found), place.close_resemblance(found)


def closely_explained(
    scene: Scene,
    model: TrackModel,
    evidence: Evidence,
    world_from_rough: Pose,
    *,
    tried: int = TRIED_CLOSELY,
) -> tuple[Pose, float]:
    """The same from a rough pose, which nothing but the picture speaks for: it has no pull."""
    place = surroundings_of(scene, model, evidence, world_from_rough)
    if place is None:
        return world_from_rough, 0.0

    def cost(steps: Points) -> float:
        return -place.close_resemblance(_stepped(rough, steps, CLOSE_STEP_M, CLOSE_STEP_RAD))

    rough = upright_of(world_from_rough)
    steps, least = _least(cost, tried, resolved=RESOLVED)
    return pose_of(_stepped(rough, steps, CLOSE_STEP_M, CLOSE_STEP_RAD)), -least


def _least(
    cost: Callable[[Points], float], evaluations: int, *, resolved: float
) -> tuple[Points, float]:
    """(3,) steps of x, y and yaw at which a cost is lowest, of so many tried; the cost there."""
    simplex = np.vstack([np.zeros(3), np.eye(3)])
    options = {"maxfev": evaluations, "initial_simplex": simplex, "xatol": 0.02, "fatol": resolved}
    found = minimize(cost, np.zeros(3), method="Nelder-Mead", options=options)
    return np.asarray(found.x, dtype=np.float64), float(found.fun)


def _stepped(start: Upright, steps: Points, step_m: float, step_rad: float) -> Upright:
    """The pose so many steps of x, y and yaw from a start."""
    across, along, turns = steps.tolist()
    x, y, z, yaw = start
    return x + step_m * across, y + step_m * along, z, yaw + step_rad * turns


def upright_of(world_from_object: Pose) -> Upright:
    """Place and yaw of something that stands."""
    x, y, z = world_from_object.translation.tolist()
    return x, y, z, world_from_object.yaw()


def pose_of(upright: Upright) -> Pose:
    """`world_from_object` of something that stands."""
    *place, yaw = upright
    return Pose.from_yaw(yaw, place)


def resemblances(place: Place | None, poses: Sequence[Pose]) -> Points:
    """(N,) how much rough poses at one place look like the picture, at most 1, 0 for by chance.

    See `tracking.resemblance.Setting.resemblance`.

    Args:
        place: around the first of them; where it is None there is nothing to look like.
        poses: `world_from_object` of each.
    """
    if place is None:
        return np.zeros(len(poses))
    upright = [upright_of(pose) for pose in poses]
    return np.array(place.roughly.resemblance_at(place.drawn, upright))


def surroundings_of(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_object: Pose
) -> Place | None:
    """The surroundings of an object at a pose; None if nothing of it is in the window."""
    part = _around(model, evidence, world_from_object)
    if part is None:
        return None
    live = np.ascontiguousarray(evidence.live[part])
    free = 1.0 - evidence.hidden[part]
    camera = part_of(evidence.camera, part)
    size = (camera.width_px, camera.height_px)
    empty = _empty(scene, evidence, part, live)
    roughly, closely = (
        Setting(live, empty, free, size=size, constants=constants)
        for constants in (ROUGHLY, CLOSELY)
    )
    splats, world_from_camera = model.source.splats, evidence.world_from_camera
    drawn, finely = (
        scene.renderer.alone(splats, seen_by, world_from_camera, RENDER_OPTIONS)
        for seen_by in (camera, camera.resized(FINER * size[0], FINER * size[1]))
    )
    return Place(roughly, closely, drawn, finely)


def _around(
    model: TrackModel, evidence: Evidence, world_from_object: Pose
) -> tuple[slice, slice] | None:
    """Rows and columns around an object's box, None if it is outside the window."""
    camera = evidence.camera
    corners = evidence.world_from_camera.inverse() @ model.box_at(world_from_object)
    pixels, seen = camera.project(corners)
    low = np.floor(pixels.min(axis=0)) - AROUND_PX
    high = np.ceil(pixels.max(axis=0)) + AROUND_PX
    size = np.array([camera.width_px, camera.height_px])
    if not seen.any() or (low >= size).any() or (high <= 0).any():
        return None
    (left, top), (right, bottom) = (
        np.maximum(low, 0).astype(int),
        np.minimum(high, size).astype(int),
    )
    return slice(int(top), int(bottom)), slice(int(left), int(right))


def _empty(
    scene: Scene, evidence: Evidence, part: tuple[slice, slice], live: FloatArray
) -> FloatArray:
    """(H, W, 3) a part of a window without the object, as the live camera records the empty room.

    It is shaded like that; what shows another object is as in the live picture.
    """
    view, size = evidence.view, (live.shape[1], live.shape[0])
    lens = scene.frame.rig.lenses[view.lens]
    rows, columns = part
    top, left = view.top + rows.start * view.shrink, view.left + columns.start * view.shrink
    cut = slice(top, top + size[1] * view.shrink), slice(left, left + size[0] * view.shrink)
    plate = resized(np.ascontiguousarray(scene.plates.images[view.lens][cut]), size)
    x = (left + (np.arange(size[0]) + 0.5) * view.shrink) * 2 / lens.width_px - 1
    y = (top + (np.arange(size[1]) + 0.5) * view.shrink) * 2 / lens.height_px - 1
    radius2 = (x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32)
    room = expose(plate, scene.exposures[view.lens], radius2=radius2)
    everywhere = np.ones(live.shape[:2], np.float32)
    shade = how_much_lighter(room, everywhere, live, limits=SHADE_RANGE)
    others = resized(_others(evidence.layers, cut), size)[..., None]
    empty = others * live + (1.0 - others) * (room * shade[..., None])
    return np.ascontiguousarray(empty, dtype=np.float32)


def _others(layers: Sequence[Layer], cut: tuple[slice, slice]) -> FloatArray:
    """(H, W) 0..1: how much of a part of a lens other objects cover, before or behind."""
    rows, columns = cut
    others = np.zeros((rows.stop - rows.start, columns.stop - columns.start), np.float32)
    for layer in layers:
        height, width = layer.alpha.shape
        top, bottom = max(layer.top, rows.start), min(layer.top + height, rows.stop)
        left, right = max(layer.left, columns.start), min(layer.left + width, columns.stop)
        if top < bottom and left < right:
            drawn = layer.alpha[top - layer.top : bottom - layer.top]
            drawn = drawn[:, left - layer.left : right - layer.left]
            part = others[top - rows.start : bottom - rows.start]
            part = part[:, left - columns.start : right - columns.start]
            np.maximum(part, drawn, out=part)
    return others
