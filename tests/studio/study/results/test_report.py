"""Tables, codebook and report of a study whose data are known."""

import csv
import math

import numpy as np
import pytest

from studio.study.folder import Answers
from studio.study.printing import forms_page, order_rows, write_forms
from studio.study.results import paper
from studio.study.results.report import measure_title, study_report, words_of
from studio.study.results.statistics import compared
from studio.study.results.tables import KEYS, MEASURES, Tables, codebook, columns_of, write_tables


@pytest.fixture
def filled(folder):
    """Tables of a study in which everybody is 5 s slower where the room is late."""
    rng = np.random.default_rng(0)
    trials, scores = [], []
    for trial in folder.trials:
        slow = 5.0 * (trial.condition == "late")
        keys = {"trial": trial.name, "participant": trial.participant, "number": str(trial.number),
                "condition": trial.condition, "task": trial.task}  # fmt: skip
        trials.append(
            {**keys, "ended_by": "reached", "rehearsed": "0",
             "duration_s": f"{30 + slow + rng.normal(0, 1):.3f}", "corrections": "1"}
        )  # fmt: skip
        if trial.ends_condition:
            scores.append({**keys, "score": "sus", "value": f"{90 - slow:.1f}"})
        if trial.is_last:
            answers = {f"PQ{k}": "4" for k in range(1, 7)}
            folder.keep_answers(
                Answers(trial.participant, trial.name, "paper-presence", "paper", answers)
            )
            said = {f"FQ{k}": "" for k in range(1, 7)} | {"FQ5": "<b>fine</b>"}
            folder.keep_answers(
                Answers(trial.participant, trial.name, "paper-feedback", "page", said)
            )
    answers = [
        {"participant": a.participant, "trial": a.trial, "questionnaire": a.questionnaire,
         "item": item, "value": value, "how": a.how}
        for a in folder.answers() for item, value in a.answers.items()
    ]  # fmt: skip
    return Tables(trials, [], answers, scores)


def test_the_report_compares_conditions_and_shows_the_paper(folder, filled):
    page = study_report(folder, filled)
    assert "live / late: Wilcoxon signed ranks, n = 4, p = 0.125" in page
    assert "r = 1.00" in page
    assert "85 in the paper (n = 9)" in page
    assert "PQ2 paper (n = 9)" in page
    assert "&lt;b&gt;fine&lt;/b&gt;" in page
    assert "simulated people. They say" not in page
    assert page.count("<svg") == 2 * 2 + 1 + 1


def test_tables_are_written_with_a_codebook_of_every_column(folder, filled):
    files = {file.stem: file for file in write_tables(folder, filled)}
    with files["trials"].open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(folder.trials)
    with files["codebook"].open() as file:
        book = {(row["table"], row["column"]): row for row in csv.DictReader(file)}
    for table in ("trials", "answers", "scores"):
        with files[table].open() as file:
            for column in csv.DictReader(file).fieldnames or ():
                assert book[table, column]["meaning"]
    assert book["trials", "duration_s"]["unit"] == "s"
    with pytest.raises(KeyError):
        codebook({"trials": ["unheard_of"]})
    assert columns_of([{"a": "1"}, {"b": "2"}]) == ("a", "b")
    assert not KEYS.keys() & MEASURES.keys()


def test_an_empty_study_has_a_report(folder):
    page = study_report(folder, Tables((), (), (), ()))
    assert "nobody has done it yet" in page
    assert "0 of 4 participants" in page


def test_a_test_is_said_as_a_paper_prints_it():
    values = {
        "a": {f"P{k}": float(k) for k in range(8)},
        "b": {f"P{k}": k + 2.0 + k * 0.1 for k in range(8)},
    }
    words = words_of(compared("x", values)[0])
    assert "n = 8, p = 0.008" in words
    assert "median difference 2.35 [" in words
    assert measure_title("head_turn_deg") == "head turn"
    assert measure_title("shown_ms_p95") == "shown, percentile 95"


def test_the_papers_presence_answers_give_the_means_that_it_prints():
    means = {k: (np.mean(v), np.std(v, ddof=1)) for k, v in paper.PRESENCE.items()}
    assert [round(x, 2) for x in means["PQ2"]] == [4.78, 0.44]
    assert [round(x, 2) for x in means["PQ3"]] == [4.44, 0.73]
    assert {len(v) for v in paper.PRESENCE.values()} == {paper.PARTICIPANTS}
    assert not math.isnan(paper.SUS_SCORE)


def test_forms_are_printed_for_everybody(folder):
    first = folder.trials[0].participant
    page = forms_page(folder, first)
    assert page.count("<section>") == 2 + 1 + 4 + 2 + 1 + 1
    assert "You take part of your own will." in page
    assert page.count('class="scale"') == 4 * 6
    assert len(write_forms(folder)) == 4
    rows = order_rows(folder)
    assert [row["trial"] for row in rows[:2]] == [f"{first}-1", f"{first}-2"]
