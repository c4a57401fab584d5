"""Births: poses that an object may have gone to since it was known, found in one picture.

A step of a frame bridges a part of an object; who lifts, turns or carries one takes it farther.
Around where it should be now, all places, heights and yaws are compared with the object at a coarse
scale; the likeliest climb the likelihood there and are refined. A search over the whole room takes
many frames and works on the picture in which it began; somebody who carries an object has gone on
by then.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Neighbour, Scene, gather
from tracking.evidence.observation import Observation, observe
from tracking.hypotheses.hypothesis import CLEAR_NATS, Hypothesis, distinct, is_other
from tracking.hypotheses.lens_look import LensLook
from tracking.hypotheses.prior import MOVED, UNSEEN
from tracking.hypotheses.proposals import (
    MIN_CHANGED,
    changed_share,
    cuts_at,
    proposed,
    proposed_by_overlap,
)
from tracking.hypotheses.refinement import START_SIGMA, refine
from tracking.hypotheses.search import HOPELESS_NATS, ObjectWindow, judge_in_any_light
from tracking.likelihood.pixel_model import EXACTLY, ROUGHLY, Tolerance
from tracking.likelihood.pose_likelihood import pose_supports
from tracking.model.object_model import TrackModel
from tracking.model.symmetry import ROUND
from tracking.model.templates import compare
from tracking.window.window import Window, window_around

Points = NDArray[np.float64]

LOOK_PX = 24.0
"""Radius in px at which an object is looked for."""

REFINED_PX = 60.0
"""Radius in px at which it is refined at most."""

STEP = 0.5
"""Places are this far apart, in radii of the object: what a climb bridges."""

MAX_PLACES = 600
"""Places compared with templates at most, the most changed."""

WIDE_M = 0.45
"""Reach in m from which places are kept by all their templates' ways of scoring them: a step of a
frame is shorter, and what is in the object's colours tells enough then."""

PLACES = 8
"""Places kept by their templates."""

YAWS = 12
"""Yaws compared where the object is expected."""

CLIMBED = (12, 3)
"""Poses that climb the likelihood, the likeliest by their rough one, and of those again. Of 111
looks for objects that people carry in four random rooms, 43 found them with 6 at first, 46 with 12
and 50 with 24, in 260, 300 and 370 ms."""

CLIMB_STEPS = (0.25, 0.125)
"""Steps of a climb, in radii of the object and rad: half of what lies between two starts."""

REFINED = 2
"""Of those, refined."""

MIN_TOP = 0.1
"""Distance of a parabola's top, in steps, from which a pose there is tried."""

STANDING_M = 0.01
"""Height in m above a support plane up to which an object stands on it."""

CARRIED_SIGMA_M = 0.08
"""Standard deviation in m of the height of what is carried, before it is refined."""


@dataclass(frozen=True, slots=True)
class Expected:
    """Poses and places that an object may have gone to since it was known.

    Attributes:
        poses: where it should be now, `world_from_object`, the likeliest first.
        reach_m: how far it may be from the first of them.
        supports_m: heights of support planes in reach.
        lifts_m: other heights of its origin that are tried.
    """

    poses: tuple[Pose, ...]
    reach_m: float
    supports_m: tuple[float, ...]
    lifts_m: tuple[float, ...]

    def stands(self, world_from_object: Pose) -> bool:
        """Whether a pose is on one of the support planes."""
        height = float(world_from_object.translation[2])
        return any(abs(height - support) < STANDING_M for support in self.supports_m)

    def log_prior(self, model: TrackModel, world_from_object: Pose) -> float:
        """Log odds of one pose there against being nowhere in view: shared by all places."""
        count = math.pi * self.reach_m**2 / (2.0 * model.radius_m) ** 2
        carried = 0.0 if self.stands(world_from_object) else -CLEAR_NATS
        return math.log(MOVED / UNSEEN / max(count, 1.0)) + carried


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """The surroundings of where an object is expected, at the scale at which it is looked for.

    Attributes:
        scene: the frame.
        model: the object.
        expected: where it may be.
        look: what the lens shows there, at one scale.
    """

    scene: Scene
    model: TrackModel
    expected: Expected
    look: LensLook

    @property
    def observation(self) -> Observation:
        """Of the surroundings."""
        return self.look.levels[0]

    def log_odds(self, poses: Sequence[Pose], *, tolerance: Tolerance = EXACTLY) -> list[float]:
        """Log odds of the object, drawn coarsely, at each of some poses."""
        supports = pose_supports(
            self.observation,
            self.model,
            poses=poses,
            renderer=self.scene.renderer,
            tolerance=tolerance,
            is_coarse=True,
        )
        priors = (self.expected.log_prior(self.model, pose) for pose in poses)
        return [support.nats + prior for support, prior in zip(supports, priors, strict=True)]


