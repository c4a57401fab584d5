"""Small objects, told by their colours: where one may be, and whether it is what is there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.align import shifted, silhouette_shift
from tracking.evidence import Evidence, Neighbour, Scene, gather, view_of
from tracking.explain import (
    Place,
    closely_explained,
    explained,
    resemblances,
    roughly_explained,
    surroundings_of,
)
from tracking.guess import START_SIGMA, STARTS_A_PLACE, Guess, is_other
from tracking.model import TrackModel
from tracking.sketch import draw, sketched
from tracking.smooth import pose_vector
from tracking.solve import Fit, Prior, judge

Points = NDArray[np.float64]

SMALL_M = 0.25
SMALL_PX = 40.0
SMALL_SIGMA = (0.01, 0.01, 0.003, 0.05)
"""Objects of a smaller radius are placed by their colours; how well: metres and radians."""

YAWS, YAWS_FIRST, PLACES_TURNED = 12, 4, 14
"""Of so many yaws so many are compared at every place, and the others at the best ones."""

REFINED = 10
"""So many of these poses are refined roughly."""

TOLD_CLOSELY, YAWS_COMPARED, TOLD_AGAIN = 5, 6, 3
"""So many rough poses are told closely, and so many other yaws at the best; the best of all these
once more."""

ACCEPTED = 0.1
RECOGNISED = 0.12
"""How much an object must resemble the picture at a pose to be a guess, and to be there."""


def guesses(
    scene: Scene, model: TrackModel, neighbours: Sequence[Neighbour], places: Points
) -> list[Guess]:
    """What rough poses of a small object at some places come to, the likeliest ones told closely.

    Args:
        scene: the frame.
        model: the object.
        neighbours: other objects, whose places are taken.
        places: (P, 3) where it may stand.
    """
    rough = [
        (*roughly_explained(scene, model, evidence, start), evidence)
        for start, evidence in _starts(scene, model, neighbours, places)
    ]
    rough.sort(key=lambda item: -item[1])
    fine = [
        (*closely_explained(scene, model, evidence, pose), evidence)
        for pose, _, evidence in rough[:TOLD_CLOSELY]
    ]
    if fine:
        best, _, evidence = max(fine, key=lambda item: item[1])
        # What looks nearly alike from another side has to be told from it at the same place.
        fine += [
            (*closely_explained(scene, model, evidence, pose), evidence)
            for pose in _other_yaws(scene, model, evidence, best, [pose for pose, _, _ in fine])
        ]
    fine.sort(key=lambda item: -item[1])
    # Steps that have become small too early are taken anew.
    finest = [
        (*closely_explained(scene, model, evidence, pose), evidence)
        for pose, _, evidence in fine[:TOLD_AGAIN]
    ]
    return [
        _placed(scene, model, evidence, pose, share)
        for pose, share, evidence in finest + fine[TOLD_AGAIN:] + rough[TOLD_CLOSELY:]
        if share >= ACCEPTED
    ]


def refined(scene: Scene, model: TrackModel, evidence: Evidence, world_from_start: Pose) -> Guess:
    """What a rough pose of a small object comes to, as its colours have it."""
    found, share = explained(scene, model, evidence, world_from_start)
    return _placed(scene, model, evidence, found, share)


@dataclass(frozen=True, slots=True, eq=False)
class _Tried:
    """A place at which a small object's yaws are compared.

    Attributes:
        poses: all of them.
        alike: (Y,) how much each looks like the picture, where it was compared.
        surroundings: what the picture shows there, None if nothing of it is in the window.
        evidence: the object's window.
    """

    poses: list[Pose]
    alike: Points
    surroundings: Place | None
    evidence: Evidence


def _starts(
    scene: Scene, model: TrackModel, neighbours: Sequence[Neighbour], places: Points
) -> list[tuple[Pose, Evidence]]:
    """Poses near some places that look most like the picture, with their windows, best first."""
    every = YAWS // YAWS_FIRST
    tried = [_tried(scene, model, neighbours, place, every=every) for place in places]
    tried.sort(key=lambda at: -at.alike[::every].max())
    found: list[tuple[float, Pose, Evidence]] = []
    for at in tried[:PLACES_TURNED]:
        alike = at.alike.copy()
        left = [k for k in range(YAWS) if k % every]
        poses = [at.poses[k] for k in left]
        alike[left] = resemblances(at.surroundings, poses)
        peaks = np.flatnonzero((alike >= np.roll(alike, 1)) & (alike > np.roll(alike, -1)))
        best = peaks[np.argsort(-alike[peaks], kind="stable")][:STARTS_A_PLACE]
        found += [(float(alike[k]), at.poses[k], at.evidence) for k in best]
    found.sort(key=lambda item: -item[0])
    distinct: list[tuple[Pose, Evidence]] = []
    for _, pose, evidence in found:
        if len(distinct) < REFINED and all(is_other(model, pose, p) for p, _ in distinct):
            distinct.append((pose, evidence))
    return distinct


def _tried(
    scene: Scene,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    roughly: Points,
    *,
    every: int,
) -> _Tried:
    """A place with one of so many yaws compared.

    It is right to a part of the object, too roughly to compare pictures: what has changed there is
    covered first.
    """
    place = roughly
    pose = Pose.from_yaw(0.0, place)
    view = view_of(scene, model, pose, at_any_yaw=True)
    evidence = gather(scene, model, view, neighbours)
    drawn = draw(model, pose, evidence, scene.renderer)
    shift = silhouette_shift(evidence, drawn.alpha)
    if shift is not None:
        place = shifted(pose, shift, evidence, model, grounded=True).translation
    poses = [Pose.from_yaw(2 * math.pi * k / YAWS, place) for k in range(YAWS)]
    surroundings = surroundings_of(scene, model, evidence, poses[0])
    alike = np.zeros(YAWS)
    alike[::every] = resemblances(surroundings, poses[::every])
    return _Tried(poses, alike, surroundings, evidence)


def _other_yaws(
    scene: Scene,
    model: TrackModel,
    evidence: Evidence,
    world_from_object: Pose,
    tried: Sequence[Pose],
) -> list[Pose]:
    """A small object's likeliest other yaws at a place, without those that were tried there."""
    place, yaw = world_from_object.translation, world_from_object.yaw()
    poses = [Pose.from_yaw(yaw + 2 * math.pi * k / YAWS, place) for k in range(YAWS)]
    surroundings = surroundings_of(scene, model, evidence, poses[0])
    alike = resemblances(surroundings, poses)
    others = [
        poses[k]
        for k in np.argsort(-alike, kind="stable")
        if all(is_other(model, poses[k], pose) for pose in tried)
    ]
    return others[:YAWS_COMPARED]


