"""What is believed of an object before a frame is measured, and which measurement to believe."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.pose import Pose, wrap_angle
from scenes.state import TrackState
from tracking.carried import is_lifted, is_likelier
from tracking.evidence import Evidence
from tracking.metrics import ROUND
from tracking.portrait import Portrait
from tracking.sketch import Sketchbook
from tracking.smooth import pose_vector, vector_pose
from tracking.solve import (
    COLD_REACHES,
    GROWN_REACHES,
    SLID_REACHES,
    TRACKING_REACHES,
    Fit,
    Prior,
    judge,
    solve,
)
from tracking.track import Task, Track

HOLD_BELOW = 0.42
"""The pose is held while its outline has less support than this."""

CONVINCING = 0.55
USUAL_SHARE = 0.85
"""Below this share, or this share of what usually agrees, other places and yaws are tried."""

MOSTLY_COVERED = 0.85
"""Where more than this is covered, no other place is tried: nothing would tell which is right."""

CONVINCING_LIKENESS = 0.38
LEAST_LIKENESS = 0.35
"""What the likeness of a textured object must reach to convince, and to be believed at all."""

RECOGNISED_LIKENESS = 0.5
RECOGNISED_VISIBLE = 0.6
RECOGNISED_AGREEMENT = 0.3
"""A pattern that is seen this well, and is this like the drawn one, needs less of an outline."""
SAME_SHARE = 0.95
PORTRAYED_SIGMA = (0.005, 0.005, 0.003, math.radians(1.5))
"""What is so nearly as like its portrait as when that was made has not moved by a pixel; how well
its pose is known then."""

DOUBTED_AGREEMENT, CERTAIN_AGREEMENT = 0.42, 0.88
DOUBTED_LIKENESS, CERTAIN_LIKENESS = 0.2, 0.6
"""Confidence grows from 0 to 1 between these."""

PRESENT_SHARE, ABSENT_SHARE = 0.3, 0.8
"""Confidence shrinks from 1 to 0 while so much of the silhouette shows the empty room."""

SURE = 0.5
"""A pose of less confidence may be a wrong one."""

LOST_CONFIDENCE = 0.4
"""Of a pose that is only a guess, at most."""

THERE_SUPPORT = 0.55
THERE_VISIBLE = 0.5
"""An object is where the scan says if its outline and its surface are this good, and what it shows
is believable."""

LEAST_GUESSES = 2
GUESS_NS = 15_000_000
"""So many guesses are followed in a frame, and more where frames are farther apart, one for each
stretch of this time; the next frame goes on with the others."""

FAR_PRICE = 0.012
"""Quality that a pose costs per squared standard deviation from its prediction."""

LEAST_VISIBLE = 0.15
"""Below this visible fraction nothing is measured."""

HEAVY_HEIGHT_M = 0.3
"""Objects at least this tall stay on the floor; smaller ones may be carried."""

CONTACT_SIGMA_M = 0.003
FAR_OFF_SUPPORT, FIRMER = 2.5, 4.0
"""How well a scan knows supports; what an outline lifts off one by more of these sigmas is held to
it so much more firmly."""

CARRIED_SIGMA_M = 0.08
NEAR_TURN_RAD, FAR_TURN_RAD = 0.17, 0.35
"""How far a thing is turned before it is looked for again, where it agrees somewhat, and hardly."""

LIFTS_M = (0.04, 0.08, 0.12)
"""How much higher a thing is looked for that was not found where it was: hands lift it."""

SNAP_M = 0.03
REACHABLE_M = 0.15
"""A small object nearer than the first to a support is first taken to stand on it, nearer than the
second perhaps."""

REST_RADIUS_M = 0.01
"""A resting object that is found farther from its place may be in somebody's hands."""

JUMP_M = 0.08
FASTEST_M_S = 2.0
"""An object may be this far from its prediction, and so much farther per second unseen."""

RESTING_SIGMA_M = 0.012
RESTING_SIGMA_RAD = math.radians(1.5)
MOVING_SIGMA_M = 0.10
MOVING_SIGMA_RAD = math.radians(14)
"""How far an object may be from its prediction, as standard deviations."""


