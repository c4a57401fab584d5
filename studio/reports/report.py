"""The report a person opens: one self-contained page that says how the rehearsal went."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scenes.state import ObjectModel
from studio.console.machine import describe_machine
from studio.console.rows import Row
from studio.console.spoken import Called, spoken, with_names
from studio.evaluate import figures
from studio.evaluate.metrics import PAPER_ROOM, PAPER_TABLE
from studio.evaluate.scores import ROOM_BAR_CM, ROOM_BAR_DEG, VISIBLE_FRACTION, Score, ScoreBoard
from studio.reports.film import Picture
from studio.reports.floor_picture import floor_picture
from studio.reports.page import embedded_jpeg, page
from studio.reports.seen_sides import seen_words
from studio.session.session import Session, SessionResult

METHOD_NAMES = {"own": "this tracker", "paper": "the paper's method"}


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """Contents of the page.

    Attributes:
        verb: what was run.
        session: scene, scenario, versions.
        boards: scores by method, the shown one first.
        events: (t_ns, text) of what happened.
        result: frames, drops and durations.
        rows: all figures.
        stills: (seconds, picture) of the film.
    """

    verb: str
    session: Session
    boards: Mapping[str, ScoreBoard]
    events: tuple[tuple[int, str], ...]
    result: SessionResult
    rows: list[Row]
    stills: list[tuple[float, Picture]]


@dataclass(frozen=True, slots=True)
class Verdict:
    """How it went, at a glance: "pass", "fail" or "none" (nothing to judge), and in words."""

    mark: str
    headline: str
    detail: str


def render_report(report: Report) -> str:
    """The page as HTML."""
    shown = next(iter(report.boards.values()))
    moved = bool(shown.moved())
    scene = report.session.scene
    return page("report.html.j2").render(
        report=report,
        info=report.session.info,
        verdict=verdict(report),
        cards=_cards(report),
        comparison=_comparison(report),
        objects=_objects(report),
        latencies=report.result.latencies.stages(),
        plan=figures.floor_plan(scene, shown, scene.world_from_rig, floor_picture(scene)),
        errors=figures.errors_over_time(report.boards, mark_s=_fork_s(report)) if moved else "",
        visibility=figures.visibility(shown) if moved else "",
        stills=[(f"{t:.1f} s", embedded_jpeg(picture)) for t, picture in report.stills],
        machine=describe_machine(),
        events=[
            (t_ns, with_names(text, [o.object_id for o in scene.objects], _called(report)))
            for t_ns, text in report.events
        ],
        visible_percent=round(100 * VISIBLE_FRACTION),
        method_names=METHOD_NAMES,
    )


def verdict(report: Report) -> Verdict:
    """Whether every figure with a bar met it, in one line; and whether it was cut short."""
    found = _verdict(report)
    if report.result.cut_short is None:
        return found
    words = report.result.cut_short.text
    return Verdict(found.mark, f"Cut short: {words}", f"{found.headline}. {found.detail}")


def _verdict(report: Report) -> Verdict:
    barred = [row for row in report.rows if row.passed is not None]
    missed = [row for row in barred if row.passed is False]
    board = next(iter(report.boards.values()))
    every = board.score()
    seconds = _seconds(board)
    frames = f"{report.result.frames} frames, {seconds:.0f} s"
    if every is None:
        return Verdict(
            "none", "Nothing moved", f"{frames}: there was nothing to track, so nothing is scored."
        )
    count = len(board.moved())
    noun = "object" if count == 1 else "objects"
    detail = (
        f"{count} moved {noun} followed within {every.world_cm.mean:.1f} cm on average "
        f"over {frames}, hidden spans included{_worst(board)}."
    )
    if missed:
        names = "; ".join(_plain_name(row, _called(report)) for row in missed)
        one = len(missed) == 1
        headline = (
            "One figure misses its limit" if one else f"{len(missed)} figures miss their limits"
        )
        return Verdict("fail", headline, f"{detail} Missed: {names}.")
    return Verdict("pass", "The rehearsal went well", detail)


def _called(report: Report) -> Called:
    """Names of the scene's objects."""
    names = {item.object_id: item.name for item in report.session.scene.objects}
    return lambda object_id: names.get(object_id) or object_id


def _fork_s(report: Report) -> float | None:
    fork = report.session.info.fork
    return None if fork is None else fork.t_ns / 1e9


def _worst(board: ScoreBoard) -> str:
    """The object that was followed worst, where there are several."""
    means = {m.name: score.world_cm.mean for m, score in _moved_scores(board)}
    if len(means) < 2:
        return ""
    name = max(means, key=lambda key: means[key])
    return f"; worst is {name} with {means[name]:.1f} cm"


def _moved_scores(board: ScoreBoard) -> list[tuple[ObjectModel, Score]]:
    scores = [(model, board.object_score(model.object_id)) for model in board.moved()]
    return [(model, score) for model, score in scores if score is not None]


