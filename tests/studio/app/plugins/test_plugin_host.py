"""Plug-ins on a bench: actions come and go with their file, panels open and may fail."""

import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from studio.app.model.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
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
    deadline = time.monotonic() + 20
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