def priors(task: Task, predicted_world_from_object: Pose) -> list[Prior]:
    """What may be known before looking, the likeliest first: standing on something, or carried.

    Args:
        task: the object.
        predicted_world_from_object: where it is expected.
    """
    track, source = task.track, task.model.source
    mean = pose_vector(predicted_world_from_object)
    if track.state is TrackState.STATIC and track.missed_frames == 0:
        sigma = np.array([RESTING_SIGMA_M, RESTING_SIGMA_M, 0.0, RESTING_SIGMA_RAD])
    else:
        spread = 1.0 + 0.5 * min(track.missed_frames, 8)
        sigma = np.array([MOVING_SIGMA_M, MOVING_SIGMA_M, 0.0, MOVING_SIGMA_RAD]) * spread
    known = (track.halo_m, track.halo_sigma_m)
    if source.box_m[2] >= HEAVY_HEIGHT_M:
        return [_standing(mean, source.support_z_m, sigma, known)]
    carried = sigma + np.array([0.0, 0.0, CARRIED_SIGMA_M, 0.0])
    free = Prior(mean, np.maximum(carried, [0.05, 0.05, 0.0, math.radians(8)]), *known)
    heights = np.array(task.supports_m)
    nearest = float(heights[np.argmin(np.abs(heights - mean[2]))])
    if abs(nearest - mean[2]) > REACHABLE_M:
        return [free]
    standing = _standing(mean, nearest, sigma, known)
    return [standing, free] if abs(nearest - mean[2]) < SNAP_M else [free, standing]


def _standing(
    mean: NDArray[np.float64],
    height_m: float,
    sigma: NDArray[np.float64],
    known: tuple[float, float],
) -> Prior:
    mean, sigma = mean.copy(), sigma.copy()
    mean[2], sigma[2] = height_m, CONTACT_SIGMA_M
    return Prior(mean, sigma, *known)


def measure(
    task: Task,
    evidence: Evidence,
    predicted_world_from_object: Pose,
    *,
    is_unchanged: bool = False,
) -> Fit:
    """Solve from the prediction, and from farther off if that does not convince.

    Args:
        task: the object and the frame.
        evidence: its window.
        predicted_world_from_object: where it is expected.
        is_unchanged: it rests and looks as it did: it can only have been measured badly.
    """
    beliefs, track = priors(task, predicted_world_from_object), task.track
    # What rests is judged by the scan alone: a portrait of it would find itself right.
    rested = track.state is TrackState.STATIC and track.missed_frames == 0
    portrait = None if rested else track.portrait
    book = Sketchbook(track.sketch, portrait, quickly=track.moves_on)
    if not rested and track.portrait is not None and track.portrait.is_of_rest:
        back = _as_portrayed(task, evidence, book, track.portrait, predicted_world_from_object)
        if back is not None:
            return back
    quick = TRACKING_REACHES if task.track.missed_frames == 0 else COLD_REACHES
    best = _try(task, evidence, book, predicted_world_from_object, beliefs[0], reaches_px=quick)
    best_belief = beliefs[0]
    if rested and not _is_convincing(task, best) and track.portrait is not None:
        book = Sketchbook(track.sketch, track.portrait)
        best = _try(task, evidence, book, predicted_world_from_object, beliefs[0], reaches_px=quick)
    if len(beliefs) > 1 and not task.is_first and _has_left(task, best):
        # What is carried looks like something that slides along its support, and the other way
        # round: both are tried, and the likelier one is taken.
        other = _try(
            task, evidence, book, predicted_world_from_object, beliefs[1], reaches_px=quick
        )
        if is_likelier(task, (other, beliefs[1]), (best, beliefs[0])):
            best, best_belief = other, beliefs[1]
    if _is_convincing(task, best) or best.covered_fraction > MOSTLY_COVERED:
        return best
    if is_unchanged and is_believable(best, wanted_likeness=least_likeness(track)):
        return best
    for guess in _guesses(task, beliefs, predicted_world_from_object, best):
        other = _followed(task, evidence, book, guess)
        if guess.is_free and not is_lifted(task, other.world_from_object):
            continue
        if not _is_reachable(task, predicted_world_from_object, other):
            continue
        margin = 0.06 if is_believable(best) else 0.02
        if _worth(other, guess.belief) > _worth(best, best_belief) + margin:
            best, best_belief = other, guess.belief
        if _is_convincing(task, best):
            break
    return best