def _plain_name(row: Row, called: Called) -> str:
    value = "not measured" if row.value is None else f"{row.value:.1f} {row.unit}".strip()
    return f"{spoken(row.name, called)} {value} (limit {row.bar:g})"


def _seconds(board: ScoreBoard) -> float:
    times = [s.t_ns for o in board.object_ids() for s in board.samples(o)[-1:]]
    return max(times, default=0) / 1e9


def _cards(report: Report) -> list[dict[str, Any]]:
    """The key figures, each with the paper's published one and its method's on the same frames."""
    board, *others = report.boards.values()
    other = others[0] if others else None
    chairs, every = board.score(kind="chair"), board.score()
    cards: list[dict[str, Any]] = []
    if chairs is not None:
        cards.append(
            _card("Chairs, position", chairs, other and other.score(kind="chair"), yaw=False)
        )
        if chairs.yaw_deg is not None:
            cards.append(
                _card("Chairs, yaw", chairs, other and other.score(kind="chair"), yaw=True)
            )
    if every is not None:
        cards.append(
            _card("All moved objects, position", every, other and other.score(), yaw=False)
        )
    dropped = report.result.dropped
    cards.append(
        {
            "title": "Dropped frames",
            "value": str(dropped),
            "unit": f"of {dropped + report.result.frames}",
            "spread": "",
            "passed": dropped == 0,
            "bar": "limit 0",
            "notes": [],
        }
    )
    return cards


def _card(title: str, score: Score, other: Score | None, *, yaw: bool) -> dict[str, Any]:
    spread = score.yaw_deg if yaw else score.world_cm
    bar, unit = (ROOM_BAR_DEG, "°") if yaw else (ROOM_BAR_CM, "cm")
    published = PAPER_ROOM["yaw_deg" if yaw else "world_cm"]
    assert spread is not None
    notes = [f"paper, published: {published[0]:.1f} ± {published[1]:.1f} {unit}"]
    same = None if other is None else (other.yaw_deg if yaw else other.world_cm)
    if same is not None:
        notes.append(f"its method on these frames: {same.mean:.1f} ± {same.std:.1f} {unit}")
    return {
        "title": title,
        "value": f"{spread.mean:.1f}",
        "unit": unit,
        "spread": f"± {spread.std:.1f}",
        "passed": spread.mean <= bar,
        "bar": f"limit {bar:g} {unit}",
        "notes": notes,
    }


def _comparison(report: Report) -> list[dict[str, str]]:
    """Methods against each other and the paper's tables."""
    rows: list[dict[str, str]] = []
    for name, board in report.boards.items():
        label = METHOD_NAMES.get(name, name)
        for what, score in (
            ("chairs", board.score(kind="chair")),
            ("all moved objects", board.score()),
            (f"all, while at least {VISIBLE_FRACTION:.0%} visible", board.score(hidden=False)),
            ("all, while hidden", board.score(hidden=True)),
        ):
            if score is not None:
                rows.append(_score_cells(f"{label}, {what}", score))
    for label, table in (
        ("paper, table 1 (published): chair, room", PAPER_ROOM),
        ("paper, table 2 (published): book, table", PAPER_TABLE),
    ):
        (cm, cm_std), (deg, deg_std) = table["world_cm"], table["yaw_deg"]
        rows.append(
            {
                "label": label,
                "world": f"{cm:.1f} ± {cm_std:.1f}",
                "world_p95": "",
                "yaw": f"{deg:.1f} ± {deg_std:.1f}",
                "yaw_p95": "",
                "count": "6 positions",
            }
        )
    return rows


def _objects(report: Report) -> list[dict[str, Any]]:
    """Errors object by object, of every method."""
    out = []
    shown = next(iter(report.boards.values()))
    for model in shown.moved():
        lines = []
        for name, board in report.boards.items():
            whole = board.object_score(model.object_id)
            if whole is None:
                continue
            seen = board.object_score(model.object_id, hidden=False)
            hidden = board.object_score(model.object_id, hidden=True)
            lines.append(
                {
                    **_score_cells(METHOD_NAMES.get(name, name), whole),
                    "seen": f"{seen.world_cm.mean:.1f}" if seen else "–",
                    "hidden": f"{hidden.world_cm.mean:.1f}" if hidden else "never",
                }
            )
        seen = "" if model.coverage is None else seen_words(model)
        out.append({"name": model.name, "lines": lines, "seen": seen})
    return out


def _score_cells(label: str, score: Score) -> dict[str, str]:
    world, yaw = score.world_cm, score.yaw_deg
    return {
        "label": label,
        "world": f"{world.mean:.1f} ± {world.std:.1f}",
        "world_p95": f"{world.p95:.1f}",
        "yaw": f"{yaw.mean:.1f} ± {yaw.std:.1f}" if yaw else "round",
        "yaw_p95": f"{yaw.p95:.1f}" if yaw else "",
        "count": f"{world.count}",
    }
