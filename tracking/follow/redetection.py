"""Re-detection of lost objects, assigned jointly: each position goes to one object."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from scenes.state import TrackState
from tracking.evidence.evidence import gather, view_of
from tracking.evidence.observation import observe
from tracking.follow.belief import STAYS_NATS, is_sure, support_at, was_shown
from tracking.follow.posterior import HEAVY_HEIGHT_M
from tracking.follow.rest import rest_of
from tracking.follow.track import RESTING_FRAMES, SEARCH_PERIOD_NS, Review, Task, Track, portable
from tracking.hypotheses.assignment import Assignment, AssignmentCandidates, assign, is_same_spot
from tracking.hypotheses.budget import FrameBudget
from tracking.hypotheses.hypothesis import CLEAR_NATS, Hypothesis, distinct, is_other
from tracking.hypotheses.refinement import fit_at
from tracking.hypotheses.search import search
from tracking.hypotheses.search_runner import BEGUN, IN_FRAMES, Progress, SearchRunner
from tracking.likelihood.pose_likelihood import pose_support
from tracking.model.support_planes import EVERYWHERE_M
from tracking.solve.covariance import uncertainty
from tracking.solve.motion import Motion

MAX_WAITS = 3
"""Most doublings of the search period after searches in vain: in the end an object is looked for
every six seconds."""

HIDDEN_FRAMES = 6
"""Frames for which an object is hidden before it is looked for elsewhere: a passer-by takes about
as long."""

FOUND = 0.5
"""Posterior of a place, and of a pose, from which it is likelier right than wrong."""


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """A pending search for one object, or a look for it, in the frame in which it began.

    Attributes:
        task: the object and that frame.
        progress: how far it is.
    """

    task: Task
    progress: Progress = BEGUN


def redetect_all(tasks: Sequence[Task]) -> Mapping[str, Track]:
    """Tracks of all lost objects after a search over the whole scene.

    Args:
        tasks: of all lost objects; their neighbours are those that are not lost.
    """
    if not tasks:
        return {}
    return _assign(tasks, {_id(task): _hypotheses(task) for task in tasks})


def redetect(
    tasks: Sequence[Task],
    search: Search | None,
    *,
    budget_ms: float,
    runner: SearchRunner = IN_FRAMES,
    looked_for: Collection[str] = (),
) -> tuple[Mapping[str, Track], Search | None]:
    """Tracks of lost objects after this frame's part of the search for one, and the pending rest.

    A search of the whole scene takes several frames, so that none is late for it, and works on the
    frame in which it began. The next search is for the object that waited longest.

    Args:
        tasks: of all lost objects; their neighbours are those that are not lost.
        search: pending after the last frame; None if there is none.
        budget_ms: time for steps of the search in this frame.
        runner: computes it.
        looked_for: ids of objects that are looked for around their places: no search begins for
            them, which would take what the looks need.
    """
    if search is not None and _is_outdated(search, tasks):
        runner.give_up(search.progress)
        search = None
    search = search or _begin([task for task in tasks if _id(task) not in looked_for])
    if search is None:
        return {}, None
    work = partial(_hypotheses, search.task)
    progress, hypotheses = runner.advance(search.progress, work, budget_ms=budget_ms)
    if hypotheses is None:
        return {}, replace(search, progress=progress)
    began_ns = search.task.scene.frame.t_ns
    return _assign(tasks, {_id(search.task): hypotheses}, began_ns=began_ns), None


def is_missing(track: Track) -> bool:
    """Whether an object has to be looked for: lost, or hidden for so long that it may have gone."""
    is_hidden = track.state is TrackState.OCCLUDED and track.missed_frames >= HIDDEN_FRAMES
    return track.state is TrackState.LOST or is_hidden


def _was_seen(track: Track) -> bool:
    """Whether an object was seen in this session, where it is believed to be."""
    return track.state is TrackState.LOST or was_shown(track)


def _begin(tasks: Sequence[Task]) -> Search | None:
    """A search for the object that waited longest; None if none is due.

    What nobody has seen yet, behind furniture or in a cupboard, waits for all others.
    """
    due = [task for task in tasks if _is_due(task)]
    if not due:
        return None
    return Search(
        portable(min(due, key=lambda task: (not _was_seen(task.track), task.track.searched_ns)))
    )


def _is_outdated(search: Search, tasks: Sequence[Task]) -> bool:
    """Whether the object is no longer lost, or was never seen while another is lost.

    A camera that has moved since ends no search: its places are the world's.
    """
    if not any(task.model is search.task.model for task in tasks):
        return True
    others = (task for task in tasks if task.model is not search.task.model)
    return not _was_seen(search.task.track) and any(
        _was_seen(task.track) and _is_due(task) for task in others
    )


def _assign(
    tasks: Sequence[Task], fresh: Mapping[str, Sequence[Hypothesis]], *, began_ns: int | None = None
) -> dict[str, Track]:
    """Tracks of lost objects after a joint assignment.

    A search works on the frame in which it began: who carries the object may have gone on since.
    From where it found the object then, it is looked for around there.

    Args:
        tasks: the objects.
        fresh: hypotheses of those that were searched for, by object id.
        began_ns: time of the frame in which their search began; None if it is this one.
    """
    tasks = [_record_search(task, fresh.get(_id(task))) for task in tasks]
    found = assign([AssignmentCandidates(task.model, _still_free(task)) for task in tasks])
    tracks: dict[str, Track] = {}
    for task in tasks:
        assignment = found.get(_id(task))
        if began_ns is not None and assignment is not None and _has_gone(task, assignment):
            if _id(task) in fresh:
                task = _known_there(task, assignment, t_ns=began_ns)
            assignment = None
        tracks[_id(task)] = _redetect(task, assignment)
    return tracks


def _has_gone(task: Task, assignment: Assignment) -> bool:
    """Whether this frame shows the empty room at a place that was found in an earlier one."""
    return support_at(task, assignment.hypothesis.world_from_object).nats < -CLEAR_NATS


def _known_there(task: Task, assignment: Assignment, *, t_ns: int) -> Task:
    """The task of an object that was where a search found it, in the frame in which that began."""
    pose = assignment.hypothesis.world_from_object
    if assignment.place_probability < FOUND or not is_other(
        task.model, pose, task.track.world_from_object
    ):
        return task
    track = replace(
        task.track,
        world_from_known=pose,
        known_ns=t_ns,
        known_motion=Motion.rest(t_ns),
        missing_ns=task.scene.frame.t_ns,
    )
    return replace(task, track=track)


def _record_search(task: Task, hypotheses: Sequence[Hypothesis] | None) -> Task:
    """The task with the outcome of its search recorded, if there was one."""
    if hypotheses is None:
        return task
    track = replace(
        task.track,
        searched_ns=task.scene.frame.t_ns,
        searches_in_vain=task.track.searches_in_vain + 1,
        hypotheses=tuple(hypotheses),
    )
    return replace(task, track=track)


def _hypotheses(task: Task, budget: FrameBudget | None = None) -> list[Hypothesis]:
    """Pose hypotheses of an object in the task's frame; in the first, the scanned pose is one."""
    found = search(
        task.scene,
        task.model,
        task.neighbours,
        support_heights_m=heights_of(task),
        world_from_last=task.track.world_from_object,
        budget=budget or FrameBudget(costs=task.costs),
    )
    return distinct(task.model, [*found, _stayed(task)])


