"""Tidy tables of a study, and the codebook that says what every column means."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from scenes.formats.storage.atomic import write_file
from scenes.state import ObjectModel
from studio.study.folder import RECORDING, Answers, Ended, StudyFolder
from studio.study.results.measures import Measure, measured
from studio.study.results.scoring import Direction, scores

TABLES = "tables"
"""Folder of the tables in a study's folder."""


@dataclass(frozen=True, slots=True)
class Column:
    """Meaning of a column, or of a measure.

    Attributes:
        unit: of it; empty of names and counts.
        meaning: in a sentence.
        better: which values are.
    """

    unit: str
    meaning: str
    better: Direction = "none"


MEASURES: Mapping[str, Column] = {
    "duration_s": Column("s", "from the begin of the task to its end", "lower"),
    "completed": Column("0/1", "whether its goal was reached, or said to be", "higher"),
    "moves": Column("", "how often objects came to rest elsewhere than before (5 cm or 10°)"),
    "corrections": Column("", "moves beyond the first one of each object", "lower"),
    "lines": Column("", "lines that the participant drew"),
    "shapes": Column("", "shapes that the participant put"),
    "proposals": Column("", "places that the participant proposed for objects"),
    "taken_back": Column("", "lines, shapes and proposals that they took away again"),
    "head_path_m": Column("m", "length of the way of the participant's head"),
    "head_turn_deg": Column("deg", "by how much their view turned, summed up"),
    "pointings": Column("", "how often they began to point"),
    "pointing_share": Column("0..1", "part of the time in which they pointed"),
    "gaze_on_objects_share": Column("0..1", "part of the time in which an object was in view"),
    "pointing_at_objects_share": Column("0..1", "part of the time in which they pointed at one"),
    "off_cm": Column("cm", "mean distance of objects from the goal at the end", "lower"),
    "off_deg": Column("deg", "mean turn of objects from the goal at the end", "lower"),
    "there": Column("", "objects within the goal's tolerance at the end", "higher"),
    "camera_ms_p50": Column("ms", "from a picture's capture to its arrival, median", "lower"),
    "camera_ms_p95": Column("ms", "the same, 95th percentile", "lower"),
    "shown_ms_p50": Column("ms", "from a picture's capture to its poses, median", "lower"),
    "shown_ms_p95": Column("ms", "the same, 95th percentile", "lower"),
    "ping_ms": Column("ms", "the participant's round trip to the studio at the end", "lower"),
    "object_moves": Column("", "how often this object was moved"),
    "object_sure_share": Column(
        "0..1", "part of the pictures in which its pose was sure", "higher"
    ),
    "object_gaze_share": Column("0..1", "part of the time in which it was looked at"),
    "object_pointing_share": Column("0..1", "part of the time in which it was pointed at"),
    "object_off_cm": Column("cm", "its distance from its target at the end", "lower"),
    "object_off_deg": Column("deg", "its turn from its target at the end", "lower"),
}
"""Measures of a trial, and of each object in it."""

KEYS: Mapping[str, Column] = {
    "trial": Column("", "name of the trial: participant and number; empty before the first"),
    "participant": Column("", "anonymous id"),
    "number": Column("", "of the participant's trials, from 1"),
    "condition": Column("", "id of the condition, see study.toml"),
    "task": Column("", "id of the task, see study.toml"),
    "ended_by": Column("", "reached (by its goal), said (by the participant), limit or stopped"),
    "rehearsed": Column("0/1", "whether simulated people did it: no data of a study"),
    "object": Column("", "id of an object of the scene"),
    "questionnaire": Column("", "name of the questionnaire"),
    "item": Column("", "name of the item, see the questionnaire"),
    "value": Column("", "the answer as it was given, or the score"),
    "how": Column("", "page (in the browser), paper, or simulated: no data of a study"),
    "score": Column("", "name of the score; sus 0..100, tlx 0..100, presence means of its items"),
}
"""Columns that say of what a row is."""

Rows = Sequence[Mapping[str, str]]
"""Rows of a table: texts by column."""


@dataclass(frozen=True, slots=True)
class Tables:
    """Tables of a study.

    Attributes:
        trials: a row a trial, a column a measure.
        objects: a row an object of a trial.
        answers: a row an answer.
        scores: a row a score.
    """

    trials: Rows
    objects: Rows
    answers: Rows
    scores: Rows


