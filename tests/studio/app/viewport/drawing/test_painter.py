"""The thread that draws the twin: coarse while the view moves, then in full."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import SceneState
from studio.app.viewport.drawing.mesh_picture import NoOpenGLError
from studio.app.viewport.drawing.painter import TwinPainter
from studio.app.viewport.drawing.scene_drawing import Drawings, MeshThread, SceneDrawing
from studio.app.viewport.drawing.shapes import Solid
from studio.app.viewport.drawing.view_picture import View, scaled

CAMERA = Pinhole.from_fov(64, 48, 1.0)


class SteppingClock:
    """Every look at it takes so long."""

    def __init__(self, step_ns):
        self._step_ns, self._now_ns = step_ns, 0

    def now_ns(self):
        self._now_ns += self._step_ns
        return self._now_ns

    def sleep_until(self, t_ns):
        raise AssertionError("a painter never sleeps")


def view_from(x):
    pose = look_at(np.array([x, -2.0, 1.5]), np.zeros(3))
    return View(SceneState(), CAMERA, pose)


def next_picture(painter):
    painted = painter.pictures.take(timeout_s=30)
    assert painted is not None
    return painted.picture


@pytest.fixture
def painting(tiny):
    painters = []

    def start(step_ns):
        painters.append(TwinPainter(drawing, SteppingClock(step_ns)))
        return painters[-1]

    drawing = SceneDrawing(tiny.scene)
    yield start
    for painter in painters:
        painter.stop()
    drawing.close()


def test_a_slow_view_that_moves_is_coarse_and_refined_when_it_rests(painting):
    painter = painting(step_ns=40_000_000)
    painter.show(view_from(0.0))
    first = next_picture(painter)
    assert first.shape == (48, 64, 3)
    painter.show(view_from(0.5))
    assert next_picture(painter).shape == (24, 32, 3)
    deadline = time.monotonic() + 120
    while (picture := next_picture(painter)).shape != first.shape:
        assert time.monotonic() < deadline
    assert np.abs(picture.astype(int) - first).max() > 10
    assert painter.pictures.take(timeout_s=0.3) is None


def test_a_quick_view_is_never_coarse(painting):
    painter = painting(step_ns=1_000_000)
    for x in (0.0, 0.5, 1.0):
        painter.show(view_from(x))
        assert next_picture(painter).shape == (48, 64, 3)
    assert painter.pictures.take(timeout_s=0.3) is None


@pytest.mark.parametrize("size", [(64, 48), (63, 1)])
def test_a_scaled_camera_sees_the_same(size):
    camera = Pinhole(*size, 50.0, 60.0, 30.0, 0.4)
    half = scaled(camera, 0.5)
    corners = np.array([[0.0, 0.0], [size[0], size[1]]])
    small = corners / size * [half.width_px, half.height_px]
    assert half.unproject(small) == pytest.approx(camera.unproject(corners))


BALL = Solid("ball", "ball", (1.0, 1.0, 1.0), (1.0, 0.5, 0.2), Pose(np.eye(3), np.zeros(3)))


def test_views_draw_their_own_pictures_with_one_context(painting):
    first, second = painting(step_ns=1_000_000), painting(step_ns=1_000_000)
    assert first._drawing is second._drawing
    # The eye is 2.5 m from the middle of a ball of radius 0.5 m in one view, 3.9 m in the other.
    for painter, x, range_m in ((first, 0.0, 2.0), (second, 3.0, np.sqrt(9 + 4 + 2.25) - 0.5)):
        painter.show(replace(view_from(x), shapes=(BALL,)))
        deadline = time.monotonic() + 120
        while True:
            painted = painter.pictures.take(timeout_s=30)
            assert painted is not None
            assert time.monotonic() < deadline
            if painted.depth[24, 32] == pytest.approx(range_m, abs=0.05):
                break  # the first one is without meshes: it does not wait for OpenGL
    threads = [t for t in threading.enumerate() if t.name == "meshes"]
    assert len(threads) == 1


def test_a_closed_thread_answers_that_there_is_no_picture():
    meshes = MeshThread()
    pose = look_at(np.array([0.0, -2.0, 1.5]), np.zeros(3))
    drawn = meshes.draw([BALL], CAMERA, pose)
    assert drawn is not None
    assert np.isfinite(drawn.depth).any()
    meshes.close()
    assert meshes.draw([BALL], CAMERA, pose) is None


def test_without_opengl_it_says_so_once_and_answers_all_the_same(monkeypatch):
    from studio.app.viewport.drawing import scene_drawing

    def none_here(**_options):
        raise NoOpenGLError("no OpenGL here")

    monkeypatch.setattr(scene_drawing, "MeshDrawer", none_here)
    meshes = MeshThread()
    assert meshes.draw([BALL], CAMERA, Pose.identity()) is None
    assert meshes.draw([BALL], CAMERA, Pose.identity()) is None
    assert meshes.problems.take(timeout_s=30) == "no OpenGL here"
    assert meshes.problems.take() is None
    meshes.close()


def test_another_scene_is_drawn_with_another_context(tiny):
    drawings = Drawings()
    first = drawings.of(tiny.scene)
    assert drawings.of(tiny.scene) is first
    first.prepare()
    other = drawings.of(replace(tiny.scene, name="other"))
    assert other is not first
    assert first.meshes is not None
    assert first.meshes.draw([BALL], CAMERA, Pose.identity()) is None
    drawings.close()