def _stayed(task: Task) -> Hypothesis:
    """The hypothesis that an object still stands where it was believed until now."""
    scene, model, pose = task.scene, task.model, task.track.world_from_object
    evidence = gather(scene, model, view_of(scene, model, pose, at_any_yaw=True), task.neighbours)
    support = pose_support(observe(scene, evidence), model, pose, scene.renderer)
    return Hypothesis(fit_at(scene, model, evidence, pose), support, task.track.stays_nats)


def _still_free(task: Task) -> tuple[Hypothesis, ...]:
    """Hypotheses whose position was not assigned to another object since."""
    return tuple(
        hypothesis
        for hypothesis in task.track.hypotheses
        if not _is_on_a_passer_by(task, hypothesis)
        and not any(
            is_same_spot(task.model, hypothesis.world_from_object, other, world_from_other)
            for other, world_from_other in task.neighbours
        )
    )


def _is_on_a_passer_by(task: Task, hypothesis: Hypothesis) -> bool:
    """Whether something unknown hides most of another place than the last one."""
    pose, last = hypothesis.world_from_object, task.track.world_from_object
    return hypothesis.support.is_covered and is_other(task.model, pose, last)


def heights_of(task: Task) -> tuple[float, ...]:
    """Heights in m of the support planes of an object."""
    source = task.model.source
    # What stood on furniture can be lifted onto other furniture.
    is_heavy = source.box_m[2] >= HEAVY_HEIGHT_M and source.support_z_m < EVERYWHERE_M
    return (source.support_z_m,) if is_heavy else task.scene.support_planes.heights_m


