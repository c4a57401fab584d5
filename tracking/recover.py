"""Finds objects that are not where they were: after they were lost, or moved between sessions.

Of the places proposed (`tracking.places`) the best few are refined. Which object then gets which
place is decided for all that are looked for together (paper 4.4.2 "recovery between
sessions", done here without asking the user to select the objects again).
"""

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
    closely_explained,
    explained,
    resemblances,
    roughly_explained,
)
from tracking.metrics import ROUND
from tracking.model import TrackModel
from tracking.observe import CONTOUR_CORRELATION
from tracking.places import Overview, claimed, proposed, scored, template_scores
from tracking.sketch import Sketchbook, draw, sketched
from tracking.smooth import pose_vector
from tracking.solve import Fit, Prior, judge, solve
from tracking.templates import YAWS, cut_out

FloatArray = NDArray[np.float32]
Points = NDArray[np.float64]

REACH_M = 4.5
PLACES_NEARER = 16
PLACES_SMALL, YAWS_SMALL = 32, 12
YAWS_FIRST, PLACES_TURNED = 4, 14
"""Of small objects so many yaws are compared at every place, and the others at the best ones."""
REFINED = 10
PLACES_REFINED, REFINED_MORE = 12, 6
REFINED_TURNED = 4
"""How many places are looked at more closely; of small objects with how many yaws each; how many
poses of these are refined; of large objects a pose at how many places, and how many more at the
best of these; how many of an object whose place is known."""

STARTS_A_PLACE = 3
"""At most so many yaws of one place are refined: there may be better places."""

NEARER = np.arange(-2, 3) * 0.2
"""Steps around a place of those that are looked at more closely, in radii."""

APART = 0.3
APART_RAD = math.radians(20)
"""Poses farther apart than this, in radii of the object or in yaw, are different ones."""

START_REACHES = (10.0, 5.0, 2.5)
"""Search distances in pixels from a start: templates find a place to a tenth of an object."""

START_SIGMA = (0.25, 0.25, 0.003, 0.6)
"""How far off a pose may be before it is refined: metres and radians."""

GOOD_SUPPORT, GOOD_VISIBLE = 0.8, 0.9
"""Wrong yaws reach three quarters."""

REFINED_SMALL, YAWS_COMPARED, REFINED_AGAIN = 5, 6, 3
"""So many rough poses of a small object are told closely, and so many other yaws at the best; the
best of all these once more."""

SMALL_M = 0.25
SMALL_PX = 40.0
SMALL_SIGMA = (0.01, 0.01, 0.003, 0.05)
"""Objects of a smaller radius are placed by their colours; how well: metres and radians."""

ACCEPTED_SMALL = 0.1
RECOGNISED_SMALL = 0.12
SMALL_QUALITY_SIGMA = 0.03
CLEAR_SIGMAS = 1.5
"""A pose must be better than another by this many standard deviations of a quality."""

ACCEPTED_AGREEMENT = 0.35
ACCEPTED_QUALITY = 0.3
ACCEPTED_LIKENESS = 0.25
"""What a refined pose must reach to be a guess."""


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """Where an object may be.

    Attributes:
        fit: the pose and what its outline says.
        explained: of a small object, how much it resembles the picture there, at most 1.
    """

    fit: Fit
    explained: float | None

    @property
    def world_from_object(self) -> Pose:
        """Of the fit."""
        return self.fit.world_from_object

    @property
    def quality(self) -> float:
        """0..1: ranks guesses of one object."""
        if self.explained is None:
            return self.fit.quality
        return max(self.explained, 0.0)

    @property
    def quality_sigma(self) -> float:
        """Standard deviation of the quality.

        It is about a share of the contour, of which neighbouring points count as one.
        """
        if self.explained is not None:
            return SMALL_QUALITY_SIGMA
        count = max(len(self.fit.sketch.contour) / CONTOUR_CORRELATION, 1.0)
        share = min(max(self.quality, 0.1), 0.9)
        return math.sqrt(share * (1.0 - share) / count)

    def is_clearly_better(self, other: Guess) -> bool:
        """Whether this guess's quality is higher than can be by chance."""
        margin = CLEAR_SIGMAS * math.hypot(self.quality_sigma, other.quality_sigma)
        return self.quality > other.quality + margin


