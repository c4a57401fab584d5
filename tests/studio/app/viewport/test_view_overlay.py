"""Labels over a view can all be read."""

import numpy as np
import pytest
from PySide6.QtGui import QImage, QPainter

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import Avatar, Proposal, SceneState, TrackedObject, TrackState
from studio.app.model.documents.document import Document, TwinEdits
from studio.app.viewport.view_overlay import Overlay
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def test_labels_of_people_who_stand_together_are_above_one_another(qapp, monkeypatch):
    image = QImage(400, 300, QImage.Format.Format_RGB32)
    painter = QPainter(image)
    overlay = Overlay(
        painter,
        Pinhole.from_fov(400, 300, 1.0),
        look_at(np.array([0.0, -4.0, 1.7]), np.array([0.0, 0.0, 1.7])),
    )
    people = {}
    for name, x in (("ana", 0.0), ("benjamin", 0.05), ("caroline", 0.1)):
        head = look_at(np.array([x, 0.0, 1.65]), np.array([0.0, 5.0, 1.65]))
        people[name] = Avatar(name, "remote", head)
    twin = TwinEdits(names={"ana": "Ana Maria", "chair-1": "Grandma's chair"})
    chair = TrackedObject("chair-1", 0, Pose.identity(), np.eye(4), 1.0, TrackState.TRACKED, 1.0, 0)
    state = SceneState(avatars=people, objects={"chair-1": chair})
    words = []
    monkeypatch.setattr(overlay, "words", lambda at, text, colour: words.append(text))
    placed = overlay.label_all(state, Document("lab", twin=twin), None, people=True)
    painter.end()
    assert len(placed) == 4
    for at, area in enumerate(placed):
        assert not any(area.intersects(other) for other in placed[:at])
    # Named as the user named them, wherever a name stands.
    assert {"Ana Maria", "benjamin", "caroline", "● Grandma's chair tracked"} == set(words)


def test_people_and_proposals_are_called_by_the_names_of_people(qapp, monkeypatch, tiny):
    image = QImage(400, 300, QImage.Format.Format_RGB32)
    painter = QPainter(image)
    eye = look_at(np.array([0.0, -4.0, 1.7]), np.array([0.0, 0.0, 0.5]))
    overlay = Overlay(painter, Pinhole.from_fov(400, 300, 1.2), eye)
    item = tiny.scene.objects[0]
    head = look_at(np.array([-0.8, 0.0, 1.65]), np.array([0.0, 5.0, 1.65]))
    ann = Avatar("p1", "remote", head, name="Ann 1")
    far, near = (Pose.from_yaw(0.0, (x, 0.0, 0.0)) for x in (0.9, -0.4))
    state = SceneState(
        avatars={"p1": ann},
        proposals={
            "a": Proposal("a", "p1", "", item.object_id, far),
            "b": Proposal("b", "p7", "Ben 2", item.object_id, near),
        },
        objects={
            item.object_id: TrackedObject(
                item.object_id, 0, near, np.eye(4), 1.0, TrackState.STATIC, 1.0, 0
            )
        },
    )
    words = []
    monkeypatch.setattr(overlay, "words", lambda at, text, colour: words.append(text))
    overlay.label_all(state, Document("tiny"), tiny.scene, people=True)
    painter.end()
    called = item.name
    assert set(words) == {
        "Ann 1",
        f"Ann 1: {called} here",
        f"✔ {called} stands as proposed by Ben 2",
    }


def test_a_ring_is_painted_around_what_somebody_points_at(qapp, tiny):
    eye = np.array([0.0, 0.0, 1.6])
    item = tiny.scene.objects[0]
    middle = item.world_from_object @ np.array([0.0, 0.0, 0.4])

    def painted(ray):
        image = QImage(400, 300, QImage.Format.Format_RGB32)
        image.fill(0)
        painter = QPainter(image)
        camera = look_at(np.array([0.5, -3.0, 2.0]), middle)
        overlay = Overlay(painter, Pinhole.from_fov(400, 300, 1.0), camera)
        person = Avatar("p1", "remote", look_at(eye, middle), ray=ray)
        overlay.attention(SceneState(avatars={"p1": person}), tiny.scene)
        painter.end()
        rows = [
            (x, y) for y in range(300) for x in range(400) if image.pixelColor(x, y).red() > 200
        ]
        return np.array(rows).reshape(-1, 2)

    assert len(painted(None)) == 0
    ring = painted(np.stack([eye, middle]))
    width, height = np.ptp(ring, axis=0)
    assert width > 60  # an ellipse about the chair's foot, seen from above its height
    assert 15 < height < width
