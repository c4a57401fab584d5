"""Refined models of objects that were cut out, held against true pictures.

`true_views.py` draws them: from where photos were kept aside, and from sides that nobody filmed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.cuts.captures import Capture
from benchmarks.evaluate.cuts.cases import Case
from benchmarks.evaluate.cuts.cutting import OBJECT_ID
from benchmarks.evaluate.cuts.true_views import TrueRoom, TrueView
from scenes.prepare.cutout.cutout import Cutout, cut_marked, make_object
from scenes.prepare.cutout.labelling.separate import Separation
from scenes.prepare.reconstruction import View
from scenes.prepare.refine.refine import HELD_OUT_EVERY, RefineOptions
from scenes.prepare.refine.scene import refine_object
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.state import ObjectModel
from studio.console.progress import Progress
from studio.console.rows import Row, at_least, at_most

FloatArray = NDArray[np.float64]

BY_BOXES, BY_TRUTH = "two_boxes", "true_labels"
"""Cuts that are refined: the product's, and one of the truth's labels, whose faults are the
refinement's alone."""

SECONDS_BAR, ASIDE_BAR_DB, UNSEEN_BAR_DB = 15.0, 30.0, 25.0
"""An object's refinement, and its model against true pictures."""


class Draw(Protocol):
    """Gives a room's true pictures."""

    def __call__(self, capture: Capture, *, aside: Sequence[View]) -> TrueRoom:
        """Ready to draw a capture's room.

        Args:
            capture: of the room.
            aside: its photos that no training saw.
        """
        ...


@dataclass(frozen=True, slots=True)
class RefineScore:
    """How good a refined model is.

    Attributes:
        room: name of the capture.
        object_id: of the object.
        family: of the object.
        way: of cutting, `BY_BOXES` or `BY_TRUTH`.
        photos: that it was trained on.
        splats: of the refined model.
        seconds: that it took.
        aside_db: PSNR of the object in true pictures from where photos were kept aside; NaN where
            none shows it.
        unseen_db: and from sides at least 60° from every photo, where a photo saw the surface; NaN
            where there are none.
        aside_before_db: of the model as it was cut.
        unseen_before_db: the same.
        refused: why there was none; empty if there was one.
    """

    room: str
    object_id: str
    family: str
    way: str
    photos: int = 0
    splats: int = 0
    seconds: float = math.nan
    aside_db: float = math.nan
    unseen_db: float = math.nan
    aside_before_db: float = math.nan
    unseen_before_db: float = math.nan
    refused: str = ""


def refined_scores(
    cases: Sequence[Case],
    *,
    draw: Draw,
    progress: Progress,
    ways: Sequence[str] = (BY_BOXES, BY_TRUTH),
    options: RefineOptions | None = None,
    stopwatch: Callable[[], float] = time.perf_counter,
) -> list[RefineScore]:
    """Scores of each object of a room that photos show.

    Args:
        cases: of one capture.
        draw: gives the room's true pictures.
        progress: shows what is under way.
        ways: of cutting.
        options: of the refinement; the product's if not given.
        stopwatch: seconds.
    """
    if not cases:
        return []
    capture, renderer = cases[0].capture, NativeRenderer()
    name = capture.folder.name
    progress.begin(f"{name}: refining")
    scores: list[RefineScore] = []
    aside = capture.photos[HELD_OUT_EVERY - 1 :: HELD_OUT_EVERY]
    with draw(capture, aside=aside) as truth:
        colours = truth.colours(capture.package.room, renderer)
        for number, case in enumerate(cases):
            if not case.views[BY_BOXES]:
                continue
            progress.advance(number / len(cases), case.object_id)
            views = (truth.aside_views(number), truth.unseen_views(number, case.truth.seen))
            judge = _Judge(views, colours, renderer, options or RefineOptions(), stopwatch)
            scores += [_score(case, way, judge=judge) for way in ways]
    progress.finish(f"{len(scores)} models")
    return scores


def refine_rows(scores: Sequence[RefineScore]) -> list[Row]:
    """The figures of all refined models; none without one."""
    rows = _figures("refine", [s for s in scores if s.way == BY_BOXES], are_judged=True)
    by_truth = [s for s in scores if s.way == BY_TRUTH]
    return rows + _figures(f"refine.{BY_TRUTH}", by_truth, are_judged=False)


