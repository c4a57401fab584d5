"""Finds lost objects again, all of them together: each place is given once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace

from scenes.state import TrackState
from tracking.beliefs import HEAVY_HEIGHT_M, LOST_CONFIDENCE, SURE, confidence_of
from tracking.claims import Claim, Searched, claims, is_same_spot
from tracking.follow import rest_of
from tracking.guess import Guess
from tracking.places import Overview, overview
from tracking.recover import candidates
from tracking.small_things import SMALL_M
from tracking.smooth import Motion
from tracking.track import RESTING_FRAMES, SEARCH_PERIOD_NS, Audit, Task, Track
from tracking.uncertainty import uncertainty

DOUBTED_SMALL, CERTAIN_SMALL = 0.25, 0.65
"""Confidence in a small object grows from 0 to 1 between these qualities: at wrong yaws, scans with
holes reach what lies between."""

MOST_WAITS = 3
"""From the second search in vain on, the next one waits twice as long, so many times."""

LEAST_CONFIDENCE = 0.3
"""A guess less sure than this is not followed."""


def regain(tasks: Sequence[Task], searches: int) -> Mapping[str, Track]:
    """Tracks of all lost objects after some of them were looked for over the whole scene.

    Small things are looked for in what the large ones leave unexplained.

    Args:
        tasks: of all lost objects; their neighbours are those that are not lost.
        searches: how many objects are looked for, those that waited longest first.
    """
    due = [task for task in tasks if _is_due(task)]
    due = sorted(due, key=lambda task: task.track.searched_ns)[:searches]
    if not due:
        return {}
    look = overview(due[0].scene)
    names = {task.model.object_id for task in due}
    large = [task for task in tasks if task.model.radius_m >= SMALL_M]
    tracks = _searched(large, look, names)
    found = tuple(
        (task.model, tracks[task.model.object_id].world_from_object)
        for task in large
        if tracks[task.model.object_id].state is not TrackState.LOST
    )
    small = [
        replace(task, neighbours=(*task.neighbours, *found))
        for task in tasks
        if task.model.radius_m < SMALL_M
    ]
    return tracks | _searched(small, look, names)


def _searched(tasks: Sequence[Task], look: Overview, due: Set[str]) -> dict[str, Track]:
    """Tracks of some lost objects after those that are due were looked for."""
    fresh = {
        task.model.object_id: _guesses(task, look, len(tasks))
        for task in tasks
        if task.model.object_id in due
    }
    found = claims(
        [
            Searched(
                task.model,
                task.track.world_from_object,
                fresh.get(task.model.object_id, _still_free(task)),
            )
            for task in tasks
        ]
    )
    tracks: dict[str, Track] = {}
    for task in tasks:
        name, track = task.model.object_id, task.track
        if name in fresh:
            now, searches = task.scene.frame.t_ns, track.searches_in_vain + 1
            track = replace(track, searched_ns=now, searches_in_vain=searches, guesses=fresh[name])
        tracks[name] = _regained(replace(task, track=track), found.get(name))
    return tracks


def _guesses(task: Task, look: Overview, enough: int) -> tuple[Guess, ...]:
    """Where an object may be by this frame."""
    last = task.track.world_from_object.translation
    found = candidates(
        task.scene,
        look,
        task.model,
        task.neighbours,
        supports_m=_heights(task),
        last=last,
        enough=enough,
    )
    return tuple(found)


def _still_free(task: Task) -> tuple[Guess, ...]:
    """Earlier guesses whose place was not given to another object since."""
    return tuple(
        guess
        for guess in task.track.guesses
        if not any(
            is_same_spot(task.model, guess.world_from_object, other, world_from_other)
            for other, world_from_other in task.neighbours
        )
    )


def _heights(task: Task) -> tuple[float, ...]:
    """Of what an object may stand on."""
    source = task.model.source
    is_heavy = source.box_m[2] >= HEAVY_HEIGHT_M
    return (source.support_z_m,) if is_heavy else task.scene.stands.heights_m


def _regained(task: Task, claim: Claim | None) -> Track:
    """The track of an object that was looked for."""
    now = task.scene.frame.t_ns
    if claim is None:
        return replace(task.track, rest=None, sketch=None, state=TrackState.LOST, confidence=0.0)
    fit = claim.guess.fit
    confidence = _confidence(claim.guess)
    is_placed = claim.place_is_clear and confidence >= LEAST_CONFIDENCE
    if not is_placed and task.track.seen_ns > 0:
        # What was followed before is likelier to be near its last place than at a doubtful one.
        return replace(task.track, rest=None, state=TrackState.LOST, confidence=0.0)
    is_sure = is_placed and claim.yaw_is_clear and confidence >= SURE
    # What was placed by its colours stays there until they change.
    rest = rest_of(task, fit) if is_placed and claim.guess.explained is not None else None
    state = TrackState.STATIC if rest is not None else TrackState.TRACKED
    return replace(
        task.track,
        world_from_object=fit.world_from_object,
        motion=Motion.rest(now),
        # A place that is unclear is told as a guess, and asked for again.
        state=state if is_placed else TrackState.LOST,
        rest=rest,
        covariance=uncertainty(task.scene, fit),
        visible_fraction=fit.visible_fraction,
        confidence=confidence if is_sure else min(confidence, LOST_CONFIDENCE),
        usual_agreement=fit.free_agreement,
        usual_likeness=max(fit.likeness, 0.0),
        still_frames=0 if rest is None else RESTING_FRAMES,
        missed_frames=0,
        searches_in_vain=0 if is_placed else task.track.searches_in_vain,
        seen_ns=now if is_placed else 0,
        looked_ns=now,
        sketch=fit.sketch,
        portrait=None,
        guesses=() if is_placed else task.track.guesses,
        audit=Audit(now, 0, claim.yaw_is_clear),
    )


def _confidence(guess: Guess) -> float:
    """0..1: how sure a guess is."""
    if guess.explained is None:
        return confidence_of(guess.fit)
    sure = (guess.quality - DOUBTED_SMALL) / (CERTAIN_SMALL - DOUBTED_SMALL)
    return min(max(sure, 0.0), 1.0)


def _is_due(task: Task) -> bool:
    waited_ns = task.scene.frame.t_ns - task.track.searched_ns
    return waited_ns >= SEARCH_PERIOD_NS << min(max(task.track.searches_in_vain - 1, 0), MOST_WAITS)