def born(
    scene: Scene, model: TrackModel, *, neighbours: Sequence[Neighbour], expected: Expected
) -> list[Hypothesis]:
    """Poses an object may have gone to, the likeliest first.

    Args:
        scene: the frame.
        model: the object.
        neighbours: the other tracked objects.
        expected: where it may be.
    """
    around = surroundings(scene, model, neighbours=neighbours, expected=expected)
    starts = starts_in(around)
    if not starts:
        return []
    climbed = _climbed(around, starts)
    likely = [pose for odds, pose in climbed if odds > climbed[0][0] - HOPELESS_NATS]
    found: list[tuple[Hypothesis, ObjectWindow]] = []
    for pose in [*_apart(model, likely, count=REFINED), *_expected_closely(expected)]:
        view = _view(scene, model, around=pose, radius_m=model.radius_m, wanted_px=REFINED_PX)
        evidence = gather(scene, model, view, neighbours)
        window = ObjectWindow(evidence, observe(scene, evidence, is_looked_for=True))
        height_sigma = START_SIGMA[2] if expected.stands(pose) else CARRIED_SIGMA_M
        sigma = (*START_SIGMA[:2], height_sigma, START_SIGMA[3])
        refined = refine(scene, model, pose, evidence, window.observation, sigma=sigma)
        prior = expected.log_prior(model, refined.world_from_object)
        found.append((replace(refined, log_prior=prior), window))
    return distinct(model, judge_in_any_light(scene, model, found))


def _expected_closely(expected: Expected) -> list[Pose]:
    """Poses that are refined whatever shows coarsely: the likeliest one, and a little above it."""
    likeliest = expected.poses[0]
    up = np.array([0.0, 0.0, 0.5 * CARRIED_SIGMA_M])
    lifted = [Pose(likeliest.rotation, likeliest.translation + up)] if expected.lifts_m else []
    return [likeliest, *lifted]


def surroundings(
    scene: Scene, model: TrackModel, *, neighbours: Sequence[Neighbour], expected: Expected
) -> Surroundings:
    """The surroundings of where an object is expected, by the lens that sees them best."""
    reach_m = expected.reach_m + model.radius_m
    view = _view(scene, model, around=expected.poses[0], radius_m=reach_m, wanted_px=LOOK_PX)
    evidence = gather(scene, model, view, neighbours)
    level = observe(scene, evidence, is_looked_for=True)
    picture = np.dstack([evidence.live, evidence.own, evidence.foreground])
    look = LensLook((level,), level.world_from_camera, picture.astype(np.float32))
    return Surroundings(scene, model, expected, look)


def _view(
    scene: Scene, model: TrackModel, *, around: Pose, radius_m: float, wanted_px: float
) -> Window:
    """A window about a place in which the object's radius is not much more than wanted."""
    rig, centre = scene.frame.rig, model.centre_at(around)
    view = window_around(rig, scene.world_from_rig, centre, radius_m=radius_m)
    range_m = max(view.target_range_m, model.radius_m)
    radius_px = rig.lenses[view.lens].f_px * model.radius_m / range_m
    shrink = max(math.floor(radius_px / wanted_px), 1)
    if shrink <= view.shrink:
        return view
    return window_around(rig, scene.world_from_rig, centre, radius_m=radius_m, shrink=shrink)


def starts_in(around: Surroundings) -> list[Pose]:
    """Poses to begin with: where templates fit, and all yaws where the object is expected."""
    look, model, expected = around.look, around.model, around.expected
    starts: list[Pose] = []
    places = _places(around)
    if len(places) > 0:
        cuts = cuts_at(look, model, places)
        similarity = compare(cuts, model.templates)
        if expected.reach_m > WIDE_M:
            starts += proposed(look, model, places, cuts, similarity)
        else:
            starts += proposed_by_overlap(model, places, cuts, similarity, count=PLACES)
    likeliest, *others = expected.poses
    turns = 1 if model.symmetry == ROUND else YAWS
    yaws = likeliest.yaw() + 2.0 * math.pi * np.arange(turns) / turns
    starts += [Pose.from_yaw(float(yaw), likeliest.translation) for yaw in yaws]
    return starts + others


def _places(around: Surroundings) -> Points:
    """(P, 3) places in reach that the look shows, and that do not show the empty room."""
    look, model, expected = around.look, around.model, around.expected
    reach_m, last = expected.reach_m, expected.poses[0].translation
    along = np.arange(-reach_m, reach_m + 1e-9, STEP * model.radius_m)
    x, y = (axis.ravel() for axis in np.meshgrid(along, along))
    flat = np.stack([x, y], axis=1)[x**2 + y**2 <= reach_m**2] + last[:2]
    heights = (*expected.supports_m, *expected.lifts_m)
    places = np.concatenate(
        [np.column_stack([flat, np.full(len(flat), height)]) for height in heights]
    )
    centres = look.world_from_lens.inverse() @ (places + model.centre_m)
    distance = np.linalg.norm(centres, axis=1)
    angle = np.arctan2(np.hypot(centres[:, 0], centres[:, 1]), centres[:, 2])
    places = places[(angle < look.camera.max_angle) & (distance > model.radius_m)]
    if len(places) == 0:
        return places
    share = changed_share(look, model, places)
    order = np.argsort(-share, kind="stable")[:MAX_PLACES]
    return places[order[share[order] > MIN_CHANGED]]


