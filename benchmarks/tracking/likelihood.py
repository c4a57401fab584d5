"""The likelihood on labelled pictures: does the true pose win, and does a covered one keep silent?

Each visible object is weighed at its true pose and at wrong ones: beside it, nearer, farther,
higher, turned. The posterior over these and the object's absence is a probability, so its log loss
is a proper score. A pose behind a person, where the object is not, should say nothing at all.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.evaluate.answers import MIN_VISIBLE, MIN_WIDTH_PX
from benchmarks.tracking.windows import LabelledPicture, LabelledRoom
from scenes.pose import Pose
from studio.console.rows import Row, at_least, at_most
from tracking.evidence.evidence import gather, view_of
from tracking.evidence.observation import Observation, observe
from tracking.likelihood.pose_likelihood import pose_support
from tracking.model.object_model import TrackModel

SHIFTS = (-0.7, -0.35, 0.35, 0.7)
"""Wrong places, in radii of the object: beside it, and where half of it still overlaps."""

TURNS_DEG = tuple(range(30, 360, 30))
"""Wrong yaws."""

SAME_CM, SAME_DEG = 2.0, 5.0
"""Errors up to which a pose is no wrong one: an object's symmetry turns it onto itself."""

MAX_LOSS = 20.0
"""Log loss of one object at most, so that one of them does not decide: odds of 5e8 to one."""

EVERY = 3
"""Of a sequence's pictures, so many apart are looked at: neighbours are nearly the same."""

POSES_A_PERSON = 3
"""Poses behind each person and of each object."""

BEHIND_M = (0.1, 0.8)
"""How far behind the middle of a person those are."""

APART_M = 1.0
"""Least distance of such a pose from where the object truly is."""

COVERED_BAR, VISIBLE_BAR = 3.0, 10.0
"""Nats that a covered pose may have at most, and that a visible object has to have."""


@dataclass(frozen=True, slots=True)
class Weighed:
    """A visible object.

    Attributes:
        true_nats: at its true pose.
        wrong_nats: at the likeliest wrong one.
        loss: negative log posterior of the true pose.
    """

    true_nats: float
    wrong_nats: float
    loss: float


@dataclass(frozen=True, slots=True)
class LikelihoodResult:
    """Of some rooms: visible objects, and nats of poses behind people."""

    visible: tuple[Weighed, ...]
    covered_nats: tuple[float, ...]


def measure_likelihood(room: LabelledRoom) -> LikelihoodResult:
    """Weigh all objects of a room's stills and sequence."""
    rng = np.random.default_rng([room.room.seed, 38])
    visible: list[Weighed] = []
    covered: list[float] = []
    for picture in room.stills():
        visible += _visible(room, picture)
    for picture in room.sequence():
        if picture.seq % EVERY:
            continue
        visible += _visible(room, picture)
        covered += _behind_people(picture, rng)
    return LikelihoodResult(tuple(visible), tuple(covered))


def likelihood_rows(results: Iterable[LikelihoodResult]) -> list[Row]:
    """Figures over all rooms."""
    results = list(results)
    visible = [item for result in results for item in result.visible]
    covered = [nats for result in results for nats in result.covered_nats] or [0.0]
    nats = np.array([item.true_nats for item in visible] or [0.0])
    losses = [min(item.loss, MAX_LOSS) for item in visible] or [0.0]
    won = [item.true_nats >= item.wrong_nats for item in visible] or [False]
    silent = float(np.mean(np.array(covered) <= COVERED_BAR))
    return [
        Row("likelihood.log_loss", float(np.mean(losses)), "nats"),
        Row("likelihood.true_first_percent", 100.0 * float(np.mean(won)), "%"),
        at_least(
            "likelihood.visible_nats.p5", float(np.percentile(nats, 5)), "nats", bar=VISIBLE_BAR
        ),
        Row("likelihood.visible", float(len(visible)), ""),
        at_most(
            "likelihood.covered_nats.p999",
            float(np.percentile(covered, 99.9)),
            "nats",
            bar=COVERED_BAR,
        ),
        Row("likelihood.covered_silent_percent", 100.0 * silent, "%"),
        Row("likelihood.covered", float(len(covered)), ""),
    ]


