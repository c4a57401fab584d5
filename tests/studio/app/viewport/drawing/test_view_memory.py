from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import SceneState
from studio.app.viewport.drawing.mesh_picture import MeshPicture
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.shapes import Line, Skin, Solid
from studio.app.viewport.drawing.view_memory import ViewMemory, is_same_shape
from studio.app.viewport.drawing.view_picture import View, draw_view

CAMERA = Pinhole.from_fov(64, 48, 1.0)
EYE = look_at(np.array([0.0, -2.0, 1.5]), np.zeros(3))
BALL = Solid("ball", "ball", (0.3, 0.3, 0.3), (1.0, 0.0, 0.0), Pose.identity())
LINE = Line("line", np.array([[0.0, 0, 0], [0, 0, 1]]), (0.0, 1.0, 0.0))
SKIN = Skin("skin", *(np.zeros((1, 3), kind) for kind in "ffiB"))


def again(shape):
    """The same values in arrays of its own."""
    if isinstance(shape, Solid):
        return replace(shape, world_from_body=Pose.identity())
    return replace(shape, points=shape.points.copy())


class CountingThread:
    def __init__(self):
        self.drawn = 0

    def draw(self, shapes, camera, world_from_camera):
        self.drawn += 1
        return MeshPicture(np.zeros((1, 1, 4), np.uint8), np.zeros((1, 1), np.float32))


def test_shapes_that_stay_are_drawn_once(tiny):
    drawing, thread = SceneDrawing(tiny.scene), CountingThread()
    memory = ViewMemory(drawing)

    def look(*shapes, eye=EYE, camera=CAMERA):
        before = thread.drawn
        memory.meshes(thread, shapes, camera=camera, world_from_camera=eye)
        return thread.drawn - before

    assert look(BALL, LINE) == 1
    assert look(again(BALL), again(LINE)) == 0
    assert look(BALL) == 1
    assert look(replace(BALL, opacity=0.5)) == 1
    assert look(replace(BALL, opacity=0.5), eye=Pose.identity()) == 1
    assert (
        look(replace(BALL, opacity=0.5), eye=Pose.identity(), camera=replace(CAMERA, fx=9.0)) == 1
    )
    drawing.close()


def test_what_thread_cannot_draw_is_asked_for_again(tiny):
    class Closed:
        def draw(self, *_):
            return None

    drawing = SceneDrawing(tiny.scene)
    memory, thread = ViewMemory(drawing), CountingThread()
    assert memory.meshes(Closed(), [BALL], camera=CAMERA, world_from_camera=EYE) is None
    assert memory.meshes(thread, [BALL], camera=CAMERA, world_from_camera=EYE) is not None
    drawing.close()


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (BALL, again(BALL), True),
        (BALL, replace(BALL, size_m=(0.3, 0.3, 0.4)), False),
        (BALL, LINE, False),
        (LINE, again(LINE), True),
        (LINE, replace(LINE, points=LINE.points + 1), False),
        (SKIN, replace(SKIN, vertices=SKIN.vertices + 1), False),
        (SKIN, SKIN, True),
    ],
)
def test_shapes_are_the_same_if_they_are_drawn_alike(one, other, same):
    assert is_same_shape(one, other) is same


def test_a_view_with_memory_is_the_view_without(tiny):
    drawing = SceneDrawing(tiny.scene)
    drawing.prepare()
    memory = ViewMemory(drawing)
    for x in (0.0, 0.0, 0.1, 0.2, 0.2):
        ball = replace(BALL, world_from_body=Pose(np.eye(3), np.array([x, 0, 0.5])))
        view = View(SceneState(), CAMERA, EYE, shapes=(ball, LINE))
        for one, other in zip(
            draw_view(drawing, view, memory=memory), draw_view(drawing, view), strict=True
        ):
            np.testing.assert_array_equal(one, other)
    drawing.close()
