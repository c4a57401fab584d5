"""Meshes of files: read, held to limits, added, moved, saved with the project, taken away."""

import numpy as np
import pytest
import trimesh

from devices.clock import WallClock
from studio.app.model.documents.document_file import load_document, save_document
from studio.app.twin import mesh_file
from studio.app.twin.additions import mesh_added
from studio.app.twin.edits import EditError, moved, pose_of, removed, turned
from studio.app.twin.hand import TwinPhysics
from studio.app.twin.items import items_of
from studio.app.twin.mesh_file import OtherUnitError, read_geometry
from studio.app.twin.twin_actions import add_twin_actions

SIDES = (0.4, 0.6, 0.9)
GREY = (0.5, 0.5, 0.5)


def box(path, scale=1.0):
    trimesh.creation.box(np.array(SIDES) * scale).export(path)
    return path


@pytest.mark.parametrize("suffix", ["stl", "ply", "glb", "obj", "off"])
def test_every_format_stands_upright_on_its_base(tmp_path, suffix):
    geometry = read_geometry(box(tmp_path / f"a.{suffix}"), fallback=GREY)
    is_y_up = suffix in ("glb", "obj")
    assert geometry.size_m == pytest.approx((0.4, 0.9, 0.6) if is_y_up else SIDES)
    low, high = geometry.vertices.min(axis=0), geometry.vertices.max(axis=0)
    assert low[2] == pytest.approx(0.0)
    assert (low + high)[:2] == pytest.approx((0, 0), abs=1e-6)
    assert (geometry.colours == 127).all()


def test_triangles_keep_facing_outwards(tmp_path):
    for up in ("y", "z"):
        geometry = read_geometry(box(tmp_path / "a.stl"), up=up, fallback=GREY)
        a, b, c = (geometry.vertices[geometry.faces[:, i]].astype(float) for i in range(3))
        assert (np.cross(a, b) * c).sum() / 6 == pytest.approx(np.prod(SIDES), rel=1e-4)


def test_colours_of_the_file_are_kept(tmp_path):
    mesh = trimesh.creation.box(SIDES)
    mesh.visual.vertex_colors = np.tile([200, 30, 40, 255], (8, 1))
    mesh.export(tmp_path / "a.ply")
    geometry = read_geometry(tmp_path / "a.ply", fallback=GREY)
    assert (geometry.colours == (200, 30, 40)).all()


def test_another_unit_is_named_with_the_size_it_would_give(tmp_path):
    path = box(tmp_path / "chair.stl", 1000.0)
    with pytest.raises(EditError) as error:
        read_geometry(path, fallback=GREY)
    text = str(error.value)
    assert text.startswith("chair.stl: 400 × 600 × 900 m if its unit is m")
    assert "limits of the longest side 0.01 to 20 m" in text
    assert "unit=mm (0.4 × 0.6 × 0.9 m)" in text
    assert read_geometry(path, unit="mm", fallback=GREY).size_m == pytest.approx(SIDES)
    assert error.value.likely == "mm"
    box(path, 1e6)
    with pytest.raises(OtherUnitError, match="scale it in a modelling program") as error:
        read_geometry(path, fallback=GREY)
    assert error.value.likely == ""


def test_what_cannot_be_read_is_refused_with_the_remedy(tmp_path, monkeypatch):
    def refused(name, content=None):
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(EditError) as error:
            read_geometry(tmp_path / name, fallback=GREY)
        return str(error.value)

    assert "there is no such file" in refused("gone.obj")
    assert "wanted a mesh" in refused("letter.docx", b"x")
    assert "a.glb: is no mesh that can be read" in refused("a.glb", b"glTF but not really")
    assert "export it" in refused("points.obj", b"v 0 0 0\nv 1 0 0\n")
    box(tmp_path / "b.stl")
    monkeypatch.setattr(mesh_file, "MAX_TRIANGLES", 11)
    assert "12 triangles, limit 11; reduce it" in refused("b.stl")
    monkeypatch.setattr(mesh_file, "MAX_BYTES", 10)
    assert "limit 0 MB; reduce it" in refused("b.stl")
    with pytest.raises(EditError, match="unit 'parsec', wanted one of m, cm"):
        read_geometry(tmp_path / "b.stl", unit="parsec", fallback=GREY)


def test_a_mesh_is_moved_turned_saved_and_taken_away(bench, tmp_path):
    geometry = read_geometry(box(tmp_path / "a.stl"), fallback=GREY)
    document, mesh_id = mesh_added(
        bench.document, {}, geometry, source="a.stl", place=(0.1, 0.2, 0.0)
    )
    document = turned(moved(document, {}, mesh_id, (1.0, 0.5, 0.1)), {}, mesh_id, 0.7)
    save_document(document, tmp_path / "room.nexus")
    again = load_document(tmp_path / "room.nexus")
    assert pose_of(again, {}, mesh_id).translation == pytest.approx((1.0, 0.5, 0.1))
    kept = again.twin.meshes[mesh_id]
    assert np.array_equal(kept.geometry.vertices, geometry.vertices)
    assert np.array_equal(kept.geometry.faces, geometry.faces)
    assert document.twin.meshes[mesh_id].geometry is geometry
    (item,) = [i for i in items_of(None, again, bench.state, is_by_hand=True)]
    assert (item.name, item.state) == ("mesh-1", "a.stl")
    assert item.yaw_deg == pytest.approx(np.degrees(0.7))
    assert removed(again, {}, mesh_id).twin.meshes == {}


def test_the_action_reads_beside_the_window_and_is_one_step(bench, tmp_path, until):
    editing = add_twin_actions(bench, TwinPhysics(bench, WallClock()))
    assert bench.do("twin.add_mesh", path=str(box(tmp_path / "a.glb")), place=[0.2, 0.1, 0.0])
    assert bench.busy
    until(lambda: not bench.busy, editing.poll)
    assert bench.selection == "mesh-1"
    assert len(bench.history.changes) == 1
    assert "0.400 × 0.900 × 0.600 m" in bench.log.lines()[-1].text
    bench.history.undo()
    assert bench.document.twin.meshes == {}
    bench.do("twin.add_mesh", path=str(box(tmp_path / "drawn.stl", 1000.0)))
    until(lambda: not bench.busy, editing.poll)
    assert bench.document.twin.meshes["mesh-1"].unit == "mm", "in metres it would fit no room"
    bench.do("twin.add_mesh", path=str(tmp_path / "gone.obj"))
    until(lambda: not bench.busy, editing.poll)
    assert "gone.obj: there is no such file" in bench.log.lines("error")[-1].text
    assert bench.do("twin.add_mesh"), "no file was chosen: nothing happens"
    assert not bench.busy


def test_a_mesh_is_picked_and_placed_in_the_view(bench, tmp_path):
    from studio.app.viewport.by_hand.items import boxes_of
    from studio.app.viewport.by_hand.items import pose_of as shown_pose_of

    geometry = read_geometry(box(tmp_path / "a.stl"), fallback=GREY)
    document, mesh_id = mesh_added(bench.document, {}, geometry, source="a", place=(0, 0, 0))
    bench.show_document(document)
    add_twin_actions(bench, TwinPhysics(bench, WallClock()))
    assert bench.do("twin.place", item=mesh_id, x=0.5, yaw_deg=20, tilt_x_deg=30)
    assert shown_pose_of(bench, mesh_id).translation == pytest.approx((0.5, 0, 0))
    assert boxes_of(bench)[mesh_id][1] == pytest.approx(SIDES)
    bench.history.undo()
    assert shown_pose_of(bench, mesh_id).translation == pytest.approx((0, 0, 0))
