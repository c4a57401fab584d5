"""All small pictures are drawn by one thread, in turn, in a bounded share of the time."""

import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.state import SceneState
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.view_picture import View
from studio.app.viewport.insets.inset_painter import SHARE, InsetPainter, Turns, rest_s

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
    deadline = time.monotonic() + 120
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


def test_the_latest_request_of_a_key_counts_and_is_drawn_once():
    turns = Turns()
    turns.ask("ana", 1)
    turns.ask("ana", 2)
    assert turns.next() == ("ana", 2)
    assert turns.next() is None


@given(st.lists(st.sampled_from(["ana", "ben", "chair-1"]), max_size=60))
def test_nobody_who_asks_waits_for_more_than_the_others_once(asking):
    turns, waiting = Turns(), {}
    for key in asking:
        turns.ask(key, None)
        waiting.setdefault(key, 0)
        if len(waiting) == 3:  # all want a picture, again and again
            drawn, _ = turns.next()
            del waiting[drawn]
            waiting = {other: turns_missed + 1 for other, turns_missed in waiting.items()}
            assert all(missed <= 2 for missed in waiting.values())


def test_a_key_that_was_closed_is_not_drawn():
    turns = Turns()
    turns.ask("ana", 1)
    turns.ask("ben", 2)
    assert turns.next() == ("ana", 1)
    turns.ask("ana", 3)
    turns.forget("ana")
    turns.forget("nobody")
    assert turns.next() == ("ben", 2)
    assert turns.next() is None


@given(st.floats(1e-4, 5.0))
def test_drawing_takes_its_share_of_the_time(took):
    assert took / (took + rest_s(took)) == pytest.approx(SHARE)
