"""In the window, an object that is moved takes its shadow along."""

import numpy as np
import pytest

from studio.app.model.documents.document import Document
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
PLACE = np.array([0.3, -0.5, 0.0])
"""Free floor of the lab, in sight when it opens."""


@pytest.fixture
def window(qapp, tmp_path, until):
    from studio.app.window import dispose, make_window

    made = make_window(Document("lab"), rehearse_to=tmp_path / "out", home=tmp_path / "home")
    made.bench.set(has_started=True)
    made.show()
    made.run.open_scene("lab")
    until(lambda: made.is_filled and made.bench.scene is not None and not made.run.is_busy)
    until(lambda: made.view.active.painted is not None)
    yield made
    made.close()
    dispose(made)


def light_under_the_stool(painted):
    """Mean of the pixels that show the floor between the legs, 0..255."""
    view = painted.view
    around = [PLACE + 0.06 * np.array([np.cos(a), np.sin(a), 0.0]) for a in np.arange(0, 6, 0.5)]
    seen, _ = view.camera.project(view.world_from_camera.inverse() @ np.array(around))
    columns, rows = np.round(seen).astype(int).T
    return float(painted.picture[rows, columns].mean())


def test_a_stool_that_is_moved_darkens_the_floor_where_it_stands(window, until):
    view = window.view.active
    until(lambda: view.painted.is_full)
    before = view.painted
    window.bench.perform("twin.move", item="stool-2", place=[*PLACE])
    lit = light_under_the_stool(before)
    until(lambda: view.painted.is_full and light_under_the_stool(view.painted) < 0.9 * lit)
