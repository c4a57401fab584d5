"""What is typed, what was last good, and what is rehearsed."""

import pytest

from sim.scenario import load_scenario
from sim.tables import ScenarioError
from studio.app.model.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.app.scenario import text_edits
from studio.app.scenario.editing import ScenarioEditing
from studio.app.scenario.toml_spans import EditError


class Steps(list):
    """A history that only remembers."""

    def push(self, change):
        self.append(change)


@pytest.fixture
def editing():
    return ScenarioEditing(Workbench(Document("lab"), Settings(), Steps()))


def test_a_scene_begins_with_its_own_scenario(editing):
    assert editing.scenario == load_scenario_named(editing.text)
    assert editing.scenario.people == load_scenario("lab-rearrange").people
    assert editing.bench.document.scenario == ""


def load_scenario_named(text):
    from sim.scenario import parse_scenario

    return parse_scenario(text, source="lab-rearrange.toml")


def test_bad_text_is_kept_beside_the_last_good_one(editing):
    good = editing.text.replace("24.0", "12.0")
    editing.type(good)
    for bad, words in (
        (good.replace("12.0", "= 12"), "at line 3"),
        (good.replace("12.0", "-1.0"), "duration_s = -1.0, wanted a number"),
        (good.replace('do = "hide"', 'do = "vanish"'), r"people[0].actions[5].do = 'vanish'"),
    ):
        editing.type(bad)
        assert words in editing.problem
        assert editing.draft == bad
        assert editing.bench.document.scenario == good
        with pytest.raises(EditError, match="correct or discard"):
            editing.change("Move", lambda text: text_edits.with_duration(text, 3.0))
    assert editing.error_line is None
    editing.discard()
    assert (editing.text, editing.draft, editing.problem) == (good, None, "")


def test_a_refused_edit_changes_nothing(editing):
    before = editing.text
    with pytest.raises(ScenarioError, match="duration_s"):
        editing.change("Last", lambda text: text_edits.with_duration(text, -3.0))
    assert editing.text == before
    assert not editing.bench.history


def test_files_round_trip(editing, tmp_path):
    editing.change("Last", lambda text: text_edits.with_duration(text, 9.0))
    editing.save(tmp_path / "mine.toml")
    saved = (tmp_path / "mine.toml").read_text()
    assert saved == editing.text
    assert load_scenario(tmp_path / "mine.toml").duration_s == 9.0
    editing.choose("lab-short")
    assert editing.name == "lab-short"
    editing.open(tmp_path / "mine.toml")
    assert (editing.name, editing.text) == ("mine", saved)


def test_a_bad_file_is_opened_as_a_draft(editing, tmp_path):
    (tmp_path / "bad.toml").write_text("room = 3\n")
    editing.open(tmp_path / "bad.toml")
    assert editing.draft == "room = 3\n"
    assert "room = 3, wanted a text" in editing.problem
    assert editing.bench.log.lines("error")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ScenarioError, match="UTF-8"):
        editing.open(tmp_path / "binary.toml")


def test_another_scene_brings_another_scenario(editing):
    editing.bench.show_document(Document("desk"))
    assert editing.scenario.room == "desk"
