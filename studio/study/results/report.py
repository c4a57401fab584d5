"""The report of a study: measures and answers, tested, with the paper's figures beside."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from scenes.formats.storage.atomic import write_file
from studio.reports.page import page
from studio.study.folder import StudyFolder
from studio.study.results import paper
from studio.study.results.plots import answers_plot, condition_plot
from studio.study.results.scoring import BETTER
from studio.study.results.statistics import CONFIDENCE, Compared, compared, described, with_holm
from studio.study.results.tables import MEASURES, Tables

REPORT = "report.html"
"""Name of the page in a study's folder."""

HEADLINES = ("duration_s", "corrections", "off_cm", "gaze_on_objects_share", "pointing_share")
"""Measures that are drawn, chosen: what a reader asks first."""

TESTED = (*HEADLINES, "moves", "lines", "proposals", "taken_back", "head_path_m", "shown_ms_p95")
"""Measures that are tested, one family for Holm's correction: chosen before there are data."""

PAPER_SCORES = {"sus": paper.SUS_SCORE}
"""Published scores by name."""

SCORE_NAMES = {
    "sus": "System Usability Scale (0..100)",
    "paper-presence.mean": "Presence, the paper's items (1..5)",
    "presence.mean": "Presence, mean of six items (1..7)",
    "presence.high": "Presence, items of 6 or 7 (0..6)",
    "tlx.raw": "NASA-TLX, raw (0..100)",
    "tlx-weighed.raw": "NASA-TLX, raw (0..100)",
    "tlx-weighed.weighed": "NASA-TLX, weighed (0..100)",
}
"""Scores in words."""

Values = dict[str, dict[str, float]]
"""Values by condition, by participant."""


@dataclass(frozen=True, slots=True)
class Section:
    """A measure or score in the report.

    Attributes:
        name: in words.
        meaning: in a sentence; empty where the name says it.
        rows: texts of each condition: name, n, mean, sd, median, interval.
        tests: texts of each test.
        plot: as SVG; empty where it is not drawn.
        published: the paper's figure, in words; empty where it has none.
        better: which values are.
    """

    name: str
    meaning: str
    rows: Sequence[tuple[str, ...]]
    tests: Sequence[str]
    plot: str
    published: str
    better: str


def write_study_report(folder: StudyFolder, tables: Tables) -> Path:
    """Write the page into the study's folder; return it.

    Raises:
        OSError: the folder cannot be written into.
    """
    file = folder.path / REPORT
    write_file(file, [study_report(folder, tables).encode()])
    return file


def study_report(folder: StudyFolder, tables: Tables) -> str:
    """Return the report as HTML."""
    study = folder.study
    people = sorted({row["participant"] for row in tables.trials})
    return page("study-report.html.j2").render(
        study=study,
        people=people,
        planned=len(folder.trials),
        trials=tables.trials,
        rehearsed=sum(row["rehearsed"] == "1" for row in tables.trials),
        tasks=[
            (task, measure_sections(folder, tables, task_id=task.task_id, names=TESTED))
            for task in study.tasks
        ],
        scores=score_sections(folder, tables),
        presence=presence_plot(folder, tables),
        words=written_answers(folder, tables),
        confidence=round(100 * CONFIDENCE),
        paper=paper,
    )


def measure_sections(
    folder: StudyFolder, tables: Tables, *, task_id: str, names: Iterable[str]
) -> list[Section]:
    """Return measures of a task by condition, tested as one family."""
    found: dict[str, Values] = {}
    for name in names:
        values = _by_condition(
            folder, (row for row in tables.trials if row["task"] == task_id), name=name
        )
        if any(values.values()):
            found[name] = values
    tests = _family(found, seed=folder.study.seed)
    return [
        _section(
            measure_title(name),
            values,
            tests=tests[name],
            meaning=f"{MEASURES[name].meaning}"
            + (f" ({MEASURES[name].unit})" if MEASURES[name].unit else ""),
            unit=MEASURES[name].unit,
            better=MEASURES[name].better,
            is_drawn=name in HEADLINES,
        )
        for name, values in found.items()
    ]


def measure_title(name: str) -> str:
    """Return a measure's name in words, without its unit."""
    for ending in ("_share", "_s", "_cm", "_deg", "_m"):
        name = name.removesuffix(ending)
    return name.replace("_ms_p", ", percentile ").replace("_", " ")


