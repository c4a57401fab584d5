"""Re-detection of lost objects, assigned jointly: each position goes to one object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from scenes.state import TrackState
from tracking.follow.follow import rest_of
from tracking.follow.posterior import HEAVY_HEIGHT_M, LOST_CONFIDENCE, SURE, confidence_of
from tracking.follow.track import RESTING_FRAMES, SEARCH_PERIOD_NS, Review, Task, Track
from tracking.hypotheses.assignment import Assignment, AssignmentCandidates, assign, is_same_spot
from tracking.hypotheses.budget import NOMINAL_COSTS, BudgetExhausted, FrameBudget, Step, StepCosts
from tracking.hypotheses.hypothesis import Hypothesis
from tracking.hypotheses.patch_search import SMALL_M
from tracking.hypotheses.positions import Overview, overview
from tracking.hypotheses.room_search import candidates
from tracking.solve.covariance import uncertainty
from tracking.solve.motion import Motion

CONFIDENCE_ZERO_SCORE = 0.2
"""Photometric score of confidence 0. In twelve layouts kept for validation, unrivalled answers were
right from 0.27 on and wrong at 0.14."""

CONFIDENCE_FULL_SCORE = 0.5
"""Photometric score of confidence 1; half of the right answers of those layouts were above 0.45."""


MOST_WAITS = 3
"""Most doublings of the search period after searches in vain."""


LEAST_CONFIDENCE = 0.3
"""Confidence below which a hypothesis is not followed. Chosen on the rooms lab and desk."""


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """A pending search for one object, in the frame in which it began.

    Attributes:
        task: the object and that frame.
        look: the frame's overview.
        enough: number of unambiguous poses that end it.
        done: results of its steps so far, see `tracking.hypotheses.budget`.
    """

    task: Task
    look: Overview
    enough: int
    done: tuple[object, ...]


def redetect_all(tasks: Sequence[Task]) -> Mapping[str, Track]:
    """Tracks of all lost objects after a search over the whole scene.

    Small objects are searched for in what large ones leave unassigned.

    Args:
        tasks: of all lost objects; their neighbours are those that are not lost.
    """
    if not tasks:
        return {}
    look = overview(tasks[0].scene)
    large = [task for task in tasks if task.model.radius_m >= SMALL_M]
    tracks = _placed(large, {_id(task): _hypotheses(task, look, len(large)) for task in large})
    small = _beside(tasks, tracks)
    found = {_id(task): _hypotheses(task, look, len(small)) for task in small}
    return tracks | _placed(small, found)


def redetect(
    tasks: Sequence[Task],
    search: Search | None,
    *,
    budget_ms: float,
    costs: StepCosts = NOMINAL_COSTS,
) -> tuple[Mapping[str, Track], Search | None]:
    """Tracks of lost objects after some steps of the search for one of them, and the pending rest.

    A search is spread over frames, so that none is late for it, and works on the frame in which it
    began. The next search is for the object that waited longest.

    Args:
        tasks: of all lost objects; their neighbours are those that are not lost.
        search: pending after the last frame; None if there is none.
        budget_ms: time for steps of the search in this frame.
        costs: of these steps.
    """
    if search is None or _is_outdated(search, tasks):
        budget_ms -= costs.cost_ms(Step.OVERVIEW)
        search = _begun(tasks, costs)
    if search is None:
        return {}, None
    budget = FrameBudget(budget_ms, search.done, costs)
    try:
        hypotheses = _hypotheses(search.task, search.look, search.enough, budget)
    except BudgetExhausted:
        return {}, replace(search, done=budget.done())
    large = [task for task in tasks if task.model.radius_m >= SMALL_M]
    name = _id(search.task)
    tracks = _placed(large, {name: hypotheses})
    return tracks | _placed(_beside(tasks, tracks), {name: hypotheses}), None


def _begun(tasks: Sequence[Task], costs: StepCosts) -> Search | None:
    """A search for the object that waited longest; None if none is due."""
    due = [task for task in tasks if _is_due(task)]
    if not due:
        return None
    task = min(due, key=lambda task: task.track.searched_ns)
    is_small = task.model.radius_m < SMALL_M
    same_class = [other for other in tasks if (other.model.radius_m < SMALL_M) == is_small]
    look, _ = costs.timed(Step.OVERVIEW, lambda: overview(task.scene))
    return Search(task, look, len(same_class), ())


def _is_outdated(search: Search, tasks: Sequence[Task]) -> bool:
    """Whether the object is no longer lost, or the camera's pose has changed since."""
    begun = search.task.scene
    return not any(
        task.model is search.task.model and task.scene.world_from_rig is begun.world_from_rig
        for task in tasks
    )