def candidates(
    scene: Scene,
    look: Overview,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    *,
    supports_m: Sequence[float],
    last: Points,
    enough: int,
    reach_m: float = REACH_M,
) -> list[Guess]:
    """Poses an object may have anywhere on the given heights, the best first.

    Args:
        scene: the frame.
        look: its overview.
        model: the object.
        neighbours: other objects, whose places are taken.
        supports_m: heights of the planes it may stand on.
        last: (3,) where it was seen last; tried as well.
        enough: the search ends with so many poses that leave no doubt.
        reach_m: how far from the camera to search.
    """
    pictures = [
        claimed(scene, look, index, model, neighbours) for index in range(len(look.cameras))
    ]
    places = np.concatenate(
        [
            _on_support(last, supports_m)[None],
            proposed(scene, look, model, pictures, supports_m=supports_m, reach_m=reach_m),
        ]
    )
    places = places[scene.stands.hold(places)]
    _, scores = scored(scene, look, model, pictures, places)
    if model.radius_m < SMALL_M:
        places = places[np.argsort(-scores.max(axis=1), kind="stable")[:PLACES_SMALL]]
        guesses = _small_guesses(scene, model, _small_starts(scene, model, neighbours, places))
    else:
        chosen = places[np.argsort(-scores.max(axis=1), kind="stable")[:PLACES_NEARER]]
        nearer = (chosen[:, None] + _around(model)).reshape(-1, 3)
        nearer = nearer[scene.stands.hold(nearer)]
        yaws, scores = scored(scene, look, model, pictures, nearer)
        starts = _starts_by_place(model, nearer, yaws, scores, limit=PLACES_REFINED)
        guesses = _large_guesses(scene, model, neighbours, starts, enough=enough)
    accepted = [g for g in guesses if _is_acceptable(g) and _can_be(scene, g.world_from_object)]
    return _distinct(model, accepted)


def _large_guesses(
    scene: Scene,
    model: TrackModel,
    neighbours: Sequence[Neighbour],
    starts: Sequence[Sequence[Pose]],
    *,
    enough: int,
) -> list[Guess]:
    """What rough poses of a large object come to: of every place one, then more where it may be.

    Args:
        scene: the frame.
        model: the object.
        neighbours: other objects, whose places are taken.
        starts: by place, the likeliest yaw first.
        enough: it ends with so many poses that leave no doubt.
    """
    tried: list[tuple[Guess, Evidence, Sequence[Pose]]] = []
    guesses: list[Guess] = []

    def is_enough() -> bool:
        return len(_distinct(model, [g for g in guesses if leaves_no_doubt(g.fit)])) >= enough

    for first, *others in starts:
        view = view_of(scene, model, first, at_any_yaw=True)
        evidence = gather(scene, model, view, neighbours)
        guesses.append(refined(scene, model, first, evidence))
        tried.append((guesses[-1], evidence, others))
        if is_enough():
            return guesses
    tried.sort(key=lambda item: -item[0].quality)
    turned_starts = [
        (pose, evidence)
        for guess, evidence, others in tried
        if not leaves_no_doubt(guess.fit)
        for pose in others
    ]
    for pose, evidence in turned_starts[:REFINED_MORE]:
        guesses.append(refined(scene, model, pose, evidence))
        if is_enough():
            break
    return guesses


