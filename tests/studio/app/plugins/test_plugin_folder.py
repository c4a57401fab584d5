"""Plug-ins are found, run, run again when saved; one that fails or loops is reported."""

import os
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from studio.app.plugins.plugin_folder import PluginFolder

EXAMPLES = Path(__file__).parents[4] / "examples" / "plugins"
COUNTER = """
count = {first}
def register(studio):
    studio.action("counter.add", "Count", add)
def add():
    global count
    count += 1
def state():
    return count
def restore(value):
    global count
    count = value
"""


@pytest.fixture
def opened(tmp_path):
    """A function that opens a folder, and the log."""
    made = []

    def open_folder(folder=tmp_path, limit_s=5.0):
        said = []
        plugins = PluginFolder(folder, say=lambda *line: said.append(line), limit_s=limit_s)
        made.append(plugins)
        return plugins, said

    yield open_folder
    for plugins in made:
        plugins.close()


def settled(plugins, said, count):
    """Poll until so many lines were said."""
    deadline = time.monotonic() + 120
    while len(said) < count:
        assert time.monotonic() < deadline, said
        plugins.look()
        plugins.poll()
        time.sleep(0.01)


def save(path, text, t_s):
    path.write_text(text)
    os.utime(path, (t_s, t_s))


def test_the_examples_load_are_short_and_offer_a_tracker_a_panel_and_a_fault(opened):
    plugins, said = opened(EXAMPLES)
    settled(plugins, said, 3)
    offers = plugins.offers()
    assert [level for level, _ in said] == ["info"] * 3, said
    assert set(offers.trackers) == {"still"}
    assert set(offers.panels) == {"Object count"}
    dark = offers.faults["flicker"](0.5).seen([np.full((2, 2, 3), 100, np.uint8)], 0.25)
    assert int(dark[0][0, 0, 0]) == 50
    for path in EXAMPLES.glob("*.py"):
        written = [line for line in path.read_text().splitlines() if line.strip()]
        assert len(written) <= 30, path.name


def test_a_saved_plugin_is_run_again_and_keeps_its_state(opened, tmp_path):
    plugins, said = opened()
    save(tmp_path / "counter.py", COUNTER.format(first=0), 1000)
    settled(plugins, said, 1)
    plugins.offers().actions[0].run()
    save(tmp_path / "counter.py", COUNTER.format(first=40), 2000)
    settled(plugins, said, 2)
    assert said[1] == ("info", "plug-in counter.py: loaded again, its state kept")
    assert plugins.plugins["counter.py"].module.count == 1
    (tmp_path / "counter.py").unlink()
    settled(plugins, said, 3)
    assert plugins.plugins == {}


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("\nraise ValueError('no lens')\n", 2, "ValueError: no lens"),
        ("x = (\n", 1, "SyntaxError"),
        ("import sys\nsys.exit(3)\n", 2, "SystemExit: 3"),
        ("x = 1\n", 1, "no function register"),
        ("def register(studio):\n    studio.tracker('own', None)\n", 2, "built in"),
    ],
)
def test_a_plugin_that_fails_is_reported_with_file_and_line(opened, tmp_path, text, line, words):
    plugins, said = opened()
    save(tmp_path / "bad.py", text, 1000)
    settled(plugins, said, 1)
    level, report = said[0]
    assert level == "error"
    assert f"{tmp_path / 'bad.py'}:{line}: " in report
    assert words in report
    assert plugins.plugins == {}


def test_one_that_fails_after_it_was_saved_stays_as_it_was(opened, tmp_path):
    plugins, said = opened()
    save(tmp_path / "counter.py", COUNTER.format(first=7), 1000)
    settled(plugins, said, 1)
    save(tmp_path / "counter.py", "1 / 0", 2000)
    settled(plugins, said, 2)
    assert "ZeroDivisionError" in said[1][1]
    assert plugins.plugins["counter.py"].module.count == 7


def test_a_looping_plugin_is_abandoned_by_name_and_its_later_results_are_ignored(opened, tmp_path):
    plugins, said = opened(limit_s=0.3)
    go = tmp_path / "go"
    text = "import pathlib, time\n" + (
        f"while not pathlib.Path({str(go)!r}).exists():\n    time.sleep(0.01)\n"
        "def register(studio):\n    studio.action('late.come', 'Late', print)\n"
    )
    save(tmp_path / "loop.py", text, 1000)
    save(tmp_path / "counter.py", COUNTER.format(first=0), 1000)
    settled(plugins, said, 2)
    assert [thread.name for thread in plugins.abandoned] == ["plug-in loop.py"]
    assert any("loop.py: does not end" in report for _, report in said)
    go.touch()
    plugins.abandoned[0].join(120)
    plugins.poll()
    assert set(plugins.plugins) == {"counter.py"}


def test_a_plugin_s_tracker_can_be_chosen_beside_the_built_in_ones(opened):
    from studio.session.trackers.methods import make_method

    plugins, said = opened(EXAMPLES)
    settled(plugins, said, 3)
    scene = SimpleNamespace(objects=())
    method = make_method("still", scene, more=plugins.offers().trackers)
    frame = SimpleNamespace(t_ns=0, seq=0, world_from_rig=None)
    assert method.step(method.start(), frame, 0)[1].objects == ()
    with pytest.raises(ValueError, match="own, paper, still"):
        make_method("stil", scene, more=plugins.offers().trackers)
