"""Search for an object around where it was last, in one picture: what was carried off is near.

A search over the whole room takes many frames and works on the picture in which it began; somebody
who carries an object has gone on by then. Here the surroundings of the last place are compared with
the object's templates at once, on support planes and, for what can be carried, above them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence, Neighbour, Scene, gather
from tracking.evidence.observation import observe
from tracking.hypotheses.hypothesis import Hypothesis, distinct
from tracking.hypotheses.lens_look import LEVELS, LensLook
from tracking.hypotheses.prior import MOVED, UNSEEN
from tracking.hypotheses.proposals import (
    MIN_CHANGED,
    changed_share,
    cuts_at,
    proposed_by_overlap,
)
from tracking.hypotheses.refinement import refine
from tracking.hypotheses.screening import align_roughly, score_roughly
from tracking.hypotheses.search import (
    HOPELESS_NATS,
    Turned,
    align_in_window,
    best_places,
    judge_in_any_light,
    window_about,
)
from tracking.model.object_model import TrackModel
from tracking.model.templates import compare
from tracking.window.window import window_around

Points = NDArray[np.float64]

STEP = 0.5
"""Places are this far apart, in radii of the object: what an alignment bridges."""

SCREENED = 8
"""Places whose poses are screened by the rough likelihood: the true one was among the first six of
300 in all frames in which a book was carried away."""

ALIGNED = 3
"""Of those, aligned, the likeliest."""

COMPARED = 2
"""Of those, refined."""


@dataclass(frozen=True, slots=True)
class Nearby:
    """Places that an object may have gone to since it was seen.

    Attributes:
        world_from_last: its last pose.
        reach_m: how far.
        heights_m: heights that it may have.
    """

    world_from_last: Pose
    reach_m: float
    heights_m: tuple[float, ...]

    def log_prior(self, model: TrackModel) -> float:
        """Log odds of one pose there against being nowhere in view: shared by all places."""
        count = math.pi * self.reach_m**2 / (2.0 * model.radius_m) ** 2
        return math.log(MOVED / UNSEEN / max(count, 1.0))


def search_near(
    scene: Scene, model: TrackModel, neighbours: Sequence[Neighbour], nearby: Nearby
) -> list[Hypothesis]:
    """Poses an object may have around its last one, the likeliest first.

    Args:
        scene: the frame.
        model: the object.
        neighbours: the other tracked objects.
        nearby: where it may be.
    """
    view = window_around(
        scene.frame.rig,
        scene.world_from_rig,
        model.centre_at(nearby.world_from_last),
        radius_m=nearby.reach_m + model.radius_m,
    )
    look = _look(scene, gather(scene, model, view, neighbours))
    places = _places(look, model, nearby)
    if len(places) == 0:
        return []
    cuts = cuts_at(look, model, places)
    similarity = compare(cuts, model.templates)
    starts = proposed_by_overlap(model, places, cuts, similarity, count=SCREENED)
    rough = [score_roughly(scene, model, [look], pose, 0) for pose in starts]
    rough = sorted(rough, key=lambda item: -item[0])[:ALIGNED]
    rough = [align_roughly(scene, model, [look], item) for item in rough]
    rough.sort(key=lambda item: -item[0])
    aligned: list[Turned] = []
    for pose in best_places(model, rough)[:COMPARED]:
        window = window_about(scene, model, neighbours, pose)
        aligned.append(align_in_window(scene, model, window, pose))
    min_nats = max(nats for nats, _, _ in aligned) - HOPELESS_NATS
    found = [
        (refine(scene, model, pose, window.evidence, window.observation), window)
        for nats, pose, window in aligned
        if nats >= min_nats
    ]
    judged = judge_in_any_light(scene, model, found)
    log_prior = nearby.log_prior(model)
    return distinct(model, [replace(item, log_prior=log_prior) for item in judged])


def _look(scene: Scene, evidence: Evidence) -> LensLook:
    """A window as a look, at all levels."""
    level = observe(scene, evidence)
    picture = np.dstack([evidence.live, evidence.own, evidence.foreground])
    return LensLook(
        tuple(level.shrunk(2**k) for k in range(LEVELS)),
        level.world_from_camera,
        picture.astype(np.float32),
    )


def _places(look: LensLook, model: TrackModel, nearby: Nearby) -> Points:
    """(P, 3) places in reach that the look shows, and that do not show the empty room."""
    reach_m, last = nearby.reach_m, nearby.world_from_last.translation
    along = np.arange(-reach_m, reach_m, STEP * model.radius_m)
    x, y = (axis.ravel() for axis in np.meshgrid(along, along))
    flat = np.stack([x, y], axis=1)[x**2 + y**2 <= reach_m**2] + last[:2]
    places = np.concatenate(
        [np.column_stack([flat, np.full(len(flat), height)]) for height in nearby.heights_m]
    )
    centres = look.world_from_lens.inverse() @ (places + model.centre_m)
    distance = np.linalg.norm(centres, axis=1)
    angle = np.arctan2(np.hypot(centres[:, 0], centres[:, 1]), centres[:, 2])
    places = places[(angle < look.camera.max_angle) & (distance > model.radius_m)]
    if len(places) == 0:
        return places
    return places[changed_share(look, model, places) > MIN_CHANGED]
