"""Proposals in whole lens pictures, screened and aligned by a rough likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Scene
from tracking.evidence.observation import Observation
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.hypotheses.hypothesis import OTHER_PLACE
from tracking.hypotheses.lens_look import LensLook
from tracking.hypotheses.proposals import Similarity, cuts_at, proposed
from tracking.hypotheses.refinement import ALIGNED_PX, align
from tracking.likelihood.pixel_model import ROUGHLY
from tracking.likelihood.pose_likelihood import pose_supports
from tracking.model.object_model import TrackModel
from tracking.model.templates import Cuts, compare

Points = NDArray[np.float64]

CUT_AT_ONCE = 400
"""Places cut out of a lens in one step of a search."""

SCREENED_AT_ONCE = 6
"""Proposals screened in one step."""

ALIGNED = 24
"""Proposals that are aligned, the best by their rough likelihood, both ways."""

ALIGNED_AT_A_PLACE = 3
"""Of those at one place: a rough likelihood ranks places worse than poses at a place, as it grows
with the silhouette, right or wrong."""


@dataclass(frozen=True, slots=True, eq=False)
class Rough:
    """A rough pose.

    Attributes:
        nats: of its rough likelihood.
        world_from_object: the pose.
        lens: that shows it.
        rate: nats of an independent sample.
    """

    nats: float
    world_from_object: Pose
    lens: int
    rate: float


def propose(
    looks: Sequence[LensLook],
    places: Sequence[Points],
    lens: int,
    model: TrackModel,
    budget: FrameBudget,
) -> list[Pose]:
    """Poses proposed in one lens."""
    here = places[lens]
    if len(here) == 0:
        return []
    cuts = [
        budget.do(Step.CUT, cuts_at, looks[lens], model, here[first : first + CUT_AT_ONCE])
        for first in range(0, len(here), CUT_AT_ONCE)
    ]
    similar = [budget.do(Step.COMPARE, compare, some, model.templates) for some in cuts]
    return budget.do(Step.PROPOSE, _score_lens, looks[lens], model, here, cuts, similar)


def _score_lens(
    look: LensLook,
    model: TrackModel,
    places: Points,
    cuts: Sequence[Cuts],
    similar: Sequence[Similarity],
) -> list[Pose]:
    overlap, correlation = (np.concatenate(parts) for parts in zip(*similar, strict=True))
    return proposed(look, model, places, Cuts.joined(cuts), (overlap, correlation))


def screen(
    scene: Scene,
    model: TrackModel,
    looks: Sequence[LensLook],
    starts: Sequence[tuple[Pose, int]],
    budget: FrameBudget,
) -> list[Rough]:
    """The best of some proposals, screened and aligned, ranked both ways."""
    rough: list[Rough] = []
    for first in range(0, len(starts), SCREENED_AT_ONCE):
        some = starts[first : first + SCREENED_AT_ONCE]
        rough += budget.do(Step.SCREEN, _score_all, scene, model, looks, some)
    some_rough = of_all_places(model, ranked_both_ways(rough))
    rough = [budget.do(Step.ALIGN, align_roughly, scene, model, looks, item) for item in some_rough]
    return ranked_both_ways(rough)


def ranked_both_ways(rough: Sequence[Rough]) -> list[Rough]:
    """Rough poses, by turns the likeliest and that which shows most of all that it would show.

    Nats grow with the silhouette: a shade over half of the floor has more than a stool at the wall,
    of which every pixel is right.
    """
    by_nats = sorted(range(len(rough)), key=lambda index: -rough[index].nats)
    by_rate = sorted(range(len(rough)), key=lambda index: -rough[index].rate)
    turns = dict.fromkeys(chain.from_iterable(zip(by_nats, by_rate, strict=True)))
    return [rough[index] for index in turns]


def _score_all(
    scene: Scene, model: TrackModel, looks: Sequence[LensLook], starts: Sequence[tuple[Pose, int]]
) -> list[Rough]:
    """Rough likelihoods of some proposals, those of one level of a look all at once."""
    seen_in = [_level(looks[lens], model, pose) for pose, lens in starts]
    nats, rate = np.zeros(len(starts)), np.zeros(len(starts))
    for observation in {id(seen): seen for seen in seen_in}.values():
        here = [index for index, seen in enumerate(seen_in) if seen is observation]
        poses = [starts[index][0] for index in here]
        found = pose_supports(
            observation, model, poses=poses, renderer=scene.renderer, tolerance=ROUGHLY
        )
        nats[here] = [support.nats for support in found]
        rate[here] = [support.nats_a_sample for support in found]
    return [
        Rough(float(nats[index]), pose, lens, float(rate[index]))
        for index, (pose, lens) in enumerate(starts)
    ]


def score_roughly(
    scene: Scene, model: TrackModel, looks: Sequence[LensLook], world_from_object: Pose, lens: int
) -> Rough:
    """A pose with its rough likelihood in one of some looks."""
    return _score_all(scene, model, looks, [(world_from_object, lens)])[0]


def _level(look: LensLook, model: TrackModel, pose: Pose) -> Observation:
    range_m = float(np.linalg.norm(model.centre_at(pose) - look.world_from_lens.translation))
    radius_px = look.camera.f_px * model.radius_m / max(range_m, model.radius_m)
    return look.level_for(radius_px, ALIGNED_PX)


def align_roughly(
    scene: Scene, model: TrackModel, looks: Sequence[LensLook], rough: Rough
) -> Rough:
    """A rough pose after its alignment, if that made it likelier."""
    pose, lens = rough.world_from_object, rough.lens
    moved = align(_level(looks[lens], model, pose), model, pose, scene)
    return max(rough, score_roughly(scene, model, looks, moved, lens), key=lambda item: item.nats)


def of_all_places(model: TrackModel, rough: Sequence[Rough]) -> list[Rough]:
    """The first rough poses, no more of one place than another could need."""
    places = np.array([item.world_from_object.translation for item in rough]).reshape(-1, 3)
    beside = np.zeros(len(rough), dtype=np.int64)
    chosen: list[Rough] = []
    for index, item in enumerate(rough):
        if len(chosen) == ALIGNED:
            break
        if beside[index] < ALIGNED_AT_A_PLACE:
            chosen.append(item)
            apart_m = np.linalg.norm(places - places[index], axis=1)
            beside += apart_m < OTHER_PLACE * model.radius_m
    return chosen