def _as_portrayed(
    task: Task, evidence: Evidence, book: Sketchbook, portrait: Portrait, predicted: Pose
) -> Fit | None:
    """The pose at which an object rested last, if it looks there just as it did then.

    What somebody reached across has not moved, whatever its outline says.
    """
    apart = predicted.translation - portrait.world_from_object.translation
    if float(np.linalg.norm(apart)) > task.model.radius_m:
        return None
    fit = at_portrait(task, evidence, book, portrait)
    is_same = fit.likeness >= SAME_SHARE * portrait.likeness
    return fit if is_same and shows_pattern(fit) else None


def at_portrait(task: Task, evidence: Evidence, book: Sketchbook, portrait: Portrait) -> Fit:
    """What a picture says of the pose at which an object was portrayed."""
    world_from_object = portrait.world_from_object
    prior = Prior(pose_vector(world_from_object), np.array(PORTRAYED_SIGMA))
    sketch = book.at(task.model, world_from_object, evidence, task.scene.renderer)
    information = np.diag(prior.weights())
    return judge(evidence, task.model, world_from_object, information, prior, sketch)


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
    fit = _try(task, evidence, book, start, wide, reaches_px=reaches, slide=guess.slides)
    alike = fit.textured and fit.likeness >= RECOGNISED_LIKENESS
    if not (guess.slides and alike) or fit.support >= CONVINCING:
        return fit
    start = fit.world_from_object
    grown = _try(task, evidence, book, start, wide, reaches_px=GROWN_REACHES)
    return max(fit, grown, key=lambda found: found.quality)


def _has_left(task: Task, fit: Fit) -> bool:
    """Whether an object is not simply where it rested."""
    rested = task.track.state is TrackState.STATIC and task.track.missed_frames == 0
    return not rested or _has_left_its_rest(task, fit)


def _has_left_its_rest(task: Task, fit: Fit) -> bool:
    """Whether an object that rested was found elsewhere."""
    if task.track.state is not TrackState.STATIC:
        return False
    apart = fit.world_from_object.translation - task.track.world_from_object.translation
    return float(np.linalg.norm(apart)) > REST_RADIUS_M


def _is_reachable(task: Task, predicted_world_from_object: Pose, fit: Fit) -> bool:
    """Whether people can have moved an object there since it was seen last."""
    apart = fit.world_from_object.translation - predicted_world_from_object.translation
    elapsed = (task.scene.frame.t_ns - task.track.seen_ns) * 1e-9
    return float(np.linalg.norm(apart)) < JUMP_M + FASTEST_M_S * elapsed


def is_doubtful(task: Task, fit: Fit) -> bool:
    """Whether a believable fit is still too weak for where it is: in the air, or after a gap."""
    if not task.scene.holds(fit.world_from_object):
        return True
    unsure = task.track.missed_frames > 0
    weak = fit.support < CONVINCING and not shows_pattern(fit)
    if task.model.source.box_m[2] >= HEAVY_HEIGHT_M:
        return weak and unsure
    if weak and (unsure or _has_left_its_rest(task, fit)):
        return True
    lifted = is_lifted(task, fit.world_from_object)
    wanted = least_likeness(task.track) + 0.05 * lifted + 0.12 * unsure
    return task.model.textured and fit.likeness < wanted


def _worth(fit: Fit, belief: Prior) -> float:
    """Quality less the price of being far from what was expected."""
    apart = pose_vector(fit.world_from_object) - belief.mean
    apart[3] = wrap_angle(float(apart[3]))
    far = min(float(((apart / belief.sigma) ** 2).sum()), 9.0)
    return _presence(fit) * fit.quality - FAR_PRICE * far


