"""A sweep is begun, watched, cancelled and read in the window, and a run of it is opened."""

from pathlib import Path

import pytest

from benchmarks.studio.tasks.clicking import Hand
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


class Staged:
    """Stands for the process that plays a sweep: it does what the test says."""

    def __init__(self, words):
        self.words, self.lines = words, []
        self.is_running, self.code, self.is_cancelled = True, None, False

    def said(self):
        return self.lines

    def cancel(self):
        self.is_cancelled, self.is_running, self.code = True, False, -15


@pytest.fixture
def begun(desk, monkeypatch):
    """The dock with a sweep of two delays that is being played, and its process."""
    from PySide6.QtCore import QPoint

    children = []
    monkeypatch.setattr(
        "studio.app.scenario.sweeps_dock.Child",
        lambda words: children.append(Staged(words)) or children[-1],
    )
    hand = Hand(desk.window, desk.until)
    desk.press("9", "Control")
    dock = desk.window.content("sweeps")
    desk.until(dock.isVisible)
    row = dock.faults.visualItemRect(dock.faults.topLevelItem(0))
    hand.press(dock.faults.viewport(), QPoint(row.left() + 10, row.center().y()))
    hand.button("Start the sweep", dock)
    return dock, children[0], hand


def played(dock, count):
    """As if so many runs of the sweep were whole."""
    from studio.app.scenario.asked_sweep import runs_of
    from studio.sweep.results import SweepFolder

    runs = list(runs_of(dock.folder, "lab").values())
    for run in runs[:count]:
        row = {"fault": run.fault, "size": run.size, "seed": run.seed, "method": "own"}
        figures = {"world_cm_mean": 1.5, "world_cm_p95": None, "yaw_deg_mean": 0.25}
        SweepFolder(dock.folder).add(run, {"rows": [{**row, **figures, "lost_share": 0.1}]})
    return runs


def test_a_sweep_fills_its_table_and_a_run_of_it_is_opened(desk, begun, tmp_path):
    dock, child, hand = begun
    bench = desk.window.bench
    assert child.words[:2] == ["rehearse", str(desk.room)]
    assert "sweep" in bench.busy
    child.lines = ["playing 3 of 3 runs …", "playing 3 of 3 runs  33%, 8 s left  1 of 3 runs"]
    runs = played(dock, 1)
    desk.until(lambda: dock.table.topLevelItemCount() == 1)
    assert dock.bar.value() == 33
    assert dock.bar.isVisible()
    played(dock, 3)
    child.is_running, child.code = False, 0
    desk.until(lambda: not dock.bar.isVisible())
    cells = [[dock.table.topLevelItem(k).text(c) for c in range(7)] for k in range(3)]
    assert cells[0] == ["without", "", "0", "1.50", "-", "0.25", "10.00"]
    assert [row[:2] for row in cells[1:]] == [["Delay, ms", "150"], ["Delay, ms", "300"]]
    assert "3 runs played" in dock.line.text()
    last = dock.table.visualItemRect(dock.table.topLevelItem(2)).center()
    hand.press(dock.table.viewport(), last)
    hand.button("Open this run", dock)
    desk.until(lambda: bench.recording is not None)
    assert bench.recording.parent.parent == tmp_path / "sessions"
    assert runs[2].name in bench.recording.parent.name
    plan = desk.plans[-1]
    assert "delay_ms = 300" in Path(plan.scenario).read_text()
    assert (plan.seed, plan.methods) == (0, ("own",))


def test_a_cancelled_sweep_keeps_its_whole_runs_and_stands_in_the_list(desk, begun):
    dock, child, hand = begun
    played(dock, 2)
    hand.button("Cancel", dock)
    desk.until(lambda: not dock.bar.isVisible())
    assert child.is_cancelled
    assert dock.table.topLevelItemCount() == 2
    assert "cancelled" in dock.line.text()
    assert dock.choice.currentText() == dock.folder.name
    assert "sweep" not in desk.window.bench.busy


def test_what_cannot_be_swept_is_said(desk):
    bench = desk.window.bench
    desk.window.content("sweeps")
    assert not bench.do("sweep.start")
    assert "tick one" in bench.log.lines()[-1].text
    assert not bench.do("sweep.start_file", path=str(desk.room / "none.toml"))
    assert "cannot be read" in bench.log.lines()[-1].text
