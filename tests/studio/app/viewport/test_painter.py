"""The thread that draws the twin: coarse while the view moves, then in full."""

import time

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.state import SceneState
from studio.app.viewport.painter import TwinPainter, View, scaled

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
        painters.append(TwinPainter(tiny.scene, SteppingClock(step_ns)))
        return painters[-1]

    yield start
    for painter in painters:
        painter.stop()


def test_a_slow_view_that_moves_is_coarse_and_refined_when_it_rests(painting):
    painter = painting(step_ns=40_000_000)
    painter.show(view_from(0.0))
    first = next_picture(painter)
    assert first.shape == (48, 64, 3)
    painter.show(view_from(0.5))
    assert next_picture(painter).shape == (24, 32, 3)
    deadline = time.monotonic() + 30
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