def _apart(model: TrackModel, poses: Sequence[Pose], *, count: int) -> list[Pose]:
    """The first so many poses, without those that say the same as one before them."""
    kept: list[Pose] = []
    for pose in poses:
        if len(kept) == count:
            break
        if all(is_other(model, pose, other) for other in kept):
            kept.append(pose)
    return kept


Ranked = tuple[float, Pose]
"""Log odds of a pose, and the pose."""


def _climbed(around: Surroundings, starts: Sequence[Pose]) -> list[Ranked]:
    """The likeliest starts, climbed: the best of all a sweep, the best of those another one."""
    rough = around.log_odds(starts, tolerance=ROUGHLY)
    order = sorted(range(len(starts)), key=lambda index: -rough[index])
    poses = _apart(around.model, [starts[index] for index in order], count=CLIMBED[0])
    climbed: list[Ranked] = list(zip(around.log_odds(poses), poses, strict=True))
    for count, step in zip(CLIMBED, CLIMB_STEPS, strict=True):
        climbed = climb(around, climbed[:count], step=step)
        climbed.sort(key=lambda item: -item[0])
    return climbed


def climb(around: Surroundings, starts: Sequence[Ranked], *, step: float) -> list[Ranked]:
    """The likeliest poses reached from some starts, each by a sweep over its coordinates.

    Along each coordinate the likeliest of three poses, or of the parabola through them.

    Args:
        around: the surroundings.
        starts: where to begin; what stands there is not lifted.
        step: in radii of the object, and rad.
    """
    best = list(starts)
    axes = [_axes(around, world_from_start) for _, world_from_start in starts]
    for turn in range(max(map(len, axes), default=0)):
        moving = [(index, some[turn]) for index, some in enumerate(axes) if turn < len(some)]
        moves = _likeliest_along(around, [(axis, best[index]) for index, axis in moving], step=step)
        for (index, _), found in zip(moving, moves, strict=True):
            best[index] = found
    return best


def _likeliest_along(
    around: Surroundings, moving: Sequence[tuple[Axis, Ranked]], *, step: float
) -> list[Ranked]:
    """The likeliest of each pose and those along its coordinate."""
    beside = [axis.moved(pose, sign * step) for axis, (_, pose) in moving for sign in (-1.0, 1.0)]
    tried = list(zip(around.log_odds(beside), beside, strict=True))
    found = [
        max([here, *tried[2 * index : 2 * index + 2]], key=lambda item: item[0])
        for index, (_, here) in enumerate(moving)
    ]
    tops: list[tuple[int, Pose]] = []
    for index, (axis, (odds, pose)) in enumerate(moving):
        (low, _), (high, _) = tried[2 * index : 2 * index + 2]
        bend = 2.0 * odds - low - high
        top = 0.5 * (high - low) / bend if bend > 0.0 else 0.0
        if MIN_TOP < abs(top) < 1.0:
            tops.append((index, axis.moved(pose, top * step)))
    between = around.log_odds([pose for _, pose in tops])
    for (index, pose), odds in zip(tops, between, strict=True):
        found[index] = max(found[index], (odds, pose), key=lambda item: item[0])
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """A coordinate of a climb: (3,) metres and radians by which a pose moves along it."""

    shift_m: Points
    turn_rad: float

    def moved(self, world_from_object: Pose, length: float) -> Pose:
        """A pose moved along the coordinate by so many times its unit."""
        yaw = world_from_object.yaw() + length * self.turn_rad
        return Pose.from_yaw(yaw, world_from_object.translation + length * self.shift_m)


def _axes(around: Surroundings, pose: Pose) -> list[Axis]:
    """Coordinates of a climb: across the sight, turned, up unless it stands, along the sight."""
    model = around.model
    away = model.centre_at(pose) - around.look.world_from_lens.translation
    ahead = np.array([away[0], away[1], 0.0]) / max(float(np.hypot(away[0], away[1])), 1e-9)
    across, up = np.array([-ahead[1], ahead[0], 0.0]), np.array([0.0, 0.0, 1.0])
    turned = [] if model.symmetry == ROUND else [Axis(np.zeros(3), 1.0)]
    raised = [] if around.expected.stands(pose) else [Axis(model.radius_m * up, 0.0)]
    sideways, onwards = (Axis(model.radius_m * shift, 0.0) for shift in (across, ahead))
    return [sideways, *turned, *raised, onwards]
