"""Forms on paper: consent and questionnaires of a participant, as a page to print."""

from __future__ import annotations

from pathlib import Path

from scenes.formats.storage.atomic import write_file
from studio.reports.page import page
from studio.study.folder import StudyFolder
from studio.study.order import Trial
from studio.study.plan import Asked, When

FORMS = "forms"
"""Folder of the forms in a study's folder."""

MARKS = tuple(range(0, 101, 5))
"""Marks of a NASA-TLX scale."""


def write_forms(folder: StudyFolder) -> tuple[Path, ...]:
    """Write a page to print for every participant; return the files.

    Raises:
        OSError: the folder cannot be written into.
    """
    target = folder.path / FORMS
    target.mkdir(exist_ok=True)
    written: list[Path] = []
    for participant in dict.fromkeys(trial.participant for trial in folder.trials):
        file = target / f"{participant}.html"
        write_file(file, [forms_page(folder, participant).encode()])
        written.append(file)
    return tuple(written)


def forms_page(folder: StudyFolder, participant: str) -> str:
    """Return a participant's forms as HTML, a sheet each, in the order in which they are filled in.

    Raises:
        ScenarioError: there is no such participant.
    """
    study, trials = folder.study, folder.trials_for(participant)
    sheets: list[tuple[str, Asked]] = [
        ("before the first task", asked) for asked in study.asked if asked.when is When.FIRST
    ]
    sheets += [
        (f"after task {trial.number}", asked)
        for trial in trials
        for asked in study.asked
        if trial.asks(asked)
    ]
    return page("study-forms.html.j2").render(
        study=study,
        participant=participant,
        trials=[(trial.number, study.task(trial.task)) for trial in trials],
        sheets=[(where, asked.questionnaire) for where, asked in sheets],
        marks=MARKS,
    )


def order_rows(folder: StudyFolder) -> list[dict[str, str]]:
    """Return who does what in which order, a row a trial, for the experimenter."""
    return [_order_row(trial) for trial in folder.trials]


def _order_row(trial: Trial) -> dict[str, str]:
    return {
        "trial": trial.name,
        "participant": trial.participant,
        "number": str(trial.number),
        "condition": trial.condition,
        "task": trial.task,
    }
