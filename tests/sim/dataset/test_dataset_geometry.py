"""Views, surfaces, symmetry, visibility, agreement and files of `sim.dataset`, each alone."""

import math

import numpy as np
import pytest

from scenes.cameras import Fisheye, pixel_centres
from scenes.mesh import TexturedMesh
from scenes.pose import Pose
from sim.camera.lens_raster import PixelRect
from sim.dataset.json_stream import JsonList
from sim.dataset.pictures import read_picture, write_lengths, write_rgb
from sim.dataset.truth.agreement import rigid_error
from sim.dataset.truth.lens_truth import LensTruth, Silhouette
from sim.dataset.truth.pinhole_views import ViewSampler, views_in
from sim.dataset.truth.surfaces import (
    joined,
    meshes_of_object,
    read_model_ply,
    read_obj,
    write_model_ply,
    write_obj,
)
from sim.dataset.truth.symmetry import ROUND, yaw_symmetry
from sim.dataset.truth.visibility import OUTSIDE, box_of, seen
from sim.dataset.write import DatasetOptions

LENS = Fisheye.from_fov(400, math.radians(200))


def _prism(sides, radius=0.2, height=0.5):
    turn = 2 * math.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)
    low, high = (np.column_stack([ring, np.full(sides, z)]) for z in (0.0, height))
    k, n = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = np.concatenate(
        [np.stack([k, n, n + sides], axis=1), np.stack([k, n + sides, k + sides], axis=1)]
    )
    return TexturedMesh(
        np.concatenate([low, high]),
        faces.astype(np.int32),
        np.full((2 * sides, 2), 0.5, np.float32),
        np.full((2, 2, 3), 90, np.uint8),
    )


@pytest.mark.parametrize(("sides", "symmetry"), [(3, 3), (4, 4), (5, 5), (64, ROUND)])
def test_a_prism_has_as_many_like_yaws_as_sides(sides, symmetry):
    assert yaw_symmetry([_prism(sides)]) == symmetry


def test_a_chair_has_no_like_yaw(small_room):
    assert yaw_symmetry(small_room.object_by_id("chair-1").meshes) == 1


def test_depth_of_a_wall_is_flat_in_every_view():
    """A lens inside a sphere of rays that end on the plane z = 2 of one view."""
    for view in views_in(LENS, 64):
        rays = LENS.unproject(pixel_centres(LENS)) @ view.lens_from_view.rotation
        with np.errstate(divide="ignore"):
            range_m = np.where(rays[:, 2] > 0.05, 2.0 / rays[:, 2], np.inf)
        truth = LensTruth(
            LENS,
            Pose.identity(),
            range_m.reshape(400, 400).astype(np.float32),
            np.zeros((400, 400), np.uint8),
            {"all": Silhouette(PixelRect(0, 0, 400, 400), np.ones((400, 400), np.bool_))},
        )
        seen_there = ViewSampler(LENS, view).truth(truth)
        inside = seen_there.silhouettes["all"] & (seen_there.depth_m > 0)
        assert inside.mean() > 0.6
        assert np.abs(seen_there.depth_m[inside] - 2.0).max() < 0.01


def test_the_middle_view_looks_down_and_the_last_to_the_right():
    views = views_in(LENS, 64)
    assert views[1].lens_from_view.rotation[1, 2] == pytest.approx(math.sin(math.radians(25)))
    assert views[2].lens_from_view.rotation[0, 2] > 0.7


def test_meshes_survive_their_files(small_room, tmp_path):
    surface = joined(meshes_of_object(small_room.objects[0]))
    corners = surface.vertices[surface.faces]
    write_obj(tmp_path / "a.obj", surface)
    np.testing.assert_allclose(read_obj(tmp_path / "a.obj"), corners, atol=1e-6)
    write_model_ply(tmp_path / "a.ply", surface)
    np.testing.assert_allclose(read_model_ply(tmp_path / "a.ply"), 1000 * corners, atol=1e-3)
    (tmp_path / "a.ply").write_bytes((tmp_path / "a.ply").read_bytes()[:-3])
    with pytest.raises(ValueError, match=r"a\.ply"):
        read_model_ply(tmp_path / "a.ply")
    (tmp_path / "a.obj").write_text("v 1 2 x\n")
    with pytest.raises(ValueError, match="line 1"):
        read_obj(tmp_path / "a.obj")


def test_an_object_without_meshes_is_its_solid_boxes(small_room):
    from dataclasses import replace

    chair = small_room.objects[0]
    boxes = joined(meshes_of_object(replace(chair, meshes=())))
    meshes = joined(meshes_of_object(chair))
    np.testing.assert_allclose(boxes.vertices.max(axis=0), meshes.vertices.max(axis=0))
    np.testing.assert_allclose(boxes.vertices.min(axis=0), meshes.vertices.min(axis=0))


def test_counts_and_boxes():
    alone = np.zeros((4, 5), np.bool_)
    alone[1:3, 2:5] = True
    found = seen(alone, alone & (np.arange(5) < 4), (10, 20))
    assert (found.pixels_alone, found.pixels_visible) == (6, 4)
    assert found.box_alone == (12, 21, 15, 23)
    assert found.box_visible == (12, 21, 14, 23)
    assert found.fraction == pytest.approx(4 / 6)
    assert OUTSIDE.fraction == 0.0
    assert box_of(np.zeros((2, 2), np.bool_)) is None


def test_a_mirror_is_not_rigid():
    assert rigid_error(np.eye(3)) == 0.0
    assert rigid_error(np.diag([1.0, 1.0, -1.0])) >= 2.0


def test_lengths_survive_and_what_is_too_far_is_nothing(tmp_path):
    lengths = np.array([[0.0005, 1.2345, 32.7, 33.0, np.inf]], np.float32)
    write_lengths(tmp_path / "a.png", lengths, 0.0005)
    back = 0.0005 * read_picture(tmp_path / "a.png").astype(float)
    np.testing.assert_allclose(back, [[0.0005, 1.2345, 32.7, 0.0, 0.0]], atol=0.00026)
    rgb = np.arange(36, dtype=np.uint8).reshape(3, 4, 3)
    write_rgb(tmp_path / "b.png", rgb)
    np.testing.assert_array_equal(read_picture(tmp_path / "b.png"), rgb)
    with pytest.raises(ValueError, match=r"c\.png"):
        read_picture(tmp_path / "c.png")


def test_a_list_that_broke_off_is_no_json(tmp_path):
    import json

    with JsonList(tmp_path / "a.json", head={"a": 1}, key="b") as items:
        items.add({"c": 2})
        items.tail = {"d": 3}
    assert json.loads((tmp_path / "a.json").read_text()) == {"a": 1, "b": [{"c": 2}], "d": 3}

    def break_off():
        with JsonList(tmp_path / "b.json") as items:
            items.add(1)
            raise OSError("full")

    with pytest.raises(OSError, match="full"):
        break_off()
    with pytest.raises(json.JSONDecodeError):
        json.loads((tmp_path / "b.json").read_text())


def test_options_are_checked():
    with pytest.raises(ValueError, match="at least 1"):
        DatasetOptions(every=0)
    with pytest.raises(ValueError, match="no video"):
        DatasetOptions(form="bop", pictures="video")
