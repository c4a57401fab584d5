"""Figures of many cuts, with their bars, and tables that say where cuts fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.evaluate.cuts.cases import BY_TRUTH, MADE, PROPOSED
from benchmarks.evaluate.cuts.marking import WAYS
from benchmarks.evaluate.cuts.scores import CutScore
from studio.console.rows import Row, at_least, at_most

USUAL = "two_boxes"
"""The way of marking that the bars are for, but for the click's."""

GOOD_IOU = 0.9
"""An object cut so is fit for use: of a chair, a leg may be missing and no more."""

SPOILT = 0.05
"""Share of an object missing, or foreign, from which on the cut spoils what is made of it."""

BARS: Mapping[str, float] = {
    "iou.mean": 0.95,
    "iou.ge_90_percent": 95.0,
    "missing_percent": 2.0,
    "foreign_percent": 2.0,
    "box_cm.p95": 2.0,
    "seconds.p95": 8.0,
}
"""Bars of two boxes in an unknown room."""

NO_BARS: Mapping[str, float] = {}
"""Other ways of marking are only reported."""

CLICK_IOU_BAR = 0.92
"""Mean overlap that one click must give."""

WORST = 10
"""Objects that are listed by name."""


def cut_rows(scores: Sequence[CutScore]) -> list[Row]:
    """The figures of all cuts, the usual way of marking first."""
    rows = _figures("cuts", _of(scores, USUAL), bars=BARS)
    clicked = _of(scores, "click")
    if clicked:
        mean = float(np.mean([score.iou for score in clicked]))
        rows.append(at_least("cuts.click_iou.mean", mean, "", bar=CLICK_IOU_BAR))
    for way in ("click", "one_box", "three_boxes", PROPOSED, MADE, BY_TRUTH):
        rows += _figures(f"cuts.{way}", _of(scores, way))
    for family in sorted({score.family for score in scores}):
        own = [score for score in _of(scores, USUAL) if score.family == family]
        if own:
            mean = float(np.mean([score.iou for score in own]))
            rows.append(Row(f"cuts.family.{family}.iou.mean", mean, ""))
    return rows


def breakdown(scores: Sequence[CutScore]) -> list[str]:
    """Tables for people: by family, and the worst objects with what is wrong with them."""
    usual = _of(scores, USUAL)
    if not usual:
        return []
    return [_by_family(scores), _worst(usual)]


def _figures(
    name: str, scores: Sequence[CutScore], *, bars: Mapping[str, float] = NO_BARS
) -> list[Row]:
    """Rows of one way of marking; none without a score."""
    if not scores:
        return []
    iou = np.array([score.iou for score in scores])
    box_cm = np.array([score.box_cm for score in scores])
    box_cm = box_cm[np.isfinite(box_cm)]
    seconds = np.array([score.seconds for score in scores])
    percent = {
        "missing_percent": _percent([score.missing > SPOILT for score in scores]),
        "foreign_percent": _percent([score.foreign > SPOILT for score in scores]),
        "taken_percent": _percent([score.taken > SPOILT for score in scores]),
    }
    rows = [
        at_least(f"{name}.iou.mean", float(iou.mean()), "", bar=bars.get("iou.mean")),
        at_least(
            f"{name}.iou.ge_90_percent",
            _percent(iou >= GOOD_IOU),
            "%",
            bar=bars.get("iou.ge_90_percent"),
        ),
    ]
    by_mesh = float(np.mean([score.iou_by_mesh for score in scores]))
    rows.append(Row(f"{name}.iou_by_mesh.mean", by_mesh, ""))
    outline = [score.outline for score in scores if np.isfinite(score.outline)]
    if outline:
        rows.append(Row(f"{name}.outline.mean", float(np.mean(outline)), ""))
    rows += [at_most(f"{name}.{k}", value, "%", bar=bars.get(k)) for k, value in percent.items()]
    if len(box_cm):
        p95 = float(np.percentile(box_cm, 95))
        rows.append(at_most(f"{name}.box_cm.p95", p95, "cm", bar=bars.get("box_cm.p95")))
    left = 100.0 * float(np.mean([score.left for score in scores]))
    rows += [
        Row(f"{name}.left_percent.mean", left, "%"),
        at_most(
            f"{name}.seconds.p95",
            float(np.percentile(seconds, 95)),
            "s",
            bar=bars.get("seconds.p95"),
        ),
        Row(f"{name}.refused", float(sum(bool(score.refused) for score in scores)), ""),
        Row(f"{name}.objects", float(len(scores)), ""),
        Row(f"{name}.photos.mean", float(np.mean([score.photos for score in scores])), ""),
    ]
    return rows


def _by_family(scores: Sequence[CutScore]) -> str:
    """Mean overlap by family and way, and how many are spoilt with the usual marks."""
    ways = [way for way in (*WAYS, PROPOSED, MADE) if _of(scores, way)]
    families = sorted({score.family for score in scores})
    lines = [f"{'family':<14}{'n':>3}" + "".join(f"{way:>17}" for way in ways)]
    lines[0] += f"{'missing':>9}{'foreign':>9}{'box cm':>8}"
    for family in families:
        own = [score for score in scores if score.family == family]
        usual = _of(own, USUAL)
        means = [_mean([score.iou for score in _of(own, way)]) for way in ways]
        line = f"{family:<14}{len(usual):>3}" + "".join(f"{mean:>17}" for mean in means)
        line += f"{sum(s.missing > SPOILT for s in usual):>9}"
        line += f"{sum(s.foreign > SPOILT for s in usual):>9}"
        lines.append(line + f"{_mean([s.box_cm for s in usual]):>8}")
    return "\n".join(lines)


def _worst(scores: Sequence[CutScore]) -> str:
    """The objects with the least overlap, and what is wrong with each."""
    lines = ["worst, with two boxes:"]
    for score in sorted(scores, key=lambda score: score.iou)[:WORST]:
        where = f"{score.room} {score.object_id}"
        wrong = score.refused or (
            f"missing {100 * score.missing:.0f} %, foreign {100 * score.foreign:.0f} %, "
            f"something else's {100 * score.taken:.0f} %, left {100 * score.left:.0f} %, "
            f"box {score.box_cm:.1f} cm"
        )
        lines.append(f"  {where:<30} {score.iou:.3f}  {wrong}")
    return "\n".join(lines)


def _of(scores: Sequence[CutScore], way: str) -> list[CutScore]:
    return [score for score in scores if score.way == way]


def _percent(true: Sequence[bool] | np.ndarray) -> float:
    return 100.0 * float(np.mean(true))


def _mean(values: Sequence[float]) -> str:
    return f"{np.mean(values):.3f}" if len(values) else "-"
