"""Whose view can be shown, where their eyes are, and that nobody sees their own head."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import Avatar, SceneState
from sim.people.posture import PART_NAMES, Posture, head_camera, part_poses
from studio.app.model.documents.document import Document, Primitive, TwinEdits
from studio.app.viewport.drawing.scene_drawing import SceneDrawing
from studio.app.viewport.drawing.shapes import Shown, shapes_of
from studio.app.viewport.drawing.view_picture import View, draw_view
from studio.app.viewport.insets.sources import eyes_of, sources_of, title_of

EYE = np.array([0.0, -1.0, 1.6])
HEAD = look_at(EYE, np.array([0.0, 1.0, 1.6]))
HANDS = (np.array([[0.15, -0.4, 1.5]]),)
ANA = Avatar("ana", "remote", HEAD, HANDS)
STATE = SceneState(avatars={"ana": ANA})
CAMERA = Pinhole.from_fov(160, 90, 1.1)


@pytest.fixture(scope="module")
def drawing(tiny):
    made = SceneDrawing(tiny.scene)
    yield made
    made.close()


def test_a_persons_eyes_are_those_of_their_head():
    assert eyes_of("ana", STATE, Document("tiny"), None) is HEAD


def test_the_head_of_a_person_of_a_scenario_is_taken_between_the_eyes():
    """Figures are drawn with eyes 13 cm above the neck, in front of the skull's axis."""
    hands = np.array([0.0, 0.2, 0.8]), np.array([0.0, -0.2, 0.8])
    posture = Posture(np.array([1.0, 2.0]), 0.5 * np.pi, 0.0, 0.0, 0.0, 0.0, *hands)
    neck = part_poses(posture)[PART_NAMES.index("head")]
    eyes = head_camera(neck)
    assert eyes.translation[2] - neck.translation[2] == pytest.approx(0.13, abs=0.005)
    assert 1.5 < eyes.translation[2] < 1.75
    assert eyes.rotation[:, 2] == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)  # looks along +y
    assert eyes.rotation[:, 1] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)  # and is upright


def test_cameras_bodies_and_objects_have_eyes(tiny):
    camera = look_at(np.array([1.0, 1.0, 2.0]), np.zeros(3))
    body = Primitive("box-1", "box", (0.4, 0.4, 1.0), (1, 1, 1), Pose.identity())
    twin = TwinEdits(cameras={"cam-1": camera}, primitives={"box-1": body})
    document = replace(Document("tiny"), twin=twin)
    assert eyes_of("cam-1", STATE, document, None) is camera
    above = eyes_of("box-1", STATE, document, None)
    assert above is not None
    assert 1.0 < above.translation[2] < 1.3
    first = tiny.scene.objects[0]
    scanned = eyes_of(first.object_id, STATE, document, tiny.scene)
    assert scanned is not None
    assert scanned.translation[2] > first.world_from_object.translation[2] + first.box_m[2]
    assert eyes_of("nobody", STATE, document, tiny.scene) is None
    known = sources_of(STATE, document, tiny.scene)
    assert known[:3] == ("camera", "ana", "cam-1")
    assert {first.object_id, "box-1"} <= set(known)


def test_titles_say_who_sees():
    assert title_of("ana", "Ana Maria") == "what Ana Maria sees"
    assert title_of("camera", "360° camera") == "360° camera, front lens"


def seen(drawing, state, seen_by, twin):
    shapes = shapes_of(state, shown=Shown(), twin=twin, world_from_rig=None, seen_by=seen_by)
    return draw_view(drawing, View(state, CAMERA, HEAD, (), tuple(shapes), seen_by=seen_by))[0]


@pytest.mark.parametrize("has_opengl", [True, False])
def test_nobody_sees_their_own_head(drawing, has_opengl, monkeypatch):
    if has_opengl:
        drawing.prepare()
    else:
        monkeypatch.setattr(SceneDrawing, "meshes", None)
    bare = replace(STATE, avatars={"ana": replace(ANA, hands=())})
    empty = seen(drawing, SceneState(), "", TwinEdits())
    assert np.array_equal(seen(drawing, bare, "ana", TwinEdits()), empty)
    # Another's head is seen, a step before the eyes.
    ahead = Pose(HEAD.rotation, HEAD @ np.array([0.0, 0.0, 1.0]))
    other = replace(STATE, avatars={"ana": replace(ANA, hands=(), world_from_head=ahead)})
    assert not np.array_equal(seen(drawing, other, "", TwinEdits()), empty)


def test_people_see_their_own_hands_and_what_is_before_them(drawing):
    drawing.prepare()
    red = Primitive(
        "ball-1", "ball", (0.3, 0.3, 0.3), (1.0, 0.0, 0.0), Pose.from_yaw(0.0, (0.0, 0.0, 1.45))
    )
    twin = TwinEdits(primitives={"ball-1": red})
    empty = seen(drawing, SceneState(), "", twin).astype(int)
    own = seen(drawing, STATE, "ana", twin).astype(int)
    row, column = 45, 80
    assert empty[row, column, 0] > 80 + empty[row, column, 1:].max()  # straight ahead
    changed = np.argwhere(np.abs(own - empty).max(axis=2) > 20)
    assert len(changed) > 10
    hand = CAMERA.project(HEAD.inverse() @ HANDS[0])[0][0]
    assert np.abs(changed[:, ::-1] - hand).max(axis=1).min() < 6
    below_and_right = (changed[:, 0] > row) & (changed[:, 1] > column)
    assert below_and_right.mean() > 0.9, "an arm, and nothing of the head"
