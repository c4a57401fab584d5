"""Small objects: the pose at which one drawn into the empty room explains the live picture best.

At twenty pixels an outline is a contact shadow's as much as the object's own; the colours of the
object and of what is behind it tell them apart (dense likelihood, Nelder & Mead 1965).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from scenes.pose import Pose
from scenes.render.renderer import PosedSplats
from tracking.align import shifted
from tracking.background import expose
from tracking.evidence import Evidence, Scene
from tracking.extent import part_of
from tracking.model import RENDER_OPTIONS, TrackModel
from tracking.native import Alone, Setting
from tracking.pictures import resized
from tracking.relight import LitView, Shell
from tracking.resemblance import CLOSELY, ROUGHLY, how_much_lighter
from tracking.window import Layer

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

SLID = 1.0
GAIN_RANGE = (0.5, 2.5)
"""How far an object is slid to where it fits roughly, in radii; how much lighter it may be there
than in its scan."""

AROUND_PX = 6
"""How far around an object's box the picture counts."""

SHADE_RANGE = (0.35, 1.0)
"""How much darker the empty room may be in the object's shadow."""

STEP_M, STEP_RAD = 0.04, 0.2
STEP_PRICE = 4.0
"""First steps, and what a step away from the start costs, in pixels wholly unexplained."""

TRIED_ROUGHLY, TRIED_CLOSELY, TRIED_KNOWN = 24, 20, 18
"""How many poses are tried near a believed one to come near the best, and to tell it closely; the
last of an object whose place is known."""

CLOSE_STEP_M, CLOSE_STEP_RAD = 0.025, 0.15
LIT_ANEW = (1.0, 0.6)
RESOLVED = 0.001
"""First steps where a pose is told closely, the shares of them that are taken each time its light
was told, and differences of resemblance that end it."""

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
        view: the same, for the light there.
        shell: the object.
    """

    roughly: Setting
    closely: Setting
    view: LitView
    shell: Shell

    def resemblance(self, world_from_object: Pose) -> float:
        """How much the object at a pose near by resembles the picture, in whatever light."""
        return self.roughly.resemblance(*self.view.lit(self.shell, world_from_object))

    def strange(self, lit: Alone, upright: Upright) -> float:
        """In how many pixels the picture is not what the object at a pose near by would make it."""
        return self.roughly.strange_at(lit, [upright])[0]

    def close_resemblance(self, lit: Alone, upright: Upright) -> float:
        """How much the object at just this pose resembles the picture."""
        return self.closely.resemblance_at(lit, [upright])[0]

    def lit(self, upright: Upright, *, finer: int = 1) -> Alone:
        """The object, to be drawn in the light in which it would look most like the picture.

        Args:
            upright: a pose, for the light.
            finer: it is drawn with so many pixels each way per pixel.
        """
        camera = self.view.camera
        if finer > 1:
            camera = camera.resized(finer * camera.width_px, finer * camera.height_px)
        splats = self.view.relit(self.shell, pose_of(upright))
        return self.view.renderer.alone(splats, camera, self.view.world_from_camera, RENDER_OPTIONS)


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

    start = upright_of(world_from_start)
    lit = place.lit(start)

    def cost(steps: Points) -> float:
        strange_px = place.strange(lit, _stepped(start, steps, STEP_M, STEP_RAD))
        return strange_px + STEP_PRICE * float(steps @ steps)

    steps, _ = _least(cost, TRIED_ROUGHLY, resolved=0.1)
    found = _stepped(start, steps, STEP_M, STEP_RAD)
    return pose_of(found), place.close_resemblance(place.lit(found, finer=FINER), found)


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

    found = upright_of(world_from_rough)
    for share in LIT_ANEW:
        # The light is told at the pose before, and is as wrong as that.
        found = _told(place, found, share, tried)
    return pose_of(found), place.close_resemblance(place.lit(found, finer=FINER), found)


def _told(place: Place, start: Upright, share: float, tried: int) -> Upright:
    """The pose near a start that resembles the picture most in the light told at the start."""
    lit = place.lit(start, finer=FINER)
    step_m, step_rad = share * CLOSE_STEP_M, share * CLOSE_STEP_RAD

    def cost(steps: Points) -> float:
        return -place.close_resemblance(lit, _stepped(start, steps, step_m, step_rad))

    steps, _ = _least(cost, tried, resolved=RESOLVED)
    return _stepped(start, steps, step_m, step_rad)


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


def resemblance_at(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_object: Pose
) -> float:
    """How much an object at a rough pose looks like the picture, at most 1, 0 for by chance.

    See `tracking.resemblance.Setting.resemblance`.
    """
    place = surroundings_of(scene, model, evidence, world_from_object)
    return 0.0 if place is None else place.resemblance(world_from_object)


class Slide:
    """Slides a drawn small object over its window to where it explains most of what has changed.

    Args:
        scene: the frame.
        model: the object.
        evidence: its window.
    """

    def __init__(self, scene: Scene, model: TrackModel, evidence: Evidence) -> None:
        height, width = evidence.live.shape[:2]
        live = np.ascontiguousarray(evidence.live)
        empty = _empty(scene, evidence, (slice(0, height), slice(0, width)), live)
        free = 1.0 - evidence.hidden
        apart = live - empty
        changed = np.einsum("hwc,hwc->hw", apart, apart) - np.einsum("hwc,hwc->hw", live, live)
        self._reach_px = round(
            SLID * evidence.camera.f_px * model.radius_m / evidence.view.target_range_m
        )
        self._changed = self._framed((free * changed).astype(np.float32))
        self._live = self._framed(free[..., None] * live)
        self._renderer, self._model, self._evidence = scene.renderer, model, evidence

    def best(self, world_from_object: Pose) -> Pose:
        """The pose at which it does, without being turned."""
        evidence, model = self._evidence, self._model
        posed = (PosedSplats(model.shell.splats, world_from_object),)
        drawn = self._renderer.render(
            posed, evidence.camera, evidence.world_from_camera, RENDER_OPTIONS
        )
        colours = drawn.rgb
        # Of the change's energy, as much is explained as `bare + 2 · gain · both - gain² · power`.
        bare = cv2.matchTemplate(self._changed, drawn.alpha, cv2.TM_CCORR)
        both = cv2.matchTemplate(self._live, colours, cv2.TM_CCORR)
        power = max(float((colours * colours).sum()), 1e-6)
        gain = np.clip(both / power, *GAIN_RANGE)
        explained = bare + 2.0 * gain * both - gain * gain * power
        row, column = np.unravel_index(np.argmax(explained), explained.shape)
        shift = np.array([column, row], dtype=np.float64) - self._reach_px
        return shifted(world_from_object, shift, evidence, model, grounded=True)

    def _framed(self, picture: FloatArray) -> FloatArray:
        reach = self._reach_px
        framed = cv2.copyMakeBorder(
            picture, reach, reach, reach, reach, cv2.BORDER_CONSTANT, value=(0.0, 0.0, 0.0)
        )
        return np.asarray(framed, dtype=np.float32)


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
    view = LitView(live, empty, free, camera, evidence.world_from_camera, scene.renderer)
    return Place(roughly, closely, view, model.shell)


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
    shade = how_much_lighter(room, live, limits=SHADE_RANGE)
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