def _small_starts(
    scene: Scene, model: TrackModel, neighbours: Sequence[Neighbour], places: Points
) -> list[tuple[Pose, Evidence]]:
    """Poses near some places that look most like the picture, with their windows, the best first.

    A place is right to a part of the object, too roughly to compare pictures: what has changed
    there is covered first.
    """
    tried: list[tuple[Points, list[Pose], Evidence]] = []
    for roughly in places:
        place = roughly
        pose = Pose.from_yaw(0.0, place)
        view = view_of(scene, model, pose, at_any_yaw=True)
        evidence = gather(scene, model, view, neighbours)
        drawn = draw(model, pose, evidence, scene.renderer)
        shift = silhouette_shift(evidence, drawn.alpha)
        if shift is not None:
            place = shifted(pose, shift, evidence, model, grounded=True).translation
        poses = [Pose.from_yaw(2 * math.pi * k / YAWS_SMALL, place) for k in range(YAWS_SMALL)]
        first = resemblances(scene, model, evidence, poses[:: YAWS_SMALL // YAWS_FIRST])
        tried.append((first, poses, evidence))
    tried.sort(key=lambda item: -item[0].max())
    found: list[tuple[float, Pose, Evidence]] = []
    for _, poses, evidence in tried[:PLACES_TURNED]:
        alike = resemblances(scene, model, evidence, poses)
        peaks = np.flatnonzero((alike >= np.roll(alike, 1)) & (alike > np.roll(alike, -1)))
        best = peaks[np.argsort(-alike[peaks], kind="stable")][:STARTS_A_PLACE]
        found += [(float(alike[k]), poses[k], evidence) for k in best]
    found.sort(key=lambda item: -item[0])
    distinct: list[tuple[Pose, Evidence]] = []
    for _, pose, evidence in found:
        if len(distinct) < REFINED and all(is_other(model, pose, p) for p, _ in distinct):
            distinct.append((pose, evidence))
    return distinct


def _small_guesses(
    scene: Scene, model: TrackModel, starts: Sequence[tuple[Pose, Evidence]]
) -> list[Guess]:
    """What rough poses of a small object come to, the likeliest ones told closely."""
    rough = [
        (*roughly_explained(scene, model, evidence, start), evidence) for start, evidence in starts
    ]
    rough.sort(key=lambda item: -item[1])
    fine = [
        (*closely_explained(scene, model, evidence, pose), evidence)
        for pose, _, evidence in rough[:REFINED_SMALL]
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
        for pose, _, evidence in fine[:REFINED_AGAIN]
    ]
    return [
        _placed(scene, model, evidence, pose, share)
        for pose, share, evidence in finest + fine[REFINED_AGAIN:] + rough[REFINED_SMALL:]
        if share >= ACCEPTED_SMALL
    ]


def _other_yaws(
    scene: Scene,
    model: TrackModel,
    evidence: Evidence,
    world_from_object: Pose,
    tried: Sequence[Pose],
) -> list[Pose]:
    """A small object's likeliest other yaws at a place, without those that were tried there."""
    place, yaw = world_from_object.translation, world_from_object.yaw()
    poses = [Pose.from_yaw(yaw + 2 * math.pi * k / YAWS_SMALL, place) for k in range(YAWS_SMALL)]
    alike = resemblances(scene, model, evidence, poses)
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


def turned(model: TrackModel, evidence: Evidence, world_from_belief: Pose) -> list[Pose]:
    """Poses to refine of an object about where it is believed to be, at whatever yaw.

    That of a small object is among them, as only its colours tell how good it is.
    """
    free = np.maximum(evidence.foreground, evidence.hidden)
    own = evidence.own * (1.0 - evidence.hidden)
    picture = np.dstack([evidence.live, own, free]).astype(np.float32)
    places = world_from_belief.translation + _around(model)
    centres = places + model.centre_m
    camera, pose = evidence.camera, evidence.world_from_camera
    cuts = cut_out(picture, camera, pose, centres, model.radius_m)
    yaws = np.arange(YAWS) * (2 * math.pi / YAWS) + cuts.azimuth_rad[:, None]
    starts = _distinct_starts(
        model, places, yaws, template_scores(cuts, model), limit=REFINED_TURNED
    )
    return [world_from_belief, *starts] if _is_small(model, evidence) else starts


def ranked(scene: Scene, model: TrackModel, guesses: Sequence[Guess]) -> list[Guess]:
    """The guesses inside the room, each pose once, the best first."""
    return _distinct(model, [g for g in guesses if scene.holds(g.world_from_object)])


def refined(
    scene: Scene,
    model: TrackModel,
    start_world_from_object: Pose,
    evidence: Evidence,
    *,
    quickly: bool = False,
) -> Guess:
    """What a rough pose of an object comes to; of a small one, as its colours have it.

    Args:
        scene: the frame.
        model: the object.
        start_world_from_object: where to begin.
        evidence: its window.
        quickly: draw it no finer than what it is compared with, an object that moves.
    """
    if _is_small(model, evidence):
        found, share = explained(scene, model, evidence, start_world_from_object)
        return _placed(scene, model, evidence, found, share)
    prior = Prior(pose_vector(start_world_from_object), np.array(START_SIGMA))
    fit = solve(
        evidence,
        model,
        start_world_from_object,
        prior,
        scene.renderer,
        reaches_px=START_REACHES,
        book=Sketchbook(quickly=quickly),
    )
    return Guess(fit, None)


def _around(model: TrackModel) -> Points:
    """(N, 3) steps to the places around a place that are looked at more closely."""
    x, y = np.meshgrid(NEARER, NEARER)
    steps = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return np.asarray(model.radius_m * steps, dtype=np.float64)


def _distinct(model: TrackModel, guesses: Sequence[Guess]) -> list[Guess]:
    """The best of those that say the same, the best first."""
    distinct: list[Guess] = []
    for guess in sorted(guesses, key=lambda guess: -guess.quality):
        pose = guess.world_from_object
        if all(is_other(model, pose, other.world_from_object) for other in distinct):
            distinct.append(guess)
    return distinct


def leaves_no_doubt(fit: Fit) -> bool:
    """Whether a pose's outline and surface are better than those of any wrong one."""
    return not fit.textured and fit.support >= GOOD_SUPPORT and fit.visible_fraction >= GOOD_VISIBLE


def is_recognised(scene: Scene, model: TrackModel, evidence: Evidence, fit: Fit) -> bool | None:
    """Whether what is at a pose looks like the object, None for what its outline tells.

    Outlines of small things are all alike; their inner colours say little when seen from afar. What
    looks more like the object from another side has been turned.
    """
    if not _is_small(model, evidence):
        return None
    found = refined(scene, model, fit.world_from_object, evidence)
    if found.quality < RECOGNISED_SMALL:
        return False
    here = found.world_from_object
    others = _other_yaws(scene, model, evidence, here, [here])
    alike = (closely_explained(scene, model, evidence, pose)[1] for pose in others)
    return all(share <= found.quality for share in alike)


def settled(
    scene: Scene, model: TrackModel, evidence: Evidence, world_from_object: Pose
) -> Fit | None:
    """Where a small textured object came to rest, by its colours; None for any other object."""
    if not (model.textured and _is_small(model, evidence)):
        return None
    return refined(scene, model, world_from_object, evidence).fit


def _can_be(scene: Scene, world_from_object: Pose) -> bool:
    """Whether something at a pose is inside the room, and stands on something."""
    stands = bool(scene.stands.hold(world_from_object.translation[None])[0])
    return stands and scene.holds(world_from_object)


def _is_acceptable(guess: Guess) -> bool:
    """Whether a refined pose is worth being told."""
    fit = guess.fit
    if guess.explained is not None:
        return guess.quality >= ACCEPTED_SMALL
    alike = not fit.textured or fit.likeness >= ACCEPTED_LIKENESS
    return alike and fit.agreement >= ACCEPTED_AGREEMENT and fit.quality >= ACCEPTED_QUALITY


def is_other(model: TrackModel, world_from_a: Pose, world_from_b: Pose) -> bool:
    """Whether two poses of an object differ by more than a refinement would even out."""
    if _apart(world_from_a, world_from_b) > APART * model.radius_m:
        return True
    apart_rad = np.array([world_from_a.yaw() - world_from_b.yaw()])
    return bool(_are_other_turns(model, apart_rad, least=APART_RAD)[0])


def _are_other_turns(model: TrackModel, apart_rad: Points, *, least: float) -> NDArray[np.bool_]:
    """(N,) whether an object looks different when turned by at least so much."""
    if model.symmetry == ROUND:
        return np.zeros(len(apart_rad), np.bool_)
    turns = (apart_rad * model.symmetry + math.pi) % (2 * math.pi) - math.pi
    turns = np.abs(turns) / model.symmetry
    return (turns > least) & np.logical_not(model.templates.are_alike(turns))


def _on_support(last: Points, supports_m: Sequence[float]) -> Points:
    """A place on the nearest support."""
    return np.array([last[0], last[1], min(supports_m, key=lambda z: abs(z - last[2]))])


def _distinct_starts(
    model: TrackModel, places: Points, yaws: Points, scores: Points | FloatArray, *, limit: int
) -> list[Pose]:
    """The best-scored poses that differ from each other."""
    order = np.argsort(-scores, axis=None, kind="stable")
    order = order[scores.ravel()[order] > 0.0]
    rows, turns = order // scores.shape[1], yaws.ravel()[order]
    here = places[rows]
    left = np.ones(len(order), np.bool_)
    beside = np.zeros(len(order), np.int64)
    starts: list[Pose] = []
    while len(starts) < limit and left.any():
        index = int(np.argmax(left))
        starts.append(Pose.from_yaw(float(turns[index]), here[index]))
        near = ((here - here[index]) ** 2).sum(axis=1) < model.radius_m**2
        beside += near
        same = near & ~_are_other_turns(model, turns - turns[index], least=1.5 * APART_RAD)
        left &= ~same & (beside < STARTS_A_PLACE)
        left[index] = False
    return starts


def _starts_by_place(
    model: TrackModel, places: Points, yaws: Points, scores: Points | FloatArray, *, limit: int
) -> list[list[Pose]]:
    """The best-scored poses of the best places, which are a radius apart, the best first."""
    starts = _distinct_starts(model, places, yaws, scores, limit=limit * STARTS_A_PLACE)
    by_place: list[list[Pose]] = []
    for start in starts:
        here = [group for group in by_place if _apart(group[0], start) < model.radius_m]
        if here:
            here[0].append(start)
        else:
            by_place.append([start])
    return by_place[:limit]


def _apart(first: Pose, second: Pose) -> float:
    return float(np.linalg.norm(first.translation - second.translation))


def _is_small(model: TrackModel, evidence: Evidence) -> bool:
    radius_px = evidence.camera.f_px * model.radius_m / evidence.view.target_range_m
    return radius_px < SMALL_PX
