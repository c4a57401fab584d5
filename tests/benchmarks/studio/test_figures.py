import pytest

from benchmarks.studio import figures
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def test_opening_is_measured_from_the_start_of_the_process(monkeypatch):
    monkeypatch.setattr(figures, "OPENINGS", 1)
    window, picture = figures.opening_rows()
    assert 0.1 < window.value < picture.value