def refine_table(scores: Sequence[RefineScore]) -> str:
    """Each object's figures, for people."""
    lines = [
        f"{'refined':<34}{'cut by':>14}{'splats':>8}{'photos':>8}{'s':>7}"
        f"{'kept aside, dB':>18}{'unseen sides, dB':>20}"
    ]
    for s in scores:
        line = f"{s.room + ' ' + s.object_id:<34}{s.way:>14}"
        if s.refused:
            lines.append(f"{line}  {s.refused}")
            continue
        line += f"{s.splats:>8}{s.photos:>8}{s.seconds:>7.1f}"
        line += f"{s.aside_before_db:>9.1f} -> {s.aside_db:>5.1f}"
        lines.append(f"{line}{s.unseen_before_db:>11.1f} -> {s.unseen_db:>5.1f}")
    return "\n".join(lines)


def quality_db(model: ObjectModel, views: Sequence[TrueView], *, colours: FloatArray) -> float:
    """PSNR of a model in pictures of it, where these show it; NaN without any.

    Args:
        model: where it was cut out.
        views: true pictures.
        colours: (3, 2) gain and bias from the model's colours to theirs.
    """
    renderer = NativeRenderer()
    errors: list[FloatArray] = []
    posed = [PosedSplats(model.splats, model.world_from_object)]
    gain, bias = colours.T
    for view in views:
        drawn = renderer.render(posed, view.camera, view.world_from_camera, RenderOptions())
        alpha = drawn.alpha[..., None].astype(np.float64)
        own = gain * drawn.rgb + bias * alpha
        rgb = np.clip(own + (1 - alpha) * view.behind, 0, 1)
        errors.append(((rgb - view.rgb) ** 2)[view.shown].ravel())
    if not errors:
        return math.nan
    return -10 * math.log10(max(float(np.concatenate(errors).mean()), 1e-9))


@dataclass(frozen=True, slots=True, eq=False)
class _Judge:
    """True pictures of an object from views kept aside and from unseen sides; how it is refined."""

    views: tuple[Sequence[TrueView], Sequence[TrueView]]
    colours: FloatArray
    renderer: NativeRenderer
    options: RefineOptions
    stopwatch: Callable[[], float]

    def both_db(self, model: ObjectModel) -> tuple[float, float]:
        """Of views kept aside, and of unseen sides."""
        aside, unseen = (quality_db(model, views, colours=self.colours) for views in self.views)
        return aside, unseen


def _score(case: Case, way: str, *, judge: _Judge) -> RefineScore:
    who = (case.capture.folder.name, case.object_id, case.family, way)
    try:
        cut = _cut(case, way, renderer=judge.renderer)
        before = judge.both_db(cut.item)
        began = judge.stopwatch()
        done = refine_object(
            cut.package,
            OBJECT_ID,
            views=case.capture.photos,
            options=judge.options,
            rng=np.random.default_rng(0),
        )
        seconds = judge.stopwatch() - began
    except ValueError as reason:
        return RefineScore(*who, refused=str(reason))
    aside, unseen = judge.both_db(done.package.object_by_id(OBJECT_ID))
    photos, splats = done.refined.photos, len(done.refined.splats)
    return RefineScore(*who, photos, splats, seconds, aside, unseen, *before)


def _cut(case: Case, way: str, *, renderer: NativeRenderer) -> Cutout:
    package = case.capture.package
    if way == BY_BOXES:
        return cut_marked(
            package,
            case.views[BY_BOXES],
            object_id=OBJECT_ID,
            name=OBJECT_ID,
            kind="",
            renderer=renderer,
        )
    labels = case.truth.labels
    found = Separation(labels, np.zeros_like(labels), np.zeros_like(labels), ())
    return make_object(
        package, found, object_id=OBJECT_ID, name=OBJECT_ID, kind="", renderer=renderer
    )


def _figures(name: str, scores: Sequence[RefineScore], *, are_judged: bool) -> list[Row]:
    done = [score for score in scores if not score.refused]
    if not scores:
        return []
    seconds = float(np.percentile([s.seconds for s in done], 95)) if done else math.nan

    def bar(value: float) -> float | None:
        return value if are_judged else None

    return [
        at_most(f"{name}.seconds.p95", seconds, "s", bar=bar(SECONDS_BAR)),
        at_least(f"{name}.aside_db", _mean(s.aside_db for s in done), "dB", bar=bar(ASIDE_BAR_DB)),
        at_least(
            f"{name}.unseen_side_db",
            _mean(s.unseen_db for s in done),
            "dB",
            bar=bar(UNSEEN_BAR_DB),
        ),
        Row(f"{name}.before.aside_db", _mean(s.aside_before_db for s in done), "dB"),
        Row(f"{name}.before.unseen_side_db", _mean(s.unseen_before_db for s in done), "dB"),
        Row(f"{name}.objects", float(len(scores)), ""),
        Row(f"{name}.refused", float(len(scores) - len(done)), ""),
    ]


def _mean(values: Iterable[float]) -> float:
    finite = [value for value in values if math.isfinite(value)]
    return float(np.mean(finite)) if finite else math.nan
