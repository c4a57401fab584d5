"""Births: poses that an object may have gone to since it was known, found in one picture.

A step of a frame bridges a part of an object; who lifts, turns or carries one takes it farther.
Around where it should be now, all places, heights and likely yaws are compared with the object at
a coarse scale; the likeliest climb the likelihood there and are refined. A search over the whole
room takes many frames and works on the picture in which it began; somebody who carries an object
has gone on by then.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Neighbour, Scene, gather
from tracking.evidence.observation import Observation, observe
from tracking.hypotheses.clouds import Cloud, climb
from tracking.hypotheses.hypothesis import CLEAR_NATS, Hypothesis, distinct, is_other
from tracking.hypotheses.lens_look import LensLook
from tracking.hypotheses.prior import MOVED, UNSEEN
from tracking.hypotheses.proposals import MIN_CHANGED, changed_share, cuts_at, likeliest_at_each
from tracking.hypotheses.refinement import START_SIGMA, for_climb, refine
from tracking.hypotheses.search import HOPELESS_NATS, ObjectWindow, judge_in_any_light
from tracking.likelihood.drawn_object import radius_px
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
"""Places compared at most, the most changed."""

YAWS = 12
"""Yaws compared where the object is expected."""

RANKED_PX = 10.0
"""Radius in px at which starts are ranked. Of 172 looks for objects that people carry in fourteen
rooms one near the truth was among the first twelve in 130, with 134 at 24 px for three times the
time, and with 114 to 124 where a pose need not be exact."""

COARSE_ROUNDS = ((24, 16), (12, 16))
"""Rounds of a climb at that scale."""

ROUNDS = ((8, 16), (4, 24), (3, 24))
"""Rounds at the scale of the look. Of 187 looks 98 are right by these, 96 without the coarse ones,
and 100 with half of all three kinds of rounds."""

CLOSE_ROUNDS = ((1, 24), (1, 24), (1, 24))
"""Rounds for the likeliest refined pose: 105 are right, and 108 with those for all of them, which
takes a fifth longer."""

START_SPREAD, CLOSE_SPREAD = 0.25, 0.15
"""Spread of a first cloud, in radii of the object and rad: half of what lies between two starts,
and what an alignment leaves."""

WORTH_NATS = 1.0
"""Gain of a climb from which its pose is refined once more: with less it stays in the solver's own
uncertainty."""

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
    """The surroundings of where an object is expected.

    Attributes:
        scene: the frame.
        model: the object.
        expected: where it may be.
        look: of the lens, there.
        observation: what poses are compared with, at the scale of the look or another one.
    """

    scene: Scene
    model: TrackModel
    expected: Expected
    look: LensLook
    observation: Observation

    def coarse(self) -> Surroundings:
        """The same at the scale at which starts are ranked."""
        times = radius_px(self.observation, self.model, self.expected.poses[0]) / RANKED_PX
        return replace(self, observation=self.observation.shrunk(max(math.floor(times), 1)))

    def log_odds(self, poses: Sequence[Pose]) -> list[float]:
        """Log odds of the object, drawn coarsely, at each of some poses."""
        supports = pose_supports(
            self.observation,
            self.model,
            poses=poses,
            renderer=self.scene.renderer,
            is_coarse=True,
        )
        priors = (self.expected.log_prior(self.model, pose) for pose in poses)
        return [support.nats + prior for support, prior in zip(supports, priors, strict=True)]

    def cloud(self, world_from_object: Pose, *, spread: float) -> Cloud:
        """Poses about one, so many radii and rad wide: what stands is not lifted."""
        length_m = spread * self.model.radius_m
        up = 0.0 if self.expected.stands(world_from_object) else length_m
        turn = 0.0 if self.model.symmetry == ROUND else spread
        return Cloud(world_from_object, np.diag([length_m, length_m, up, turn]))


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
    likely = _likeliest(around, starts)
    poses = [*likely, *set_down(around, likely[0]), *_expected_closely(expected)]
    found = _all_refined(scene, model, poses=poses, neighbours=neighbours, expected=expected)
    likeliest, window = found[0]
    found[0] = _climbed_closely(around, likeliest, window=window)
    return distinct(model, judge_in_any_light(scene, model, found))


def seen_again(
    scene: Scene,
    model: TrackModel,
    *,
    poses: Sequence[Pose],
    neighbours: Sequence[Neighbour],
    expected: Expected,
) -> list[Hypothesis]:
    """Poses that an object had in an earlier picture, refined in this one, the likeliest first.

    Args:
        scene: the frame.
        model: the object.
        poses: `world_from_object`.
        neighbours: the other tracked objects.
        expected: where it may be.
    """
    found = _all_refined(scene, model, poses=poses, neighbours=neighbours, expected=expected)
    return distinct(model, judge_in_any_light(scene, model, found))


def _likeliest(around: Surroundings, starts: Sequence[Pose]) -> list[Pose]:
    """The likeliest poses that the likeliest starts climb to."""
    coarse, model = around.coarse(), around.model
    odds = coarse.log_odds(starts)
    order = sorted(range(len(starts)), key=lambda index: -odds[index])
    ranked = _apart(model, [starts[index] for index in order], count=COARSE_ROUNDS[0][0])
    clouds = [around.cloud(pose, spread=START_SPREAD) for pose in ranked]
    clouds = climb(clouds, coarse.log_odds, rounds=COARSE_ROUNDS)
    clouds = climb(clouds, around.log_odds, rounds=ROUNDS)
    least = clouds[0].log_odds - HOPELESS_NATS
    likely = [cloud.world_from_object for cloud in clouds if cloud.log_odds >= least]
    return _apart(model, likely, count=len(likely))


def _all_refined(
    scene: Scene,
    model: TrackModel,
    *,
    poses: Sequence[Pose],
    neighbours: Sequence[Neighbour],
    expected: Expected,
) -> list[tuple[Hypothesis, ObjectWindow]]:
    """Poses refined closely, each with the window that shows it, the likeliest first."""
    found: list[tuple[Hypothesis, ObjectWindow]] = []
    for pose in poses:
        view = _view(scene, model, around=pose, radius_m=model.radius_m, wanted_px=REFINED_PX)
        evidence = gather(scene, model, view, neighbours)
        window = ObjectWindow(evidence, observe(scene, evidence, is_looked_for=True))
        refined = _refined(scene, model, window=window, world_from_start=pose, expected=expected)
        found.append((refined, window))
    return sorted(found, key=lambda item: -item[0].log_odds)


def _refined(
    scene: Scene,
    model: TrackModel,
    *,
    window: ObjectWindow,
    world_from_start: Pose,
    expected: Expected,
) -> Hypothesis:
    """A pose refined in a window that shows it."""
    is_standing = expected.stands(world_from_start)
    height_sigma = START_SIGMA[2] if is_standing else CARRIED_SIGMA_M
    refined = refine(
        scene,
        model,
        world_from_start,
        window.evidence,
        window.observation,
        sigma=(*START_SIGMA[:2], height_sigma, START_SIGMA[3]),
    )
    prior = expected.log_prior(model, refined.world_from_object)
    return replace(refined, log_prior=prior)


def _climbed_closely(
    around: Surroundings, refined: Hypothesis, *, window: ObjectWindow
) -> tuple[Hypothesis, ObjectWindow]:
    """A refined pose, or what it climbs to at the scale of its own window, refined once more."""
    here = refined.world_from_object
    seen = for_climb(window.observation, around.model, world_from_object=here)
    close = replace(around, observation=seen)
    (odds,) = close.log_odds([here])
    start = around.cloud(here, spread=CLOSE_SPREAD)
    highest = climb([start], close.log_odds, rounds=CLOSE_ROUNDS)[0]
    if highest.log_odds < odds + WORTH_NATS:
        return refined, window
    again = _refined(
        around.scene,
        around.model,
        window=window,
        world_from_start=highest.world_from_object,
        expected=around.expected,
    )
    return max(refined, again, key=lambda item: item.log_odds), window


def set_down(around: Surroundings, world_from_lifted: Pose) -> list[Pose]:
    """Poses on support planes in reach that look like one above them: farther along the sight."""
    expected, eye = around.expected, around.look.world_from_lens.translation
    away = world_from_lifted.translation - eye
    stood: list[Pose] = []
    for height in () if expected.stands(world_from_lifted) else expected.supports_m:
        if height < world_from_lifted.translation[2] < eye[2]:
            place = eye + away * (height - eye[2]) / away[2]
            if np.linalg.norm(place - world_from_lifted.translation) < expected.reach_m:
                stood.append(Pose(world_from_lifted.rotation, place))
    return stood


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
    return Surroundings(scene, model, expected, look, level)


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
    """Poses to begin with.

    At every place the yaws whose templates fit and the expected one; where it is expected, all.
    """
    look, model, expected = around.look, around.model, around.expected
    starts: list[Pose] = []
    places = _places(around)
    if len(places) > 0:
        cuts = cuts_at(look, model, places)
        starts += likeliest_at_each(model, places, cuts, compare(cuts, model.templates))
        yaw = expected.poses[0].yaw()
        starts += [Pose.from_yaw(yaw, place) for place in places]
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
    has_changed = share > MIN_CHANGED
    places, share = places[has_changed], share[has_changed]
    return places[_likeliest_first(expected, places, share=share)[:MAX_PLACES]]


def _likeliest_first(expected: Expected, places: Points, *, share: Points) -> NDArray[np.intp]:
    """(P,) indices of places: by turns the most changed one, and that of those on support planes.

    At every height who carries an object, and covers more of the picture than it, is as much
    changed: the most changed places may all be in his silhouette.
    """
    most = np.argsort(-share, kind="stable")
    standing = most[np.isin(places[most, 2], expected.supports_m)]
    in_turns = chain.from_iterable(zip(standing.tolist(), most.tolist(), strict=False))
    return np.array(list(dict.fromkeys(chain(in_turns, most.tolist()))), dtype=np.intp)


def _apart(model: TrackModel, poses: Sequence[Pose], *, count: int) -> list[Pose]:
    """The first so many poses, without those that say the same as one before them."""
    kept: list[Pose] = []
    for pose in poses:
        if len(kept) == count:
            break
        if all(is_other(model, pose, other) for other in kept):
            kept.append(pose)
    return kept
