"""Where else an object may be that was not found where it was expected: beside, turned, lifted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenes.pose import Pose
from tracking.evidence.evidence import Evidence
from tracking.evidence.rendering import Sketchbook
from tracking.follow.attempt import attempt
from tracking.follow.carried import is_lifted
from tracking.follow.posterior import (
    CONTACT_SIGMA_M,
    CONVINCING,
    RECOGNISED_LIKENESS,
    is_believable,
    is_convincing,
    priors,
    worth,
)
from tracking.follow.track import Task
from tracking.model.symmetry import ROUND
from tracking.solve.gauss_newton import (
    COLD_REACHES,
    GROWN_REACHES,
    SLID_REACHES,
    TRACKING_REACHES,
    Fit,
    Prior,
)
from tracking.solve.motion import pose_vector, vector_pose

LEAST_GUESSES = 2
GUESS_NS = 15_000_000
"""So many guesses are followed in a frame, and more where frames are farther apart, one for each
stretch of this time; the next frame goes on with the others."""

NEAR_TURN_RAD, FAR_TURN_RAD = 0.17, 0.35
"""How far a thing is turned before it is looked for again, where it agrees somewhat, and hardly."""

LIFTS_M = (0.04, 0.08, 0.12)
"""How much higher a thing is looked for that was not found where it was: hands lift it."""

JUMP_M = 0.08
FASTEST_M_S = 2.0
"""An object may be this far from its prediction, and so much farther per second unseen."""

BETTER, BETTER_THAN_DOUBTFUL = 0.06, 0.02
"""How much more a guess has to be worth than what was found where the object was expected."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A solution, and the belief behind it."""

    fit: Fit
    belief: Prior


def looked_around(
    task: Task,
    evidence: Evidence,
    book: Sketchbook,
    predicted_world_from_object: Pose,
    found: Found,
) -> Fit:
    """What was found, or something clearly better farther off.

    Args:
        task: the object and the frame.
        evidence: its window.
        book: the sketches made of it so far.
        predicted_world_from_object: where it is expected.
        found: there.
    """
    beliefs = priors(task, predicted_world_from_object)
    best, best_belief = found.fit, found.belief
    for guess in _guesses(task, beliefs, predicted_world_from_object, best):
        other = _followed(task, evidence, book, guess)
        if guess.is_free and not is_lifted(task, other.world_from_object):
            continue
        if not _is_reachable(task, predicted_world_from_object, other):
            continue
        margin = BETTER if is_believable(best) else BETTER_THAN_DOUBTFUL
        if worth(other, guess.belief) > worth(best, best_belief) + margin:
            best, best_belief = other, guess.belief
        if is_convincing(task, best):
            break
    return best


@dataclass(frozen=True, slots=True, eq=False)
class _Guess:
    """Where an object may be that is not where it was expected.

    Attributes:
        belief: behind it.
        start_world_from_object: where to begin.
        slides: whether the drawn object is slid over the picture first.
    """

    belief: Prior
    start_world_from_object: Pose
    slides: bool

    @property
    def is_free(self) -> bool:
        """Whether the object is taken to stand on nothing."""
        return bool(self.belief.sigma[2] > CONTACT_SIGMA_M)


def _guesses(
    task: Task, beliefs: Sequence[Prior], predicted_world_from_object: Pose, best: Fit
) -> list[_Guess]:
    """This frame's guesses: slid there, and some turned or higher in the air, in turn."""
    turn = NEAR_TURN_RAD if is_believable(best) else FAR_TURN_RAD
    yaws = (0.0,) if task.model.symmetry == ROUND else (0.0, turn, -turn)
    steps = [(belief, 0.0, yaw) for belief in beliefs for yaw in yaws]
    steps += [(b, z, 0.0) for b in beliefs if b.sigma[2] > CONTACT_SIGMA_M for z in LIFTS_M]
    elapsed_ns = task.scene.frame.t_ns - task.track.looked_ns
    count = min(max(LEAST_GUESSES, elapsed_ns // GUESS_NS), len(steps))
    # The likeliest is tried in every frame, the others in turn.
    others = steps[1:]
    first = task.scene.frame.seq * (count - 1) % len(others) if others else 0
    chosen = steps[:1] + (others[first:] + others[:first])[: count - 1]
    expected = pose_vector(predicted_world_from_object)
    return [
        _Guess(belief, vector_pose(expected + np.array([0.0, 0.0, z, yaw])), z == 0.0)
        for belief, z, yaw in chosen
    ]


def _followed(task: Task, evidence: Evidence, book: Sketchbook, guess: _Guess) -> Fit:
    """The solve from a guess."""
    wide = replace(guess.belief, sigma=guess.belief.sigma * np.array([2.0, 2.0, 1.0, 2.0]))
    slid = SLID_REACHES if task.model.textured else COLD_REACHES
    reaches = slid if guess.slides else TRACKING_REACHES
    start = guess.start_world_from_object
    fit = attempt(task, evidence, book, start, wide, reaches_px=reaches, slide=guess.slides)
    alike = fit.textured and fit.likeness >= RECOGNISED_LIKENESS
    if not (guess.slides and alike) or fit.support >= CONVINCING:
        return fit
    start = fit.world_from_object
    grown = attempt(task, evidence, book, start, wide, reaches_px=GROWN_REACHES)
    return max(fit, grown, key=lambda found: found.quality)


def _is_reachable(task: Task, predicted_world_from_object: Pose, fit: Fit) -> bool:
    """Whether people can have moved an object there since it was seen last."""
    apart = fit.world_from_object.translation - predicted_world_from_object.translation
    elapsed = (task.scene.frame.t_ns - task.track.seen_ns) * 1e-9
    return float(np.linalg.norm(apart)) < JUMP_M + FASTEST_M_S * elapsed
