"""Entities on the wire and in the session, there and back."""

import numpy as np
import pytest

from devices.hub.entities.drawn import ROOM, Drawn, drawn_by_room, drawn_entity
from devices.hub.roles import Op
from scenes.pose import Pose, rotation_from_vector
from scenes.state import (
    Annotation,
    LiveSurface,
    Proposal,
    SceneState,
    SharedPrimitive,
    id_of,
    is_there,
    reduce_state,
)

SQUARE = np.array([[0, 1, 0], [2, 1, 0], [2, 0, 0], [0, 0, 0]], dtype=float)
POSE = Pose(rotation_from_vector([0.1, 0.9, -0.3]), np.array([1.0, 2.0, 3.0]))


def test_on_the_wire_y_is_up_and_z_in_the_session():
    drawn = Drawn(Op.LINE, "p1/a", "p1", np.array([[1.0, 2.0, 3.0]]), (0.1, 0.2, 0.3))
    annotation = drawn.entity()
    np.testing.assert_allclose(annotation.points_in_world, [[1, -3, 2]])
    assert (annotation.annotation_id, annotation.user_id) == ("p1/a", "p1")
    back = drawn_entity(annotation)
    assert back.entry() == {**drawn.entry(), "by": "room"}
    assert drawn.entry()["points"] == [[1, 2, 3]]


def test_a_surface_asks_for_a_picture_of_its_shape():
    made = Drawn(Op.SURFACE, "p1/s", "p1", SQUARE).entity()
    assert made.size_px == (1024, 512)
    np.testing.assert_allclose(made.corners_in_world[0], [0, 0, 1])
    back = drawn_entity(made)
    assert back.entry()["corners"] == SQUARE.tolist()
    assert Drawn(Op.SURFACE, "p1/s", "p1", np.zeros((4, 3))).entity().size_px == (16, 16)
    assert Drawn(Op.SURFACE, "p1/s", "p1", np.zeros((0, 3))).entity().corners_in_world.shape == (
        0,
        3,
    )


def test_what_the_room_draws_itself_is_found():
    mine = Annotation("a", "designer", np.zeros((2, 3)), (1, 1, 1))
    theirs = Annotation("p1/a", "p1", np.zeros((2, 3)), (1, 1, 1))
    screen = LiveSurface("tv", SQUARE, (16, 16), "cam")
    empty = SceneState()
    state = empty
    for change in (mine, theirs, screen):
        state = reduce_state(state, change, 0)

    def between(before, after):
        found = drawn_by_room(before, after, is_known=lambda _name, value: value is theirs)
        return [(it.op, it.key, it.by, len(it.points)) for it in found]

    assert between(empty, state) == [
        (Op.LINE, "a", ROOM, 2),
        (Op.SURFACE, "tv", ROOM, 4),
    ]
    assert between(state, state) == []
    assert sorted(between(state, empty)) == [
        (Op.LINE, "a", ROOM, 0),
        (Op.LINE, "p1/a", ROOM, 0),
        (Op.SURFACE, "tv", ROOM, 0),
    ]


THINGS = (
    Drawn(Op.LINE, "p1/l", ROOM, SQUARE, room_from_entity=POSE, object_id="chair-1"),
    Drawn(Op.SURFACE, "p1/s", ROOM, SQUARE, seen=SQUARE + 1),
    Drawn(Op.PRIMITIVE, "p1/b", "p1", shape="arrow", size_m=(0.5, 0.1, 0.2), room_from_entity=POSE),
    Drawn(Op.PROPOSE, "p1/c", "p1", room_from_entity=POSE, object_id="chair-1", name="Ann"),
)


@pytest.mark.parametrize("drawn", THINGS, ids=lambda it: it.op)
def test_a_thing_comes_back_from_the_session_as_it_was(drawn):
    entity = drawn.entity()
    assert id_of(entity) == drawn.key
    assert is_there(entity)
    assert drawn_entity(entity).entry() == drawn.entry()
    assert drawn.is_finite
    gone = Drawn(drawn.op, drawn.key, "p1")
    assert not gone.is_there
    assert not is_there(gone.entity())


def test_up_and_ahead_of_a_primitive_are_the_same_in_the_session():
    """On the wire y is up and an arrow points along +x; in the session z is up."""
    turned = Pose(rotation_from_vector([0, np.pi / 2, 0]), np.array([1.0, 0.5, -3.0]))
    drawn = Drawn(
        Op.PRIMITIVE, "k", "p1", shape="arrow", size_m=(0.5, 0.1, 0.2), room_from_entity=turned
    )
    body = drawn.entity()
    assert body.size_m == (0.5, 0.2, 0.1)
    np.testing.assert_allclose(body.world_from_primitive.translation, [1, 3, 0.5], atol=1e-12)
    np.testing.assert_allclose(body.world_from_primitive.yaw(), np.pi / 2)
    np.testing.assert_allclose(body.world_from_primitive.rotation[:, 2], [0, 0, 1], atol=1e-12)


def test_numbers_that_cannot_be_sent_are_found():
    assert not Drawn(Op.LINE, "a", "p1", np.array([[np.nan, 0, 0]])).is_finite
    assert not Drawn(Op.SURFACE, "a", "p1", SQUARE, seen=np.full((4, 3), np.inf)).is_finite


def test_primitives_and_proposals_of_the_session_keep_their_owner():
    state = SceneState()
    body = SharedPrimitive("p1/b", "p1", "box", (1, 1, 1), (1, 0, 0), POSE)
    copy = Proposal("p2/c", "p2", "Ben", "chair-1", POSE)
    after = reduce_state(reduce_state(state, body, 0), copy, 0)
    found = list(drawn_by_room(state, after, is_known=lambda *_value: False))
    assert [(it.op, it.by, it.is_there) for it in found] == [
        (Op.PRIMITIVE, "p1", True),
        (Op.PROPOSE, "p2", True),
    ]
    gone = list(drawn_by_room(after, state, is_known=lambda *_value: False))
    assert [(it.op, it.is_there) for it in gone] == [(Op.PRIMITIVE, False), (Op.PROPOSE, False)]