def _placed(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_object: Pose, share: float
) -> Guess:
    """A small object at a pose, and how much it explains there."""
    sketch = sketched(model, world_from_object, evidence, scene.renderer)
    prior = Prior(pose_vector(world_from_object), np.array(START_SIGMA))
    information = np.diag(1.0 / Prior(prior.mean, np.array(SMALL_SIGMA)).seven() ** 2)
    return Guess(judge(evidence, model, world_from_object, information, prior, sketch), share)


def is_recognised(scene: Scene, model: TrackModel, evidence: Evidence, fit: Fit) -> bool | None:
    """Whether what is at a pose looks like the object, None for what its outline tells.

    Outlines of small things are all alike; their inner colours say little when seen from afar. What
    looks more like the object from another side has been turned.
    """
    if not is_small(model, evidence):
        return None
    found = refined(scene, model, evidence, fit.world_from_object)
    if found.quality < RECOGNISED:
        return False
    here = found.world_from_object
    others = _other_yaws(scene, model, evidence, here, [here])
    alike = (closely_explained(scene, model, evidence, pose)[1] for pose in others)
    return all(share <= found.quality for share in alike)


def settled(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_object: Pose
) -> Fit | None:
    """Where a small textured object came to rest, by its colours; None for any other object."""
    if not (model.textured and is_small(model, evidence)):
        return None
    return refined(scene, model, evidence, world_from_object).fit


def is_small(model: TrackModel, evidence: Evidence) -> bool:
    """Whether an object is seen so small that its colours tell more than its outline."""
    radius_px = evidence.camera.f_px * model.radius_m / evidence.view.target_range_m
    return radius_px < SMALL_PX
