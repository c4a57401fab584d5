"""The view as its user has it: what the mouse does in it."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.opening import open_scene
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.app.twin.additions import surface_added
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.layers import Layers
from studio.app.viewport.orbit import Orbit
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
CORNERS = np.array([[-0.4, 0.3, 0.02], [0.4, 0.3, 0.02], [0.4, -0.3, 0.02], [-0.4, -0.3, 0.02]])


class PlainHistory:
    """Undo without Qt."""

    def __init__(self):
        self.changes = []

    def push(self, change):
        merged = self.changes[-1].merged(change) if self.changes else None
        self.changes[-1:] = [merged] if merged else [*self.changes[-1:], change]

    def clear(self):
        self.changes.clear()


@pytest.fixture(scope="module")
def desk():
    return open_scene("desk")


@pytest.fixture
def bench(desk):
    made = Workbench(Document("desk"), Settings(), PlainHistory())
    made.show_scene(desk)
    return made


@pytest.fixture
def view(bench, qapp):
    from studio.app.viewport.view import TwinView

    layers = Layers(bench)
    drawings = Drawings()
    made = TwinView(bench, layers=layers, drawings=drawings, finished=lambda _hand: None)
    made.resize(640, 480)
    made.show()
    yield made
    made.close()
    made.deleteLater()
    drawings.close()


def drag(view, start, end):
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest

    def at(place):
        return QPoint(*(round(float(v)) for v in place))

    button, plain = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    QTest.mousePress(view, button, plain, at(start))
    for share in (0.3, 0.6, 1.0):
        QTest.mouseMove(view, at(start + share * (end - start)))
    QTest.mouseRelease(view, button, plain, at(end))


def test_a_corner_of_the_selected_surface_follows_the_mouse(view, bench):
    document, surface_id = surface_added(bench.document, {}, CORNERS)
    bench.show_document(document)
    view.set_viewer(replace(view.viewer, orbit=Orbit((0.0, 0.0, 0.0), -1.6, 0.9, 2.0)))
    before = view.viewer
    pixels = view._screen_camera().project(view.viewer.world_from_camera().inverse() @ CORNERS)[0]
    drag(view, pixels[1], pixels[1] + (20.0, -15.0))
    assert view.viewer != before, "without a selection a drag turns the view"
    view.set_viewer(before)
    bench.select(surface_id)
    drag(view, pixels[1], pixels[1] + (20.0, -15.0))
    assert view.viewer == before
    corners = bench.document.twin.surfaces[surface_id].corners_in_world
    assert corners[1, 0] > 0.42
    assert corners[1, 2] == pytest.approx(0.02)
    assert corners[[0, 2, 3]] == pytest.approx(CORNERS[[0, 2, 3]])
    assert len(bench.history.changes) == 1


def test_it_is_drawn_once_it_shows_what_is_now_whole(view, until):
    until(lambda: view.is_drawn)
    assert view.painted.is_full
    view.set_viewer(view.viewer)
    assert not view.is_drawn
    until(lambda: view.is_drawn)
