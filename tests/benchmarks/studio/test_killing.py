"""What a kill costs: how it is counted, and one real kill."""

from pathlib import Path

import pytest

from benchmarks.studio.killing import Made, digest_of, kill_rows, lost_s
from studio.app.model.documents.autosave import Recovered
from studio.app.model.documents.document import Document
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
DOCUMENTS = [Document("lab", seed=number) for number in range(4)]
MADE = [Made(100.0 + n, "first", digest_of(document)) for n, document in enumerate(DOCUMENTS)]


def recovered(document, *, project="first", t_s=0.0):
    return Recovered(document, Path("autosave.nexus"), Path(f"{project}.nexus"), t_s)


def test_what_is_offered_costs_the_edits_after_it():
    assert lost_s(MADE, [recovered(DOCUMENTS[3])], DOCUMENTS[0]) == 0.0
    assert lost_s(MADE, [recovered(DOCUMENTS[1])], DOCUMENTS[0]) == pytest.approx(1.0)


def test_without_an_offer_the_project_s_own_file_counts():
    assert lost_s(MADE, [], DOCUMENTS[3]) == 0.0
    assert lost_s(MADE, [], DOCUMENTS[0]) == pytest.approx(2.0)


def test_other_work_is_wrong_whatever_it_holds():
    assert lost_s(MADE, [recovered(DOCUMENTS[3], project="second")], DOCUMENTS[3]) is None
    assert lost_s(MADE, [recovered(Document("desk"), t_s=99.0)], DOCUMENTS[3]) is None


def test_an_edit_that_was_kept_before_it_was_told_is_not_wrong():
    assert lost_s(MADE, [recovered(Document("lab", seed=9), t_s=103.5)], DOCUMENTS[0]) == 0.0


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_a_killed_window_loses_less_than_two_seconds_of_every_kind_of_edit():
    lost, wrong = kill_rows(1, seed=2)
    assert (lost.name, wrong.name) == ("studio.kill9.lost_s.max", "studio.kill9.wrong")
    assert 0.0 <= lost.value <= 2.0
    assert wrong.value == 0
