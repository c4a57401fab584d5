"""Plug-ins on a bench: actions come and go with their file, panels open and may fail."""

import os
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Topic, Workbench
from studio.app.plugins.plugin_host import PluginHost, panel_id
from studio.console.display import why_no_window

EXAMPLES = Path(__file__).parents[4] / "examples" / "plugins"
WHY_NOT = why_no_window()


@pytest.fixture
def bench():
    return Workbench(Document("lab"), Settings(), SimpleNamespace(push=print, clear=print))


@pytest.fixture
def hosted(bench):
    hosts = []

    def host(folder):
        hosts.append(PluginHost(bench, folder))
        return hosts[-1]

    yield host
    for made in hosts:
        made.close()


def until(host, condition):
    deadline = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < deadline
        host.folder.look()
        host.poll()
        time.sleep(0.01)


def test_actions_come_and_go_with_their_file(bench, hosted, tmp_path):
    path = tmp_path / "hello.py"
    path.write_text(
        "def register(studio):\n"
        "    studio.action('hello.say', 'Hello', lambda: 1 / 0)\n"
        "    studio.panel('Bad one', lambda bench: bench.nothing)\n"
    )
    host = hosted(tmp_path)
    until(host, lambda: "hello.say" in bench.actions)
    assert not bench.do(panel_id("Bad one"))
    assert f"{path}:3" in bench.log.lines("error")[-1].text
    path.unlink()
    until(host, lambda: "hello.say" not in bench.actions)
    assert panel_id("Bad one") not in bench.actions


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_a_panel_opens_and_shows_the_bench(bench, hosted, qtbot):
    host = hosted(EXAMPLES)
    until(host, lambda: panel_id("Object count") in bench.actions)
    assert bench.do(panel_id("Object count"))
    panel = host.panels["Object count"]
    qtbot.addWidget(panel)
    assert panel.isVisible()
    assert panel.text() == "no scene"
    bench.show_scene(SimpleNamespace(objects=(1, 2)))
    assert panel.text() == "2 objects"


PANEL = """
from PySide6.QtWidgets import QLabel
from studio.app.model.workbench import Topic

class Panel(QLabel):
    def __init__(self, bench):
        super().__init__("{text}")
        self.selections = 0
        bench.listen(Topic.SELECTION, self.hear)
    def hear(self):
        self.selections += 1
        {then}

def register(studio):
    studio.panel("Mine", Panel)
"""


@pytest.fixture
def window(tmp_path, qapp):
    from studio.app.window import dispose, make_window

    windows = []

    def start():
        plugins = tmp_path / "plugins"
        plugins.mkdir(exist_ok=True)
        made = make_window(
            Document("lab"), rehearse_to=tmp_path / "out", home=tmp_path / "home", plugins=plugins
        )
        windows.append(made)
        made.show()
        shown_until(lambda: made.is_filled)
        return made, plugins / "mine.py"

    def shown_until(condition):
        deadline = time.monotonic() + 120
        while not condition():
            assert time.monotonic() < deadline
            qapp.processEvents()
            time.sleep(0.002)

    start.until = shown_until
    yield start
    for made in windows:
        made.close()
        dispose(made)


def save(path, t_s, text, then="pass"):
    path.write_text(PANEL.format(text=text, then=then))
    os.utime(path, (t_s, t_s))


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_a_panel_is_a_dock_that_follows_its_file_and_comes_back_in_the_next_window(window):
    from PySide6.QtWidgets import QLabel

    first, path = window()
    save(path, 1000, "one")
    window.until(lambda: panel_id("Mine") in first.bench.actions)
    assert first.plugins.panels == {}
    assert first.bench.do(panel_id("Mine"))
    docks = first.plugins._places.docks
    dock, panel = docks["Mine"], first.plugins.panels["Mine"]
    window.until(panel.isVisible)
    assert "color: " in dock.tabWidget().findChildren(QLabel)[0].styleSheet()
    assert dock.dockAreaWidget() is first.docks["session"].dockAreaWidget()

    save(path, 2000, "two")
    window.until(lambda: first.plugins.panels["Mine"].text() == "two")
    assert docks["Mine"] is dock
    first.bench.select("chair-1")
    assert first.plugins.panels["Mine"].selections == 1
    assert not first.bench.log.lines("error")

    first.close()
    second, _ = window()
    window.until(lambda: "Mine" in second.plugins.panels)
    docks = second.plugins._places.docks
    docks["Mine"].closeDockWidget()
    window.until(lambda: "Mine" not in second.plugins.panels)
    assert docks == {}
    assert second.bench.settings.panels == ()
    assert second.bench.do(panel_id("Mine"))
    path.unlink()
    window.until(lambda: panel_id("Mine") not in second.bench.actions)
    assert docks == second.plugins.panels == {}


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_a_panel_that_raises_when_it_hears_something_is_said_once_and_others_hear_on(window):
    made, path = window()
    save(path, 1000, "one", then="raise KeyError('nobody')")
    window.until(lambda: panel_id("Mine") in made.bench.actions)
    assert made.bench.do(panel_id("Mine"))
    selections = []
    made.bench.listen(Topic.SELECTION, lambda: selections.append(made.bench.selection))
    for name in ("chair-1", "chair-2"):
        made.bench.select(name)
    assert selections == ["chair-1", "chair-2"]
    (line,) = made.bench.log.lines("error")
    assert line.text.startswith(f"panel Mine: {path}:12: ")
    assert "KeyError: 'nobody'" in line.text
