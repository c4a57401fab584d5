"""A look around for an object whose pose does not account for what is to be seen of it.

What was lifted, turned or carried by more than a step bridges is found here again, in the next
picture; a pose that was followed wrongly is taken back as soon as another one shows it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import islice

from scenes.state import TrackState
from tracking.evidence.evidence import gather, view_of
from tracking.evidence.observation import observe
from tracking.follow.belief import (
    CERTAIN_NATS,
    OPEN,
    STAYS_NATS,
    accounts_for,
    is_sure,
    was_shown,
)
from tracking.follow.posterior import is_carriable
from tracking.follow.redetection import Search
from tracking.follow.track import Review, Task, Track, portable
from tracking.hypotheses.births import Expected, born, seen_again
from tracking.hypotheses.budget import FrameBudget, Step
from tracking.hypotheses.hypothesis import CLEAR_NATS, Hypothesis, is_other
from tracking.hypotheses.refinement import CLEAR_SHARE
from tracking.hypotheses.search_runner import IN_FRAMES, SearchRunner
from tracking.likelihood.pixel_model import PoseSupport
from tracking.likelihood.pose_likelihood import pose_support
from tracking.solve.covariance import uncertainty
from tracking.solve.motion import Motion

KNOWN_NS = 2_000_000_000
"""Time in ns, since an object was known and pictures showed it no more, for which it is looked for
around there: while the camera is cut off nothing can be found."""

JUMP_M, FASTEST_M_S, FARTHEST_M = 0.08, 3.0, 1.2
"""Distance that is always reachable, speed of a carried object at most (at arm's length from who
turns round), and distance beyond which places are the whole search's: m and m/s."""

LIFT_M, HIGHEST_M = 0.15, 0.75
"""Heights about its last one at which a carried object is looked for are this far apart, m, and go
so far: between them a climb bridges."""

LOOK_SHARE = 0.6
"""Share of the time between looks that a look may take."""

LATER = 0.25
"""Wait until the next look, as a share of the time from when an object was known to the last one:
the longer that is ago, the less a look around there finds."""

MISSING_SHARE = 0.5
"""Share of its usual nats by which another pose must be likelier than one that is followed. Without
it a book in a hand, which showed a third of them in one picture, was taken for 7 cm farther off."""

COASTED_NS = 350_000_000
"""Time in ns over which the way to a new pose says how fast an object moves."""


def look_around(
    tasks: Sequence[Task], look: Search | None, *, runner: SearchRunner = IN_FRAMES
) -> tuple[dict[str, Track], Search | None]:
    """Tracks of who was looked for in this frame, and the look that is not at its end.

    Where a look takes longer than its frame, what it found is confirmed in the frame in which it
    ends: who carries the object may have gone on.

    Args:
        tasks: of all objects, with their tracks of this frame.
        look: pending after the last frame; None if there is none.
        runner: computes it.
    """
    looked: dict[str, Track] = {}
    if look is not None and _is_outdated(look, tasks):
        runner.give_up(look.progress)
        look = None
    if look is None:
        task = _most_missing(tasks)
        if task is None:
            return {}, None
        looked[task.model.object_id] = task.track
        look = Search(portable(task))
    work = partial(_found, look.task)
    progress, found = runner.advance(look.progress, work, budget_ms=math.inf)
    if found is None:
        return looked, replace(look, progress=progress)
    task = _task_of(look, tasks)
    task = replace(task, track=looked.get(task.model.object_id, task.track))
    if task.scene is not look.task.scene:
        found = _confirmed(task, found)
    return {task.model.object_id: _born(task, found[0]) if found else task.track}, None


def awaiting_look(tasks: Sequence[Task], look: Search | None) -> frozenset[str]:
    """Ids of objects for which the pending look is, or one that is due."""
    pending = [] if look is None else [look.task]
    due = [task for task in tasks if _is_due(task)]
    return frozenset(task.model.object_id for task in pending + due)


def _most_missing(tasks: Sequence[Task]) -> Task | None:
    """Of the looks that are due, where most is missing and nobody looked for longest.

    What nobody has seen yet waits for all others.
    """
    due = [task for task in tasks if _is_due(task)]
    if not due:
        return None
    now = due[0].scene.frame.t_ns

    def urgency(task: Task) -> tuple[bool, float]:
        track = task.track
        return was_shown(track), track.usual_nats * (now - track.looked_ns)

    task = max(due, key=urgency)
    return replace(task, track=replace(task.track, looked_ns=now))


