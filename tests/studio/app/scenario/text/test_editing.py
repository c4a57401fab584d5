"""What is typed, what was last good, and what is rehearsed."""

import signal
import subprocess
import sys
import time

import pytest

from sim.scenarios.scenario import load_scenario
from sim.tables import ScenarioError
from studio.app.model.documents.autosave import recoverable
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.app.scenario.text import edits
from studio.app.scenario.text.editing import ScenarioEditing
from studio.app.scenario.text.toml_spans import EditError


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
    from sim.scenarios.scenario import parse_scenario

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
            editing.change("Move", lambda text: edits.with_duration(text, 3.0))
    assert editing.error_line is None
    editing.discard()
    assert (editing.text, editing.draft, editing.problem) == (good, None, "")


def test_a_refused_edit_changes_nothing(editing):
    before = editing.text
    with pytest.raises(ScenarioError, match="duration_s"):
        editing.change("Last", lambda text: edits.with_duration(text, -3.0))
    assert editing.text == before
    assert not editing.bench.history


def test_files_round_trip(editing, tmp_path):
    editing.change("Last", lambda text: edits.with_duration(text, 9.0))
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


def test_a_draft_is_part_of_the_document_and_of_what_is_undone(editing):
    bench, good = editing.bench, editing.text
    for typed in (good.replace("24.0", "= 24"), ""):
        editing.type(typed)
        assert bench.document.draft == typed
        assert not bench.is_saved
    assert editing.text == good
    assert {step.merge for step in bench.history} == {"scenario text"}
    editing.discard()
    assert bench.document.draft is None
    bench.show_document(bench.history[-1].before)  # as undo does
    assert editing.draft == ""
    assert "room is missing" in editing.problem
    editing.type(good)
    assert (editing.draft, editing.problem) == (None, "")


CRASHING = """
import sys, time
from pathlib import Path
from types import SimpleNamespace
from studio.app.model.documents.autosave import Autosave
from studio.app.model.documents.autosave import recoverable
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Topic, Workbench
from studio.app.scenario.text.editing import ScenarioEditing

bench = Workbench(Document("lab"), Settings(), SimpleNamespace(push=lambda _: None))
autosave = Autosave(Path(sys.argv[1]))
bench.listen(Topic.DOCUMENT, lambda: autosave.keep(bench.document))
editing = ScenarioEditing(bench)
good = editing.text.replace("24.0", "12.0")
editing.type(good)
editing.type(good.replace("12.0", "12.x"))
print("typed", flush=True)
time.sleep(600)
"""


def test_a_draft_survives_a_kill_beside_the_last_good_text(tmp_path):
    child = subprocess.Popen(
        [sys.executable, "-c", CRASHING, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout.readline() == "typed\n"
    deadline = time.monotonic() + 120
    while not any("12.x" in path.read_text() for path in tmp_path.glob("autosave-*.nexus")):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    child.send_signal(signal.SIGKILL)
    child.wait()
    (found,) = recoverable(tmp_path)
    editing = ScenarioEditing(Workbench(found.document, Settings(), Steps()))
    assert "duration_s = 12.x" in editing.draft
    assert "at line 3" in editing.problem
    assert editing.scenario.duration_s == 12.0