def tables_of(folder: StudyFolder, models: Mapping[str, Sequence[ObjectModel]]) -> Tables:
    """Return the tables of everything that a study has gathered.

    Args:
        folder: of the study.
        models: objects by the name of their scene.

    Raises:
        ScenarioError, RecordingError: a file is damaged.
        OSError: one cannot be read.
    """
    trials: list[Mapping[str, str]] = []
    objects: list[Mapping[str, str]] = []
    for ended in folder.ended():
        task = folder.study.task(ended.task)
        recording = folder.folder_of(folder.trial(ended.name)) / RECORDING
        found = measured(recording, ended, goal=task.goal, models=models[task.scene])
        keys = _keys(ended)
        whole = {each.name: _number(each.value) for each in found if not each.object_id}
        trials.append(
            {**keys, "ended_by": ended.ended_by, "rehearsed": str(int(ended.is_rehearsed)), **whole}
        )
        objects += _object_rows(keys, found)
    answers = folder.answers()
    return Tables(trials, objects, _answer_rows(folder, answers), _score_rows(folder, answers))


def write_tables(folder: StudyFolder, tables: Tables) -> tuple[Path, ...]:
    """Write the tables as CSV, with their codebook; return the files.

    Raises:
        OSError: the folder cannot be written into.
    """
    target = folder.path / TABLES
    target.mkdir(exist_ok=True)
    named = {
        "trials": tables.trials,
        "objects": tables.objects,
        "answers": tables.answers,
        "scores": tables.scores,
    }
    named["codebook"] = codebook({name: columns_of(rows) for name, rows in named.items()})
    written: list[Path] = []
    for name, rows in named.items():
        file = target / f"{name}.csv"
        write_file(file, [as_csv(rows).encode()])
        written.append(file)
    return tuple(written)


def codebook(columns: Mapping[str, Sequence[str]]) -> Rows:
    """Return what every column of every table means.

    Raises:
        KeyError: nobody has said what a column means.
    """
    known = {**KEYS, **MEASURES}
    return [
        {
            "table": table,
            "column": column,
            "unit": known[column].unit,
            "better": known[column].better,
            "meaning": known[column].meaning,
        }
        for table, names in columns.items()
        for column in names
    ]


def columns_of(rows: Rows) -> tuple[str, ...]:
    """Return the columns of rows, in the order in which they first come."""
    return tuple(dict.fromkeys(name for row in rows for name in row))


def as_csv(rows: Rows) -> str:
    """Return rows as CSV, with a head; what a row does not have is empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns_of(rows), restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _object_rows(keys: Mapping[str, str], found: Iterable[Measure]) -> list[Mapping[str, str]]:
    rows: dict[str, dict[str, str]] = {}
    for each in found:
        if each.object_id:
            row = rows.setdefault(each.object_id, {**keys, "object": each.object_id})
            row[each.name] = _number(each.value)
    return list(rows.values())


def _answer_rows(folder: StudyFolder, answers: Iterable[Answers]) -> list[Mapping[str, str]]:
    return [
        {
            **_keys_of(folder, given),
            "questionnaire": given.questionnaire,
            "item": item,
            "value": value,
            "how": given.how,
        }
        for given in answers
        for item, value in given.answers.items()
    ]


def _score_rows(folder: StudyFolder, answers: Iterable[Answers]) -> list[Mapping[str, str]]:
    return [
        {**_keys_of(folder, given), "score": name, "value": _number(value)}
        for given in answers
        for name, value in scores(
            folder.study.questionnaire(given.questionnaire), given.answers
        ).items()
    ]


def _keys(ended: Ended) -> dict[str, str]:
    return {
        "trial": ended.name,
        "participant": ended.participant,
        "number": str(ended.number),
        "condition": ended.condition,
        "task": ended.task,
    }


def _keys_of(folder: StudyFolder, given: Answers) -> dict[str, str]:
    if not given.trial:
        return {
            "trial": "",
            "participant": given.participant,
            "number": "",
            "condition": "",
            "task": "",
        }
    trial = folder.trial(given.trial)
    return {
        "trial": trial.name,
        "participant": trial.participant,
        "number": str(trial.number),
        "condition": trial.condition,
        "task": trial.task,
    }


def _number(value: float) -> str:
    return f"{value:.6g}"
