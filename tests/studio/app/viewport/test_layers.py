"""Layers of the view: errors by place on the floor, the collision mesh, and what a user hides."""

import time

import numpy as np
import pytest

from scenes.mesh import BoxPart
from scenes.opening import open_scene
from scenes.pose import Pose
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings, load_settings, save_settings
from studio.app.model.workbench import Workbench
from studio.app.viewport import layers as layers_module
from studio.app.viewport.drawing.floor_errors import STOPS, colours_of, drawn_cells, floor_errors
from studio.app.viewport.drawing.shapes import Shown
from studio.app.viewport.layers import Layers, boxes_mesh, collision_mesh


class NoHistory:
    def push(self, change): ...

    def clear(self): ...


@pytest.fixture(scope="module")
def desk():
    return open_scene("desk")


@pytest.fixture
def bench(desk):
    made = Workbench(Document("desk"), Settings(), NoHistory())
    made.show_scene(desk)
    return made


def until_made(layers):
    end = time.monotonic() + 120
    while not layers.poll():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)


def test_squares_lie_where_the_errors_were_and_are_as_coloured_as_they_are_large():
    means_m = np.full((3, 4), np.nan)
    means_m[0, 1], means_m[2, 3] = 0.01, 0.05
    drawn = drawn_cells(means_m, np.array([-1.0, 2.0]), cell_m=0.5)
    centres = drawn.squares.corners.mean(axis=1)
    assert centres[:, :2] == pytest.approx(np.array([[-0.25, 2.25], [0.75, 3.25]]))
    assert (drawn.top_m, drawn.worst_m) == (0.05, 0.05)
    assert drawn.squares.colours[1] == pytest.approx(STOPS[-1])
    assert drawn.squares.colours[0] == pytest.approx(colours_of(np.array([0.2]))[0])
    assert np.ptp(drawn.squares.corners[0, :, 0]) < 0.5


def test_millimetres_do_not_look_like_faults():
    drawn = drawn_cells(np.array([[0.003]]), np.zeros(2), cell_m=0.25)
    assert drawn.top_m == pytest.approx(0.02)
    assert drawn.worst_m == pytest.approx(0.003)


def test_a_recording_without_errors_says_what_to_do(bench, desk, monkeypatch):
    from studio.compare import run
    from studio.evaluate.scores import ScoreBoard

    monkeypatch.setattr(run, "read_board", lambda _path, scene: ScoreBoard(scene.objects))
    with pytest.raises(ValueError, match="rehearse a scenario that moves something"):
        floor_errors(desk, desk)


def test_the_floor_shows_the_open_recording_and_nothing_else(bench, monkeypatch, tmp_path):
    asked = []

    def made(recording, _scene):
        asked.append(recording)
        return drawn_cells(np.array([[0.03]]), np.zeros(2), cell_m=0.25)

    monkeypatch.setattr(layers_module, "floor_errors", made)
    layers = Layers(bench)
    bench.open_recording(tmp_path / "a.mcap")
    assert asked == []
    bench.set(layers={"errors": True})
    until_made(layers)
    assert [shape.key for shape in layers.shapes()] == ["floor errors"]
    bench.set(theme="light")
    assert asked == [tmp_path / "a.mcap"]
    bench.set(layers={"errors": False})
    assert layers.shapes() == []
    bench.set(layers={"errors": True})
    assert len(layers.shapes()) == 1
    bench.open_recording(None)
    assert layers.shapes() == []


def test_why_there_are_no_errors_is_in_the_log(bench, tmp_path):
    layers = Layers(bench)
    bench.set(layers={"errors": True})
    bench.open_recording(tmp_path / "gone.mcap")
    until_made(layers)
    assert "gone.mcap" in bench.log.lines("warning")[-1].text


def test_a_rooms_boxes_are_its_collision_mesh(bench, desk):
    layers = Layers(bench)
    bench.set(layers={"collision": True})
    until_made(layers)
    (wire,) = layers.shapes()
    assert np.array_equal(wire.mesh.vertices, collision_mesh(desk).vertices)
    bench.show_scene(None)
    assert layers.shapes() == []


def test_boxes_are_closed_and_face_outwards():
    pose = Pose.from_yaw(0.4, (1.0, 2.0, 0.5))
    mesh = boxes_mesh([BoxPart(pose, (0.5, 0.3, 0.2)), BoxPart(pose, (0.1, 0.1, 0.1))])
    a, b, c = (mesh.vertices[mesh.faces[:, i]].astype(float) for i in range(3))
    volume = (np.cross(a, b) * c).sum() / 6.0
    assert volume == pytest.approx(8 * (0.5 * 0.3 * 0.2 + 0.001), rel=1e-4)


def test_what_is_hidden_stays_hidden_the_next_time(tmp_path):
    settings = Settings(layers={"labels": False, "collision": True})
    save_settings(settings, tmp_path / "settings.json")
    found, problem = load_settings(tmp_path / "settings.json")
    assert problem == ""
    shown = Shown.of(found.layers)
    assert (shown.labels, shown.collision, shown.avatars) == (False, True, True)
    assert Shown.of({"of a newer version": True}) == Shown()


def test_unseen_sides_are_measured_when_they_are_wanted_and_move_with_objects(bench, monkeypatch):
    from dataclasses import replace

    from scenes.coverage.record import Coverage

    asked = []

    def measured(scene, object_id, *, renderer):
        asked.append(object_id)
        item = scene.object_by_id(object_id)
        nothing = np.zeros(len(item.splats))
        seen = replace(item, coverage=Coverage(nothing, nothing, np.zeros(6)))
        others = tuple(seen if o.object_id == object_id else o for o in scene.objects)
        return replace(scene, objects=others)

    monkeypatch.setattr(layers_module, "with_coverage", measured)
    layers = Layers(bench)
    assert layers.shapes() == []
    bench.set(layers={"unseen": True})
    until_made(layers)
    ids = [item.object_id for item in bench.scene.objects]
    assert asked == ids
    first = layers.shapes()
    assert [shape.key for shape in first] == [f"unseen {object_id}" for object_id in ids]
    assert all(a is b for a, b in zip(first, layers.shapes(), strict=True))
    bench.show_scene(None)
    assert layers.shapes() == []
