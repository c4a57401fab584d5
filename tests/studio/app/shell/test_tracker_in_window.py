"""A plug-in's tracker is chosen in the window and plays; one that fails is in the log."""

import json
import shutil
import time
from pathlib import Path

import pytest

from devices.recording import read_session
from studio import rehearsal
from studio.app.model.documents.document import Document
from studio.console.display import why_no_window
from studio.session.trackers.methods import make_method

EXAMPLES = Path(__file__).parents[4] / "examples" / "plugins"
WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
FAILING = """
from studio.session.trackers.methods import make_method

class Failing:
    def __init__(self, scene):
        pass
    def start(self):
        return 0
    def step(self, state, frame, now_ns):
        raise RuntimeError("no lens today")

def register(studio):
    studio.tracker("failing", Failing)
"""


@pytest.fixture
def opened(tiny, tmp_path, qapp, monkeypatch):
    from studio.app.window import dispose, make_window

    def open_tiny(plan, **given):
        def made(name):
            if name == "own":
                return tiny.tracker(0.03)
            return make_method(name, tiny.scene, more=plan.more_methods)

        return tiny.session(plan, methods={name: made(name) for name in plan.methods}, **given)

    monkeypatch.setattr(rehearsal, "open_session", open_tiny)
    plugins = tmp_path / "plugins"
    plugins.mkdir()
    shutil.copy(EXAMPLES / "still_tracker.py", plugins)
    (plugins / "failing.py").write_text(FAILING)
    home = tmp_path / "home"
    window = make_window(
        Document("tiny"), rehearse_to=tmp_path / "demo", home=home, plugins=plugins
    )
    window.show()

    def until(condition):
        deadline = time.monotonic() + 120
        while not condition():
            assert time.monotonic() < deadline, window.bench.log.lines()
            qapp.processEvents()
            time.sleep(0.002)

    until(lambda: window.is_filled and len(window.bench.offered.trackers) == 2)
    window.bench.show_scene(tiny.scene)
    yield window, until, plugins
    window.close()
    dispose(window)


def names(panel):
    return [panel.names.itemData(row) for row in range(panel.names.count())]


def methods_of(folder):
    return list(json.loads((folder / "tracks.json").read_text())["methods"])


def test_a_plug_in_s_tracker_is_chosen_shown_and_recorded_beside_ours(opened, tmp_path):
    window, until, plugins = opened
    bench, panel = window.bench, window.content("session").tracker
    assert names(panel) == ["own", "paper", "failing", "still"]
    panel.names.setCurrentIndex(3)
    panel.names.activated.emit(3)
    panel.beside.click()
    assert bench.document.tracker.name == "still"
    assert bench.document.tracker.is_beside
    assert bench.do("session.rehearse")
    until(lambda: bench.recording is not None)
    assert methods_of(bench.recording.parent) == ["still", "own"]
    assert read_session(bench.recording).methods == ("still", "own")
    assert bench.do("edit.undo")
    assert bench.do("edit.undo")
    assert panel.names.currentData() == "own"
    (plugins / "still_tracker.py").unlink()
    until(lambda: names(panel) == ["own", "paper", "failing"])
    assert not bench.do("tracker.choose", name="still")
    assert "wanted one of own, paper, failing" in bench.log.lines("error")[-1].text


def test_a_tracker_that_raises_is_in_the_log_and_the_session_ends_as_it_would(opened, tmp_path):
    window, until, plugins = opened
    bench = window.bench
    assert bench.do("tracker.choose", name="failing", beside=True)
    assert bench.do("session.rehearse")
    until(lambda: bench.recording is not None)
    errors = [line.text for line in bench.log.lines("error")]
    assert len(errors) == 1
    assert errors[0].startswith(f"tracker failing: {plugins / 'failing.py'}:10: RuntimeError")
    assert methods_of(bench.recording.parent) == ["failing", "own"]


def test_the_recording_that_is_open_is_tracked_again_by_another_tracker(opened, tmp_path):
    window, until, _ = opened
    bench = window.bench
    assert bench.do("session.rehearse")
    until(lambda: bench.recording is not None)
    first = bench.recording
    assert bench.do("tracker.choose", name="still")
    assert bench.do("session.track_again")
    until(lambda: bench.recording not in (None, first))
    assert methods_of(bench.recording.parent) == ["still"]
    assert methods_of(first.parent) == ["own"]
