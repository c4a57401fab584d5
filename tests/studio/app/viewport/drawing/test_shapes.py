"""Things of people as shapes of a view."""

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import (
    LiveSurface,
    Proposal,
    SceneState,
    SharedPrimitive,
    TrackedObject,
    TrackState,
)
from studio.app.model.documents.document import TwinEdits
from studio.app.viewport.drawing.shapes import (
    Shown,
    proposed_way,
    shapes_of,
    shared_solids,
    surface_outline,
)

PLACE = Pose.from_yaw(np.pi / 2, (1.0, 2.0, 0.5))


def body(shape):
    return SharedPrimitive("b", "p1", shape, (0.6, 0.2, 0.4), (1, 0, 0), PLACE)


@pytest.mark.parametrize(("shape", "form"), [("box", "box"), ("sphere", "ball")])
def test_a_primitive_is_one_body_over_its_base(shape, form):
    (solid,) = shared_solids(body(shape))
    assert (solid.form, solid.size_m) == (form, (0.6, 0.2, 0.4))
    np.testing.assert_allclose(solid.world_from_body.translation, [1.0, 2.0, 0.7])


def test_an_arrow_is_a_shaft_and_a_head_ahead():
    shaft, head = shared_solids(body("arrow"))
    assert (shaft.form, head.form) == ("cylinder", "cone")
    # Turned by 90 degrees its +x is the world's +y.
    ends = (
        head.world_from_body @ np.array([0.5 * head.size_m[0], 0, 0]),
        shaft.world_from_body @ np.array([0, 0, -0.5 * shaft.size_m[2]]),
    )
    np.testing.assert_allclose(ends, [[1.0, 2.3, 0.7], [1.0, 1.7, 0.7]], atol=1e-9)


def test_a_proposal_shows_the_way_until_the_object_is_there():
    proposal = Proposal("c", "p1", "Ann", "chair", PLACE)
    start = Pose.from_yaw(0.0, (0.0, 0.0, 0.0))
    track = TrackedObject("chair", 0, start, np.eye(4), 1.0, TrackState.TRACKED, 1.0, 0)
    away = proposed_way(SceneState(objects={"chair": track}), proposal)
    np.testing.assert_allclose(away.points[:, :2], [[0, 0], [1, 2]])
    there = proposed_way(SceneState(), proposal)
    assert 0.01 < np.linalg.norm(np.diff(there.points, axis=0)) < 0.1


def test_what_people_made_is_shown_with_their_notes_and_hidden_with_them():
    state = SceneState(
        primitives={"b": body("box")}, proposals={"c": Proposal("c", "p", "", "chair", PLACE)}
    )

    def keys(shown):
        found = shapes_of(state, shown=shown, twin=TwinEdits(), world_from_rig=None)
        return {shape.key for shape in found}

    assert keys(Shown()) == {"shared b", "proposal c"}
    assert keys(Shown(annotations=False)) == set()


def test_a_carried_surface_has_its_edge_where_it_is_seen():
    corners = np.array([[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]], dtype=float)
    outline = surface_outline(LiveSurface("s", corners, (16, 16), "cam", corners + 1))
    np.testing.assert_allclose(outline.points[0], [1, 1, 2])