def _visible(room: LabelledRoom, picture: LabelledPicture) -> Iterator[Weighed]:
    for model in picture.models:
        seen = picture.visible[model.object_id]
        if seen.fraction >= MIN_VISIBLE and seen.width_px >= MIN_WIDTH_PX:
            yield _weighed(room, picture, model=model)


def _weighed(room: LabelledRoom, picture: LabelledPicture, *, model: TrackModel) -> Weighed:
    name = model.object_id
    true = picture.poses[name]
    observation = _observed(picture, model, around=true)

    def nats(world_from_object: Pose) -> float:
        return pose_support(observation, model, world_from_object, picture.scene.renderer).nats

    wrong: list[float] = []
    for pose in wrong_poses(model, true, world_from_rig=picture.scene.world_from_rig):
        error = room.error_of(name, world_from_found=pose, world_from_true=true)
        if error.world_cm > SAME_CM or error.yaw_deg > SAME_DEG:
            wrong.append(nats(pose))
    at_true = nats(true)
    loss = float(np.logaddexp.reduce([at_true, 0.0, *wrong])) - at_true
    return Weighed(at_true, max(wrong), loss)


def wrong_poses(model: TrackModel, world_from_object: Pose, *, world_from_rig: Pose) -> list[Pose]:
    """Poses beside, before, behind and above a true one, and turned ones."""
    away = model.centre_at(world_from_object) - world_from_rig.translation
    sight = away / float(np.linalg.norm(away))
    ahead = np.array([*away[:2], 0.0]) / max(float(np.hypot(*away[:2])), 1e-9)
    across, up = np.array([-ahead[1], ahead[0], 0.0]), np.array([0.0, 0.0, 1.0])
    shifts = [shift * axis for axis in (ahead, across, sight) for shift in SHIFTS]
    shifts += [shift * up for shift in SHIFTS if shift > 0.0]
    rotation, place = world_from_object.rotation, world_from_object.translation
    moved = [Pose(rotation, place + model.radius_m * shift) for shift in shifts]
    yaw = world_from_object.yaw()
    turned = [Pose.from_yaw(yaw + math.radians(deg), place) for deg in TURNS_DEG]
    return moved + turned


def _behind_people(picture: LabelledPicture, rng: np.random.Generator) -> Iterator[float]:
    for model in picture.models:
        if model.object_id in picture.moving:
            continue
        for pose in poses_behind(picture, model, rng=rng):
            apart = pose.translation - picture.poses[model.object_id].translation
            if float(np.linalg.norm(apart)) < APART_M:
                continue
            observation = _observed(picture, model, around=pose)
            yield pose_support(observation, model, pose, picture.scene.renderer).nats


def poses_behind(
    picture: LabelledPicture, model: TrackModel, *, rng: np.random.Generator
) -> Sequence[Pose]:
    """Poses of an object on its support behind every person, as the camera sees them."""
    eye = picture.scene.world_from_rig.translation
    poses: list[Pose] = []
    for person in picture.people:
        away = (person - eye) / float(np.linalg.norm(person - eye))
        for _ in range(POSES_A_PERSON):
            x, y, _ = person + rng.uniform(*BEHIND_M) * away + rng.normal(0.0, 0.15, 3)
            yaw = float(rng.uniform(-math.pi, math.pi))
            poses.append(Pose.from_yaw(yaw, (x, y, model.source.support_z_m)))
    return poses


def _observed(picture: LabelledPicture, model: TrackModel, *, around: Pose) -> Observation:
    scene = picture.scene
    view = view_of(scene, model, around, at_any_yaw=True)
    return observe(scene, gather(scene, model, view, picture.neighbours(model.object_id)))
