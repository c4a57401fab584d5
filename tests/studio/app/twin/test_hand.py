"""A drag or throw is one step of undo; undo puts back, in the document and in the physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from devices.clock import ManualClock
from scenes.pose import Pose
from scenes.state import SceneState
from sim.physics.scanned.objects import FRICTION
from studio.app.model.documents.added_mesh import Geometry
from studio.app.model.documents.document_file import document_to_text
from studio.app.twin.additions import mesh_added, primitive_added
from studio.app.twin.bodies import physical_pose, virtual_of
from studio.app.twin.edits import EditError, moved
from studio.app.twin.hand import SETTLED_NS, TwinPhysics
from studio.app.twin.sizes import resized
from studio.app.viewport.by_hand.items import boxes_of
from studio.app.viewport.drawing.shapes import Shown, shapes_of

BOOK = "book-1"


@pytest.fixture
def hand(bench):
    made = TwinPhysics(bench, ManualClock())
    yield made
    made.close()
    made.join()


def table_geometry(scale: float = 1.0) -> Geometry:
    """A top of 0.8 m × 0.5 m at 0.6 m, on four legs."""
    top = trimesh.creation.box(extents=(0.8, 0.5, 0.04))
    top.apply_translation((0.0, 0.0, 0.58))
    parts = [top]
    for x in (-0.36, 0.36):
        for y in (-0.21, 0.21):
            leg = trimesh.creation.box(extents=(0.05, 0.05, 0.56))
            leg.apply_translation((x, y, 0.28))
            parts.append(leg)
    whole = trimesh.util.concatenate(parts)
    vertices = (scale * whole.vertices).astype(np.float32)
    return Geometry(vertices, whole.faces.astype(np.int32), np.full(vertices.shape, 90, np.uint8))


def scanned(desk):
    return {item.object_id: item.world_from_object for item in desk.objects}


def test_a_body_that_is_dragged_to_another_size_is_made_once(hand, bench, until, monkeypatch):
    made = []
    monkeypatch.setattr(
        "studio.app.twin.hand.virtual_of", lambda item: made.append(item.size_m) or virtual_of(item)
    )
    document, box = primitive_added(bench.document, {}, shape="box", place=(0.0, 0.6, 0.0))
    bench.show_document(document)
    hand.grab(BOOK, bench.scene.object_by_id(BOOK).world_from_object.translation)
    hand.release()
    until(lambda: made, hand.poll)
    for side in (0.31, 0.4, 0.5):
        bench.show_document(resized(bench.document, box, (side, side, side)))
        hand.poll()
    hand._clock.sleep_until(hand._clock.now_ns() + SETTLED_NS)
    until(lambda: len(made) > 1, hand.poll)
    for _ in range(20):
        hand.poll()
    assert made == [(0.3, 0.3, 0.3), (0.5, 0.5, 0.5)]


def test_a_throw_is_one_step_and_undo_puts_everything_back(hand, bench, desk, until):
    before, start = document_to_text(bench.document), scanned(desk)[BOOK].translation
    assert hand.grab(BOOK, start)
    assert hand.grabbed == BOOK
    hand.drag(start + np.array([0.05, 0.0, 0.4]))
    until(lambda: BOOK in bench.state.objects, hand.poll)  # it is seen while it moves
    assert not bench.history.changes
    hand.release()
    until(lambda: not hand.is_busy, hand.poll)
    assert [change.label for change in bench.history.changes] == ["Throw book-1"]
    pose = bench.document.twin.poses[BOOK]
    assert np.array_equal(bench.state.objects[BOOK].world_from_object.matrix(), pose.matrix())
    assert bench.is_by_hand
    assert bench.trace()[-1].startswith("twin.put")
    bench.history.undo()
    assert document_to_text(bench.document) == before
    # The physics has it where it was, too: the next grab of it begins there.
    assert hand.grab(BOOK, start)
    hand.release()
    until(lambda: not hand.is_busy, hand.poll)
    place = bench.document.twin.poses.get(BOOK, scanned(desk)[BOOK]).translation
    assert np.linalg.norm(place - start) < 0.01


def test_a_click_is_no_step(hand, bench, desk, until):
    hand.grab(BOOK, scanned(desk)[BOOK].translation)
    hand.release()
    until(lambda: not hand.is_busy, hand.poll)
    hand.grab(BOOK, scanned(desk)[BOOK].translation)
    count = len(bench.history.changes)
    hand.release()
    until(lambda: not hand.is_busy, hand.poll)
    assert len(bench.history.changes) == count


def test_a_primitive_of_the_document_is_thrown_like_an_object(hand, bench, desk, until):
    document, ball = primitive_added(
        bench.document, scanned(desk), shape="ball", place=(0.0, -1.0, 1.0), size_m=(0.2,) * 3
    )
    bench.change("Add ball", document)
    hand.throw(ball, (0.3, 0.0, 0.0))
    until(lambda: not hand.is_busy, hand.poll)
    pose = physical_pose(bench.document.twin.primitives[ball])
    assert pose.translation[2] == pytest.approx(0.1, abs=0.005)
    assert pose.translation[0] > 0.1
    bench.history.undo()
    assert bench.document.twin.primitives[ball].world_from_primitive.translation[2] == 1.0
    bench.history.undo()
    with pytest.raises(EditError, match=ball):
        hand.throw(ball, (0, 0, 1))


def test_a_body_is_drawn_where_it_flies(hand, bench, desk, until):
    document, ball = primitive_added(
        bench.document, scanned(desk), shape="ball", place=(0.0, -1.0, 1.0), size_m=(0.2,) * 3
    )
    bench.change("Add ball", document)
    hand.throw(ball, (0.3, 0.0, 0.0))
    until(lambda: ball in bench.state.objects, hand.poll)
    flying = bench.state.objects[ball].world_from_object
    drawn = shapes_of(bench.state, shown=Shown(), twin=bench.document.twin, world_from_rig=None)
    (solid,) = (shape for shape in drawn if shape.key == f"body {ball}")
    middle = flying @ np.array([0.0, 0.0, 0.1])
    assert np.allclose(solid.world_from_body.translation, middle)
    assert not np.allclose(flying.translation, (0.0, -1.0, 1.0), atol=1e-4)
    assert np.allclose(boxes_of(bench)[ball][0].matrix(), flying.matrix())
    until(lambda: not hand.is_busy, hand.poll)


def test_a_mesh_falls_and_stands_as_it_is_shaped(hand, bench, desk, until):
    """A table of a top and four legs: it lands on its feet, and a ball rolls under its top."""
    table = table_geometry()
    document, item = mesh_added(
        bench.document, scanned(desk), geometry=table, source="table.ply", place=(0.0, -1.0, 0.4)
    )
    bench.change("Add table", document)
    hand.resume()
    until(lambda: not hand.is_busy, hand.poll)
    stands = bench.document.twin.meshes[item].world_from_mesh
    assert stands.translation[2] == pytest.approx(0.0, abs=0.01)
    assert stands.rotation[2, 2] > 0.999
    document, ball = primitive_added(
        bench.document, scanned(desk), shape="ball", place=(0.0, -1.0, 0.15), size_m=(0.2,) * 3
    )
    bench.change("Add ball", document)
    hand.resume()
    until(lambda: not hand.is_busy, hand.poll)
    under = physical_pose(bench.document.twin.primitives[ball]).translation
    assert np.abs(under - (0.0, -1.0, 0.1)).max() < 0.05
    hand.throw(item, (0.8, 0.0, 0.0))
    until(lambda: not hand.is_busy, hand.poll)
    slid_m = bench.document.twin.meshes[item].world_from_mesh.translation[0]
    assert slid_m == pytest.approx(0.8**2 / (2 * FRICTION * 9.81), abs=0.015)
    bench.history.undo()
    assert np.array_equal(
        bench.document.twin.meshes[item].world_from_mesh.matrix(), stands.matrix()
    )


def test_a_mesh_as_large_as_a_building_is_no_body(hand, bench, desk):
    walls = table_geometry(scale=5.0)
    document, item = mesh_added(
        bench.document, scanned(desk), geometry=walls, source="walls.ply", place=(0.0, 0.0, 0.0)
    )
    bench.change("Add walls", document)
    with pytest.raises(EditError, match=f"{item}.*as large as a building"):
        hand.throw(item, (0.0, 0.0, 1.0))


def test_what_was_put_into_the_air_falls_when_physics_goes_on(hand, bench, desk, until):
    start = scanned(desk)[BOOK].translation
    bench.change("Move", moved(bench.document, scanned(desk), BOOK, start + np.array([0, 0, 0.5])))
    hand.resume()
    until(lambda: not hand.is_busy, hand.poll)
    assert bench.document.twin.poses[BOOK].translation[2] == pytest.approx(start[2], abs=0.01)
    assert bench.history.changes[-1].label == "Let fall objects"


def test_reset_puts_back_what_is_moving(hand, bench, desk, until):
    hand.throw(BOOK, (0.0, 0.0, 2.0))
    until(lambda: BOOK in bench.state.objects, hand.poll)
    hand.reset()
    assert not hand.is_busy
    assert BOOK not in bench.state.objects
    assert not bench.history.changes


def test_nothing_is_grabbed_while_a_session_decides(hand, bench, desk):
    bench.show_state(SceneState())
    assert not hand.grab(BOOK, (0, 0, 0))
    assert "session" in bench.log.lines()[-1].text
    bench.show_state(None)
    assert not hand.grab("piano", (0, 0, 0))
    assert not hand.grab(BOOK, (0, 0, float("nan")))
    with pytest.raises(EditError, match="velocity"):
        hand.throw(BOOK, "up")
    bench.show_scene(replace(desk, physical=None, collision=None))
    assert not hand.grab(BOOK, (0, 0, 0))
    assert "collision mesh" in bench.log.lines()[-1].text
    hand.drag((0, 0, 1))
    hand.release()
    assert not hand.is_busy


def test_another_scene_ends_what_moves(hand, bench, desk, until):
    hand.throw(BOOK, (0.0, 0.0, 2.0))
    until(lambda: BOOK in bench.state.objects, hand.poll)
    bench.show_scene(replace(desk, name="other"))
    assert not hand.is_busy
    assert bench.is_by_hand
    hand.throw(BOOK, (0.5, 0.0, 1.0))
    until(lambda: not hand.is_busy, hand.poll)
    assert isinstance(bench.document.twin.poses[BOOK], Pose)