def _beside(tasks: Sequence[Task], tracks: Mapping[str, Track]) -> list[Task]:
    """Tasks of the small objects, with the large ones just found as neighbours."""
    found = tuple(
        (task.model, tracks[_id(task)].world_from_object)
        for task in tasks
        if _id(task) in tracks and tracks[_id(task)].state is not TrackState.LOST
    )
    return [
        replace(task, neighbours=(*task.neighbours, *found))
        for task in tasks
        if task.model.radius_m < SMALL_M
    ]


def _placed(tasks: Sequence[Task], fresh: Mapping[str, Sequence[Hypothesis]]) -> dict[str, Track]:
    """Tracks of lost objects after a joint assignment.

    Args:
        tasks: the objects.
        fresh: hypotheses of those that were searched for, by object id.
    """
    tasks = [_searched(task, fresh.get(_id(task))) for task in tasks]
    found = assign(
        [
            AssignmentCandidates(task.model, task.track.world_from_object, _still_free(task))
            for task in tasks
        ]
    )
    return {_id(task): _redetected(task, found.get(_id(task))) for task in tasks}


def _searched(task: Task, hypotheses: Sequence[Hypothesis] | None) -> Task:
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


def _hypotheses(
    task: Task, look: Overview, enough: int, budget: FrameBudget | None = None
) -> list[Hypothesis]:
    """Pose hypotheses of an object in the task's frame."""
    last = task.track.world_from_object.translation
    return candidates(
        task.scene,
        look,
        task.model,
        task.neighbours,
        support_heights_m=_heights(task),
        last=last,
        enough=enough,
        budget=budget or FrameBudget(costs=task.costs),
    )


def _still_free(task: Task) -> tuple[Hypothesis, ...]:
    """Hypotheses whose position was not assigned to another object since."""
    return tuple(
        hypothesis
        for hypothesis in task.track.hypotheses
        if not any(
            is_same_spot(task.model, hypothesis.world_from_object, other, world_from_other)
            for other, world_from_other in task.neighbours
        )
    )


def _heights(task: Task) -> tuple[float, ...]:
    """Heights in m of the support planes of an object."""
    source = task.model.source
    is_heavy = source.box_m[2] >= HEAVY_HEIGHT_M
    return (source.support_z_m,) if is_heavy else task.scene.support_planes.heights_m


def _redetected(task: Task, assignment: Assignment | None) -> Track:
    """The track of an object after the assignment."""
    now = task.scene.frame.t_ns
    if assignment is None:
        return replace(task.track, rest=None, reduced=None, state=TrackState.LOST, confidence=0.0)
    fit = assignment.hypothesis.fit
    confidence = _confidence(assignment.hypothesis)
    is_placed = assignment.place_is_clear and confidence >= LEAST_CONFIDENCE
    if not is_placed and task.track.seen_ns > 0:
        # A formerly tracked object is likelier near its last pose than at a weak hypothesis.
        return replace(task.track, rest=None, state=TrackState.LOST, confidence=0.0)
    is_sure = is_placed and assignment.yaw_is_clear and confidence >= SURE
    # What was placed by its colours stays there until they change.
    rest = (
        rest_of(task, fit)
        if is_placed and assignment.hypothesis.photometric_score is not None
        else None
    )
    state = TrackState.STATIC if rest is not None else TrackState.TRACKED
    return replace(
        task.track,
        world_from_object=fit.world_from_object,
        motion=Motion.rest(now),
        # An ambiguous position is reported as lost, and searched for again.
        state=state if is_placed else TrackState.LOST,
        rest=rest,
        covariance=uncertainty(task.scene, task.model, fit),
        visible_fraction=fit.visible_fraction,
        confidence=confidence if is_sure else min(confidence, LOST_CONFIDENCE),
        usual_inlier_ratio=fit.unoccluded_inlier_ratio,
        usual_correlation=max(fit.colour_correlation, 0.0),
        still_frames=0 if rest is None else RESTING_FRAMES,
        missed_frames=0,
        searches_in_vain=0 if is_placed else task.track.searches_in_vain,
        seen_ns=now if is_placed else 0,
        looked_ns=now,
        reduced=fit.reduced,
        appearance=None,
        hypotheses=() if is_placed else task.track.hypotheses,
        review=Review(now, 0, assignment.yaw_is_clear),
    )


def _confidence(hypothesis: Hypothesis) -> float:
    """0..1 confidence in a hypothesis."""
    if hypothesis.photometric_score is None:
        return confidence_of(hypothesis.fit)
    sure = (hypothesis.score - CONFIDENCE_ZERO_SCORE) / (
        CONFIDENCE_FULL_SCORE - CONFIDENCE_ZERO_SCORE
    )
    return min(max(sure, 0.0), 1.0)


def _id(task: Task) -> str:
    return task.model.object_id


def _is_due(task: Task) -> bool:
    waited_ns = task.scene.frame.t_ns - task.track.searched_ns
    return waited_ns >= SEARCH_PERIOD_NS << min(max(task.track.searches_in_vain - 1, 0), MOST_WAITS)