def _redetect(task: Task, assignment: Assignment | None) -> Track:
    """The track of an object after the assignment."""
    now = task.scene.frame.t_ns
    if assignment is None or assignment.place_probability < FOUND:
        # Unlikely places move nothing: it is likelier where it was seen last.
        if task.track.state is TrackState.OCCLUDED:
            return task.track
        return replace(task.track, rest=None, reduced=None, state=TrackState.LOST, confidence=0.0)
    hypothesis = assignment.hypothesis
    is_hidden = task.track.state is TrackState.OCCLUDED
    if is_hidden and not _has_come_out(task, hypothesis):
        return task.track
    fit = hypothesis.fit
    # A search that took several frames is confirmed in the next: the object may have gone on.
    rest = rest_of(task, fit) if task.is_first else None
    return replace(
        task.track,
        world_from_object=fit.world_from_object,
        motion=Motion.rest(now),
        state=TrackState.TRACKED if rest is None else TrackState.STATIC,
        rest=rest,
        covariance=uncertainty(task.scene, task.model, fit),
        visible_fraction=fit.visible_fraction,
        confidence=assignment.pose_probability,
        usual_inlier_ratio=fit.unoccluded_inlier_ratio,
        usual_correlation=max(fit.colour_correlation, 0.0),
        usual_nats=hypothesis.support.nats,
        stays_nats=STAYS_NATS,
        rate=hypothesis.support.nats_a_sample,
        world_from_known=fit.world_from_object,
        known_ns=now,
        known_motion=Motion.rest(now),
        sure_ns=now,
        was_at_rest=rest is not None,
        still_frames=0 if rest is None else RESTING_FRAMES,
        missed_frames=0,
        searches_in_vain=0,
        seen_ns=now,
        reduced=fit.reduced,
        appearance=None,
        hypotheses=(),
        review=Review(now, 0, assignment.rival_nats, assignment.rival_nats),
    )


def _has_come_out(task: Task, hypothesis: Hypothesis) -> bool:
    """Whether a hidden object is elsewhere; of one that was never seen, all has to show there."""
    track = task.track
    if not is_other(task.model, hypothesis.world_from_object, track.world_from_object):
        return False
    return _was_seen(track) or is_sure(hypothesis.support.nats_a_sample)


def _id(task: Task) -> str:
    return task.model.object_id


def _is_due(task: Task) -> bool:
    waited_ns = task.scene.frame.t_ns - task.track.searched_ns
    return waited_ns >= SEARCH_PERIOD_NS << min(max(task.track.searches_in_vain - 1, 0), MAX_WAITS)
