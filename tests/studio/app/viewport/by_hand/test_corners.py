"""Corners of live surfaces: taken and dragged on the surface's plane, one step of undo a drag."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.state import LiveSurface
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.app.twin.additions import surface_added
from studio.app.viewport.by_hand.corners import CornerHandles, surface_at
from studio.app.viewport.by_hand.dragging import Aim, CornerDrag

CAMERA = Pinhole.from_fov(320, 240, 1.1)
EYE = look_at(np.array([0.2, -3.0, 1.6]), np.array([0.0, 0.0, 1.2]))
CORNERS = np.array([[-0.5, 0.0, 1.7], [0.5, 0.0, 1.7], [0.5, 0.0, 1.0], [-0.5, 0.0, 1.0]])
BOARD = LiveSurface("surface-1", CORNERS, (640, 448), "camera-360")


class PlainHistory:
    """Undo without Qt."""

    def __init__(self):
        self.changes = []

    def push(self, change):
        merged = self.changes[-1].merged(change) if self.changes else None
        self.changes[-1:] = [merged] if merged else [*self.changes[-1:], change]

    def clear(self):
        self.changes.clear()


@pytest.fixture
def bench():
    document, _ = surface_added(Document("desk"), {}, CORNERS)
    return Workbench(document, Settings(), PlainHistory())


def handles(surface=BOARD):
    return CornerHandles(surface, CAMERA, EYE)


def pixel_of(point):
    return CAMERA.project(EYE.inverse() @ np.atleast_2d(point))[0][0]


def aim_at(point):
    return Aim(*pixel_of(point), CAMERA, EYE)


def corners_of(bench):
    return bench.document.twin.surfaces["surface-1"].corners_in_world


def test_a_press_takes_the_corner_under_it_and_no_other():
    for corner, (x, y) in enumerate(handles().pixels()):
        assert handles().hit(x + 3.0, y - 3.0) == corner
    assert handles().hit(*pixel_of(CORNERS.mean(axis=0))) is None


def test_corners_behind_the_viewer_cannot_be_taken():
    behind = LiveSurface("s", CORNERS - (0.0, 6.0, 0.0), (640, 448), "camera-360")
    assert np.isnan(handles(behind).pixels()).all()
    assert handles(behind).hit(160.0, 120.0) is None


@given(st.floats(-0.9, 0.4), st.floats(1.2, 2.0))
@settings(deadline=None)
def test_a_corner_stays_on_the_plane_of_its_surface(x, z):
    wanted = np.array([x, 0.0, z])
    assert handles().dragged(*pixel_of(wanted)) == pytest.approx(wanted, abs=1e-4)


def test_beyond_the_planes_horizon_a_drag_says_nothing():
    floor = LiveSurface("s", CORNERS[:, [0, 2, 1]] * (1, 1, 0), (640, 448), "camera-360")
    assert CornerHandles(floor, CAMERA, EYE).dragged(160.0, 2.0) is None


def test_a_drag_is_one_step_and_one_line_of_a_script(bench):
    drag = CornerDrag(bench, handles(), corner=1, merge="drag 1")
    for x in (0.6, 0.7, 0.8):
        drag.to(aim_at([x, 0.0, 1.8]))
    drag.end()
    assert corners_of(bench)[1] == pytest.approx([0.8, 0.0, 1.8], abs=1e-4)
    assert corners_of(bench)[[0, 2, 3]] == pytest.approx(CORNERS[[0, 2, 3]])
    (change,) = bench.history.changes
    assert change.before.twin.surfaces["surface-1"].corners_in_world == pytest.approx(CORNERS)
    (line,) = bench.trace()
    assert line.startswith("twin.drag_corner item=surface-1 corner=1 place=")


def test_a_corner_that_would_fold_the_surface_stays_at_the_last_good_place(bench):
    drag = CornerDrag(bench, handles(), corner=0, merge="drag 1")
    drag.to(aim_at([-0.4, 0.0, 1.6]))
    drag.to(aim_at([0.45, 0.0, 1.05]))
    drag.to(aim_at([0.46, 0.0, 1.04]))
    assert corners_of(bench)[0] == pytest.approx([-0.4, 0.0, 1.6], abs=1e-4)
    (warning,) = bench.log.lines("warning")
    assert "corner 0 cannot go there" in warning.text


def test_a_press_without_a_move_changes_nothing(bench):
    drag = CornerDrag(bench, handles(), corner=0, merge="drag 1")
    drag.end()
    assert bench.history.changes == []
    assert bench.trace() == []


def test_a_place_on_a_surface_is_that_surface():
    surfaces = {"surface-1": BOARD}
    assert surface_at(surfaces, np.array([0.2, 0.02, 1.5])) == "surface-1"
    assert surface_at(surfaces, np.array([0.2, 0.1, 1.5])) == ""
    assert surface_at(surfaces, np.array([0.7, 0.0, 1.5])) == ""
