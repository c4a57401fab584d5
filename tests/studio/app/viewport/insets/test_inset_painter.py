"""All small pictures are drawn by one thread, in turn."""

import threading
import time

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.state import SceneState
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.view_picture import View
from studio.app.viewport.insets.inset_painter import InsetPainter

CAMERA = Pinhole.from_fov(32, 18, 1.0)


@pytest.fixture
def painter(tiny):
    drawing = SceneDrawing(tiny.scene)
    made = InsetPainter(drawing)
    yield made
    made.stop()
    drawing.close()


def view_from(x):
    return View(SceneState(), CAMERA, look_at(np.array([x, -2.0, 1.5]), np.zeros(3)))


def next_picture(painter, key):
    deadline = time.monotonic() + 30
    while (painted := painter.take(key)) is None:
        assert time.monotonic() < deadline
        time.sleep(0.005)
    return painted


def test_each_gets_its_own_picture_of_one_thread(painter):
    painter.show("ana", view_from(0.0))
    painter.show("ben", view_from(1.0))
    ana, ben = next_picture(painter, "ana"), next_picture(painter, "ben")
    assert ana.picture.shape == (18, 32, 3)
    assert np.abs(ana.picture.astype(int) - ben.picture).max() > 10
    assert painter.take("ana") is None
    assert len([t for t in threading.enumerate() if t.name == "inset painter"]) == 1


def test_a_closed_one_gets_none_and_the_others_go_on(painter):
    painter.show("ana", view_from(0.0))
    painter.forget("ana")
    painter.show("ben", view_from(1.0))
    assert next_picture(painter, "ben").view.world_from_camera.translation[0] == 1.0
    assert painter.take("ana") is None
