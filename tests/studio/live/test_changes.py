"""Changes are kept in order with their words, and a setting's undo is a change, too."""

from __future__ import annotations

from devices.clock import ManualClock
from studio.live.changes import Changes
from tracking.options import TrackerOptions


def test_settings_are_undone_one_by_one():
    clock = ManualClock(5)
    changes = Changes(clock)
    assert changes.undo() == ""
    first, second = TrackerOptions(texture=False), TrackerOptions(search_ms=7.0)
    changes.adjust(first)
    clock.sleep_until(9)
    changes.adjust(second)
    assert changes.options == second
    assert "undone" in changes.undo()
    assert changes.options == first
    changes.undo()
    assert changes.options == TrackerOptions()
    assert changes.undo() == ""
    assert [change.t_ns for change in changes.kept()] == [5, 9, 9, 9]