def _task_of(look: Search, tasks: Sequence[Task]) -> Task:
    return next(task for task in tasks if task.model is look.task.model)


def _is_outdated(look: Search, tasks: Sequence[Task]) -> bool:
    """Whether the object rests or is in no doubt again.

    A camera that has moved since ends no look: what is found is judged again where it stands now.
    """
    task = _task_of(look, tasks)
    is_resting = task.track.state is TrackState.STATIC
    return is_resting or (is_believed(task.track) and not _is_doubtful(task))


def _found(task: Task, budget: FrameBudget) -> list[Hypothesis]:
    """The likeliest pose that shows an object clearly better than where it is believed, if any."""
    return budget.do(Step.BIRTH, _shown, task)


def _shown(task: Task) -> list[Hypothesis]:
    found = born(task.scene, task.model, neighbours=task.neighbours, expected=expected_of(task))
    return _likelier(task, found)


def _confirmed(task: Task, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The poses that were found in an earlier frame and are shown by this one, too."""
    again = seen_again(
        task.scene,
        task.model,
        poses=[item.world_from_object for item in found],
        neighbours=task.neighbours,
        expected=expected_of(task),
    )
    return _likelier(task, again)


def _likelier(task: Task, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The first pose that shows the object, and clearly better than where it is believed."""
    return list(islice((item for item in found if _is_likelier(task, item)), 1))


def _is_due(task: Task) -> bool:
    track, now = task.track, task.scene.frame.t_ns
    if task.is_first or track.state is TrackState.STATIC:
        return False
    if not was_shown(track) and track.state is TrackState.TRACKED:
        return False
    if is_believed(track):
        is_wanted = _is_doubtful(task)
        since_ns = max(track.looked_ns - track.sure_ns, 0)
    else:
        is_wanted = _may_be_near(track, now)
        last_ns = track.known_ns if was_shown(track) else track.missing_ns
        since_ns = LATER * max(track.looked_ns - last_ns, 0)
    wait_ns = max(task.costs.cost_ms(Step.BIRTH) / LOOK_SHARE * 1e6, since_ns)
    # A picture comes a little early or late.
    return is_wanted and now - track.looked_ns >= 0.9 * wait_ns


def _may_be_near(track: Track, now_ns: int) -> bool:
    """Whether an object that is not seen may be around its last place, or on its way from there."""
    if not was_shown(track):
        # It may be carried off at any time after somebody came there.
        return now_ns > track.missing_ns
    gone_ns = max(track.known_ns, track.missing_ns)
    # Looks go one by one: each object has one at least.
    return now_ns - gone_ns < KNOWN_NS or track.looked_ns <= gone_ns


def _is_doubtful(task: Task) -> bool:
    """Whether an object shows less in this frame than all that it shows."""
    return task.scene.frame.t_ns > task.track.sure_ns


def is_believed(track: Track) -> bool:
    """Whether an object is followed where it accounts for what is to be seen of it."""
    return track.state is TrackState.TRACKED and accounts_for(track, track.rate)


def expected_of(task: Task) -> Expected:
    """Poses and places that an object may have gone to since it was last known."""
    track, now = task.track, task.scene.frame.t_ns
    known = track.world_from_known
    if is_believed(track):
        since_ns, moved = track.sure_ns, track.world_from_object
    else:
        # What never showed may have gone at any time.
        since_ns = track.known_ns if was_shown(track) else 0
        moved = track.known_motion.predict(known, now)
    reach_m = JUMP_M + FASTEST_M_S * (now - since_ns) * 1e-9
    height_m = float(known.translation[2])
    supports = tuple(h for h in task.support_heights_m if abs(h - height_m) < reach_m + 0.02)
    lifts = lifted_heights(height_m, reach_m=reach_m, lowest_m=min(task.support_heights_m))
    poses = (moved, known) if is_other(task.model, moved, known) else (moved,)
    return Expected(
        poses,
        min(reach_m, FARTHEST_M),
        supports,
        lifts if is_carriable(task.model.source.box_m) else (),
    )


def lifted_heights(height_m: float, *, reach_m: float, lowest_m: float) -> tuple[float, ...]:
    """Heights at which an object is looked for that is carried, above the lowest support plane.

    Args:
        height_m: its last one.
        reach_m: how far it may be from there.
        lowest_m: of the support planes.
    """
    count = math.floor(min(reach_m, HIGHEST_M) / LIFT_M)
    heights = (height_m + step * LIFT_M for step in range(-count, count + 1))
    return tuple(height for height in heights if height > lowest_m + 0.05)


def _is_likelier(task: Task, item: Hypothesis) -> bool:
    """Whether a pose shows the object, and clearly better than where it is believed."""
    track, support = task.track, item.support
    if support.is_covered or not _accounts_for(track, support):
        return False
    # Of what is mostly hidden all the rest has to show: behind a curtain anything looks like it.
    if support.is_mostly_hidden and not is_sure(support.nats_a_sample):
        return False
    if track.state is TrackState.LOST:
        return item.log_odds > CLEAR_NATS
    believed = track.world_from_object
    scene, model = task.scene, task.model
    evidence = gather(scene, model, view_of(scene, model, believed), task.neighbours)
    observation = observe(scene, evidence, is_looked_for=True)
    there = pose_support(observation, model, believed, scene.renderer)
    is_step = not is_other(model, item.world_from_object, believed)
    if is_step and is_sure(there.nats_a_sample):
        return False
    if track.state is TrackState.TRACKED:
        # What is nearer covers more pixels, and has more nats of what is around it.
        if support.nats_a_sample < there.nats_a_sample:
            return False
        # What is followed shows less for a picture or two, too, in a hand or in another light.
        missing_nats = MISSING_SHARE * track.usual_nats
        if is_sure(support.nats_a_sample):
            missing_nats = CLEAR_SHARE * item.log_odds
        return item.log_odds > there.nats + max(missing_nats, CLEAR_NATS)
    stood = track.world_from_stood
    stood_there = stood is not None and not is_other(model, stood, believed)
    rests = stood_there or not was_shown(track)
    # What rests where something hides it is elsewhere only where it shows all that it shows: who
    # stands before it has the colours of a part of it somewhere.
    if rests and not is_sure(support.nats_a_sample) and there.unknown_fraction >= OPEN:
        return False
    stays = STAYS_NATS if rests else 0.0
    return item.log_odds > max(there.nats, 0.0) + stays + CLEAR_NATS


def _accounts_for(track: Track, support: PoseSupport) -> bool:
    """Whether a pose with such a support accounts for an object.

    It is passers-by who look a little like it: the less that is unknown is around the pose, the
    less it has to show. A chair in a dark corner showed 0.4 nats a sample, and nobody was near.
    """
    share = min(support.unknown_fraction / OPEN, 1.0)
    return accounts_for(track, support.nats_a_sample, share=share)


def _born(task: Task, item: Hypothesis) -> Track:
    """The track of an object at a pose that was found."""
    track, now, fit = task.track, task.scene.frame.t_ns, item.fit
    motion = Motion.rest(now)
    if now - track.known_ns <= COASTED_NS:
        since = replace(track.known_motion, t_ns=track.known_ns)
        motion = since.measured(track.world_from_known, fit.world_from_object, now)
    return replace(
        track,
        world_from_object=fit.world_from_object,
        motion=motion,
        state=TrackState.TRACKED,
        covariance=uncertainty(task.scene, task.model, fit),
        visible_fraction=fit.visible_fraction,
        confidence=1.0 / (1.0 + math.exp(-min(item.log_odds, CERTAIN_NATS))),
        was_at_rest=False,
        usual_inlier_ratio=fit.unoccluded_inlier_ratio,
        usual_correlation=max(fit.colour_correlation, 0.0),
        usual_nats=item.support.nats,
        stays_nats=STAYS_NATS,
        rate=item.support.nats_a_sample,
        world_from_known=fit.world_from_object,
        known_ns=now,
        known_motion=motion,
        sure_ns=now,
        still_frames=0,
        missed_frames=0,
        searches_in_vain=0,
        seen_ns=now,
        rest=None,
        reduced=fit.reduced,
        appearance=None,
        hypotheses=(),
        review=Review(now, 0, 0.0, 0.0),
    )