def score_sections(folder: StudyFolder, tables: Tables) -> list[Section]:
    """Return scores by condition, tested as one family, the paper's beside.

    Of several scores of one person under one condition, one after each task, the mean counts.
    """
    names = dict.fromkeys(row["score"] for row in tables.scores if row["trial"])
    found: dict[str, Values] = {}
    for name in names:
        found[name] = _by_condition(
            folder, (row for row in tables.scores if row["score"] == name), name="value"
        )
    tests = _family(found, seed=folder.study.seed)
    return [
        _section(
            SCORE_NAMES.get(name, name),
            values,
            tests=tests[name],
            meaning="",
            unit="",
            better=BETTER.get(name, "none"),
            is_drawn=name in SCORE_NAMES,
            published=PAPER_SCORES.get(name),
        )
        for name, values in found.items()
    ]


def presence_plot(folder: StudyFolder, tables: Tables) -> str:
    """Return answers to the paper's presence items beside the paper's; empty where nobody gave any.

    Every answer counts, whatever the condition.
    """
    given: dict[str, list[int]] = {item: [] for item in paper.PRESENCE}
    for row in tables.answers:
        if row["questionnaire"] == "paper-presence" and row["value"]:
            given[row["item"]].append(int(row["value"]))
    if not any(given.values()):
        return ""
    rows: list[tuple[str, Sequence[int]]] = []
    for item, published in paper.PRESENCE.items():
        rows.append((f"{item} here (n = {len(given[item])})", given[item]))
        rows.append((f"{item} paper (n = {len(published)})", published))
    return answers_plot("Presence, item by item", rows, points=5)


def written_answers(folder: StudyFolder, tables: Tables) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return questions with what people wrote: participant and words."""
    found: list[tuple[str, list[tuple[str, str]]]] = []
    for asked in folder.study.asked:
        for item in asked.questionnaire.items:
            if item.kind != "text":
                continue
            said = [
                (row["participant"], row["value"])
                for row in tables.answers
                if (row["questionnaire"], row["item"]) == (asked.questionnaire.name, item.name)
                and row["value"]
            ]
            if said:
                found.append((item.text, said))
    return found


def _by_condition(folder: StudyFolder, rows: Iterable[Mapping[str, str]], *, name: str) -> Values:
    """Return means of a column by condition and participant."""
    gathered: dict[str, dict[str, list[float]]] = {
        each.condition_id: {} for each in folder.study.conditions
    }
    for row in rows:
        if row.get(name) and row["condition"] in gathered:
            of_one = gathered[row["condition"]].setdefault(row["participant"], [])
            of_one.append(float(row[name]))
    return {
        condition: {person: sum(v) / len(v) for person, v in people.items()}
        for condition, people in gathered.items()
    }


def _family(found: Mapping[str, Values], *, seed: int) -> dict[str, list[Compared]]:
    """Return tests of each measure; the first of each belongs to one family for Holm."""
    tests = {name: list(compared(name, values, seed=seed)) for name, values in found.items()}
    firsts = with_holm([each[0] for each in tests.values() if each])
    for corrected in firsts:
        tests[corrected.name][0] = corrected
    return tests


def _section(
    name: str,
    values: Values,
    *,
    tests: Sequence[Compared],
    meaning: str,
    unit: str,
    better: str,
    is_drawn: bool,
    published: float | None = None,
) -> Section:
    rows: list[tuple[str, ...]] = []
    for condition, people in values.items():
        if not people:
            continue
        d = described(list(people.values()))
        interval = f"{d.low:.3g} to {d.high:.3g}" if math.isfinite(d.low) else "–"
        rows.append((condition, str(d.n), *(_shown(v) for v in (d.mean, d.sd, d.median)), interval))
    beside = None if published is None else ("the paper", published)
    return Section(
        name,
        meaning,
        rows,
        [words_of(test) for test in tests if test.n > 0],
        condition_plot(name, values, unit=unit or name, published=beside) if is_drawn else "",
        "" if published is None else f"{published:g} in the paper (n = {paper.PARTICIPANTS})",
        better,
    )


def words_of(test: Compared) -> str:
    """Return a test in one sentence, as a paper prints it."""
    who = " / ".join(test.conditions)
    if math.isnan(test.p):
        return f"{who}: nothing to be tested (n = {test.n}, no differences)"
    words = f"{who}: {test.test}, n = {test.n}, p {_p(test.p)}, corrected {_p(test.p_holm)}"
    words += f"; {test.effect_name} = {test.effect:.2f}"
    if math.isfinite(test.effect_low):
        words += f" [{test.effect_low:.2f}, {test.effect_high:.2f}]"
    if math.isfinite(test.difference):
        words += f"; median difference {test.difference:.3g}"
        if math.isfinite(test.low):
            words += f" [{test.low:.3g}, {test.high:.3g}], {100 * test.level:.0f} %"
    if math.isfinite(test.normal_p):
        words += f"; differences: Shapiro-Wilk p {_p(test.normal_p)}"
    return words


def _p(value: float) -> str:
    return "< 0.001" if value < 0.001 else f"= {value:.3f}"


def _shown(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "–"