def _try(
    task: Task,
    evidence: Evidence,
    book: Sketchbook,
    start: Pose,
    prior: Prior,
    *,
    reaches_px: tuple[float, ...],
    slide: bool = False,
) -> Fit:
    """One solve; the start is put on the height that the prior is sure of.

    What stands is within what is known of its support: an outline that lifts it farther errs, and
    has as little say in a second solve.
    """

    def solved(world_from_start: Pose, belief: Prior, reaches_px: tuple[float, ...]) -> Fit:
        return solve(
            evidence,
            task.model,
            world_from_start,
            belief,
            task.scene.renderer,
            reaches_px=reaches_px,
            use_texture=task.use_texture,
            slide_first=slide and belief is prior,
            book=book,
        )

    vector = pose_vector(start)
    if prior.sigma[2] > CONTACT_SIGMA_M:
        return solved(start, prior, reaches_px)
    eye = task.scene.world_from_rig.translation
    height = float(prior.mean[2])
    vector[:3] = _lowered(vector[:3], height, eye)
    fit = solved(vector_pose(vector), prior, reaches_px)
    vector = pose_vector(fit.world_from_object)
    if abs(vector[2] - height) < FAR_OFF_SUPPORT * prior.sigma[2]:
        return fit
    vector[:3] = _lowered(vector[:3], height, eye)
    firm = replace(prior, sigma=prior.sigma * np.array([1.0, 1.0, 1.0 / FIRMER, 1.0]))
    return solved(vector_pose(vector), firm, TRACKING_REACHES)


def _lowered(
    place: NDArray[np.float64], height_m: float, eye: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A place at another height that is seen in the same direction, unless that is far away."""
    sight = place - eye
    share = (height_m - place[2]) / sight[2] if abs(sight[2]) > 1e-6 else 0.0
    step = share * sight
    if float(np.linalg.norm(step)) > REACHABLE_M:
        step = np.array([0.0, 0.0, height_m - place[2]])
    return place + step


def _is_convincing(task: Task, fit: Fit) -> bool:
    wanted = max(CONVINCING_LIKENESS, USUAL_SHARE * task.track.usual_likeness)
    alike = not fit.textured or fit.likeness >= wanted
    usual = fit.free_agreement >= USUAL_SHARE * task.track.usual_agreement
    return fit.support >= HOLD_BELOW and fit.free_agreement >= CONVINCING and usual and alike


def least_likeness(track: Track) -> float:
    """What an object's pattern has to show to be the object's.

    Where a scan is blurred or the thing is far away even the right place shows less.
    """
    return min(LEAST_LIKENESS, USUAL_SHARE * track.likeness_there)


def is_believable(fit: Fit, *, wanted_likeness: float = LEAST_LIKENESS) -> bool:
    """Whether enough of the object is seen, agrees and looks like it."""
    alike = not fit.textured or fit.likeness >= wanted_likeness
    least = RECOGNISED_AGREEMENT if shows_pattern(fit) else HOLD_BELOW
    return fit.support >= least and fit.visible_fraction >= LEAST_VISIBLE and alike


def shows_pattern(fit: Fit) -> bool:
    """Whether an object's pattern alone tells that it is there."""
    shows = fit.visible_fraction >= RECOGNISED_VISIBLE
    return fit.textured and shows and fit.likeness >= RECOGNISED_LIKENESS


def confidence_of(fit: Fit) -> float:
    """0..1: how sure a pose is. Wrong yaws of plain objects reach agreements of two thirds."""
    sure = (fit.support - DOUBTED_AGREEMENT) / (CERTAIN_AGREEMENT - DOUBTED_AGREEMENT)
    if fit.textured:
        alike = (fit.likeness - DOUBTED_LIKENESS) / (CERTAIN_LIKENESS - DOUBTED_LIKENESS)
        sure = min(sure, alike)
    return min(max(sure, 0.0), 1.0) * _presence(fit)


def _presence(fit: Fit) -> float:
    """0..1: how little of the silhouette shows the empty room."""
    missing = 1.0 - fit.visible_fraction - fit.covered_fraction
    there = (ABSENT_SHARE - missing) / (ABSENT_SHARE - PRESENT_SHARE)
    return min(max(there, 0.0), 1.0)


def is_certainly_there(fit: Fit, *, is_recognised: bool | None) -> bool:
    """Whether an object that nothing is known of but the scan stands where the scan says.

    Args:
        fit: its measurement there.
        is_recognised: whether its colours explain what is seen, None if they were not asked.
    """
    if is_recognised is None:
        known = is_believable(fit)
    else:
        known = is_recognised and is_believable(fit, wanted_likeness=0.0)
    shown = fit.visible_fraction + fit.covered_fraction >= THERE_VISIBLE
    return known and shown and fit.support >= THERE_SUPPORT
