"""Objects of a capture to be cut out, with their marks and their truth; and how a cut is scored."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

from benchmarks.evaluate.cuts.captures import Capture
from benchmarks.evaluate.cuts.cutting import (
    Cut,
    Cutting,
    best_proposal,
    cut_labelled,
    proposals_of,
    with_labels,
)
from benchmarks.evaluate.cuts.marking import WAYS, marks_of, prompted
from benchmarks.evaluate.cuts.scores import CutScore, TrueCut, figures
from benchmarks.evaluate.cuts.true_outlines import true_outlines
from benchmarks.evaluate.cuts.truth import truth_of
from scenes.prepare.cutout.marks.prompted_views import PromptedView
from scenes.prepare.cutout.proposals import Proposal
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer

PROPOSED, MADE, BY_TRUTH = "propose", "true_labels_made", "true_labels"
"""Ways that need no mark: the product's proposals; an object that it makes of the truth's labels;
and these labels themselves, which no cut of these splats can exceed."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One object of a capture.

    Attributes:
        capture: that it is in.
        object_id: unique there.
        family: what it is.
        views: marked photos by way of marking (`WAYS`), the best first; none where no photo shows
            enough of the object.
        truth: what a perfect cut would be.
        seen_share: how much of its surface the photos saw.
    """

    capture: Capture
    object_id: str
    family: str
    views: Mapping[str, tuple[PromptedView, ...]]
    truth: TrueCut
    seen_share: float


def cases_of(capture: Capture) -> list[Case]:
    """Every movable object of a capture; the first time takes minutes, then it is read."""
    truth, marks = truth_of(capture, renderer=NativeRenderer()), marks_of(capture)
    room = RayScene(np.concatenate(capture.parts))
    cases = []
    for number, item in enumerate(capture.objects):
        own = marks[item.object_id]
        perfect = TrueCut(
            labels=truth.labels == number,
            by_mesh=truth.by_mesh == number,
            triangles=item.triangles,
            seen=truth.seen[number],
            box_m=item.box_m,
            outlines=true_outlines(capture, number, room=room),
        )
        views = {way: prompted(capture, own, way=way) for way in WAYS}
        share = float(truth.seen_share[number])
        cases.append(Case(capture, item.object_id, item.family, views, perfect, share))
    return cases


def score(case: Case, cutting: Cutting | None, *, way: str, seconds: float = 0.0) -> CutScore:
    """How well a case was cut; None was refused."""
    return _score(case, cutting, way=way, seconds=seconds, refused="")


def scores_of(
    case: Case,
    cut: Cut,
    *,
    ways: Sequence[str] = tuple(WAYS),
    stopwatch: Callable[[], float] = time.perf_counter,
) -> list[CutScore]:
    """Cut a case in each way of marking, and score what comes out.

    A cut that is refused is scored as one that found nothing. A case that no photo shows has no
    score.

    Args:
        case: the object.
        cut: how it is cut.
        ways: some of `WAYS`.
        stopwatch: seconds.
    """
    scores = []
    for way in ways:
        if case.views[way]:
            made = partial(cut, case.capture, case.views[way])
            scores.append(_timed(case, made, way=way, stopwatch=stopwatch))
    return scores


def scores_without_marks(
    cases: Sequence[Case], *, stopwatch: Callable[[], float] = time.perf_counter
) -> list[CutScore]:
    """Scores of `nexus cut --propose`, and of cuts by the truth, of a capture's cases."""
    if not cases:
        return []
    capture = cases[0].capture
    proposals = proposals_of(capture)
    scores = []
    for case in (case for case in cases if case.views["one_box"]):
        own = case.truth.labels
        made = partial(cut_labelled, capture.package, own)
        scores.append(_timed(case, made, way=MADE, stopwatch=stopwatch))
        perfect = partial(with_labels, capture.package, own)
        scores.append(_timed(case, perfect, way=BY_TRUTH, stopwatch=stopwatch))
        proposed = partial(_accept, case, proposals)
        scores.append(_timed(case, proposed, way=PROPOSED, stopwatch=stopwatch))
    return scores


def _accept(case: Case, proposals: Sequence[Proposal]) -> Cutting:
    """The proposal that is most like the object, accepted.

    Raises:
        ValueError: none is like it.
    """
    best = best_proposal(proposals, case.truth.labels)
    if best is None:
        raise ValueError(f"{case.object_id} is not among the {len(proposals)} proposals")
    return cut_labelled(case.capture.package, best.found.labels)


def _timed(
    case: Case, make: Callable[[], Cutting], *, way: str, stopwatch: Callable[[], float]
) -> CutScore:
    began, refused = stopwatch(), ""
    cutting: Cutting | None = None
    try:
        cutting = make()
    except ValueError as reason:
        refused = str(reason)
    return _score(case, cutting, way=way, seconds=stopwatch() - began, refused=refused)


def _score(
    case: Case, cutting: Cutting | None, *, way: str, seconds: float, refused: str
) -> CutScore:
    return CutScore(
        room=case.capture.folder.name,
        object_id=case.object_id,
        family=case.family,
        way=way,
        photos=len(case.views.get(way, ())),
        seconds=seconds,
        refused=refused,
        **asdict(figures(case.truth, cutting, room=case.capture.package.room)),
    )
