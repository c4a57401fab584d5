"""`scenes.prepare.foreign`: files of several formats become rooms with a floor and a mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.formats.registry import require_writer
from scenes.formats.storage.blocks import in_blocks
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.package import load_package, save_package
from scenes.prepare.foreign.foreign import (
    Unit,
    foreign_scene,
    no_movable_object,
    upright_scene,
)
from scenes.prepare.foreign.free_space import clearance, find_free_space, views_from
from scenes.rays import RayScene
from scenes.render.native import NativeRenderer

PER_UNIT = 2.5


@pytest.fixture(scope="module")
def file(flat_room, tmp_path_factory):
    """The room in units of 2.5 m, in the axes of splat files."""
    cloud = turned(flat_room, WORLD_FROM_FORWARD_CAMERA.inverse())
    cloud = replace(cloud, means=cloud.means / PER_UNIT, scales=cloud.scales / PER_UNIT)
    path = tmp_path_factory.mktemp("foreign") / "room.ply"
    write_ply(path, cloud)
    return path


@pytest.fixture(scope="module")
def scene(file):
    return foreign_scene(file, unit=Unit(PER_UNIT), renderer=NativeRenderer())


def test_the_mesh_lies_on_the_true_surfaces(scene, patches):
    distance = RayScene(patches).distance(scene.collision.vertices)
    assert np.median(distance) < 0.02
    assert np.quantile(distance, 0.9) < 0.05


def test_the_mesh_covers_floor_and_walls(scene):
    mesh = RayScene(scene.collision.vertices[scene.collision.faces].astype(np.float64))
    rng = np.random.default_rng(0)
    floor = rng.uniform((-1.8, -2.3, 0.0), (1.8, 2.3, 0.0), (500, 3))
    wall = rng.uniform((-2.0, -2.3, 0.3), (-2.0, 2.3, 2.3), (500, 3))
    assert (mesh.distance(floor) < 0.05).mean() > 0.9
    assert (mesh.distance(wall) < 0.05).mean() > 0.9


def test_the_room_is_metric_and_the_camera_stands_free(scene, flat_room):
    np.testing.assert_allclose(scene.room.means, flat_room.means, atol=0.02)
    x, y, z = scene.world_from_rig.translation
    assert z == pytest.approx(1.3)
    assert abs(x) < 1.7
    assert abs(y) < 2.2
    np.testing.assert_allclose(scene.footprint_m, [[-2.0, -2.5], [2.0, 2.5]], atol=0.15)
    assert [stage.name for stage in scene.stages] == ["open", "upright", "collision"]


def test_the_scene_is_a_package_that_reopens(scene, tmp_path):
    save_package(scene, tmp_path / "room.gnx")
    back = load_package(tmp_path / "room.gnx")
    assert back.collision is not None
    assert len(back.views) == len(scene.views)


@pytest.mark.parametrize("ending", [".spz", ".splat", ".glb"])
def test_every_format_gives_the_same_floor(flat_room, ending, tmp_path):
    cloud = turned(flat_room, WORLD_FROM_FORWARD_CAMERA.inverse())
    path = tmp_path / f"room{ending}"
    _, write = require_writer(path)
    write(path, in_blocks(cloud))
    scene, ceiling_m = upright_scene(path, unit=Unit(height_m=2.6))
    assert ceiling_m == pytest.approx(2.6)
    low, high = np.quantile(scene.room.means[:, 2], (0.05, 0.95))
    assert abs(low) < 0.03
    assert abs(high - 2.6) < 0.03


def test_what_is_not_known_is_asked_for_in_one_line(file):
    with pytest.raises(ValueError, match=r"room\.ply: states no unit: say --metres-per-unit") as e:
        foreign_scene(file, renderer=NativeRenderer())
    assert "1.04 units" in str(e.value)
    assert "\n" not in str(e.value)
    line = no_movable_object("my/room.compressed.ply")
    assert "nexus convert my/room.compressed.ply room.gnx" in line
    assert "convert" not in no_movable_object("room.gnx")


def test_a_file_in_the_world_frame_states_its_unit(flat_room, tmp_path):
    write_ply(tmp_path / "own.ply", flat_room, comments=[WORLD_COMMENT])
    scene, _ = upright_scene(tmp_path / "own.ply")
    assert "1 m per unit" in scene.stages[0].detail


def test_a_unit_that_leaves_no_place_is_named(file):
    with pytest.raises(ValueError, match="is the unit right"):
        foreign_scene(file, unit=Unit(0.05), renderer=NativeRenderer())


@pytest.mark.parametrize(
    ("metres", "height", "said"),
    [(1.0, 2.5, "one of the two"), (-1.0, None, "> 0"), (None, 40.0, "limits 1.8 to 12")],
)
def test_a_wrong_unit_is_refused(metres, height, said):
    with pytest.raises(ValueError, match=said):
        Unit(metres, height)


def test_clearance_is_the_distance_to_the_nearest_surface(flat_room):
    around = clearance(flat_room)
    for place, distance_m in (((-1.0, -1.0, 1.3), 1.0), ((1.3, 1.2, 1.1), 0.38)):
        cell = np.floor((np.array(place) - around.low_m) / around.cell_m).astype(int)
        assert around.distance_m[tuple(cell)] == pytest.approx(distance_m, abs=0.15)
        assert around.floor[tuple(cell[:2])]
    assert not around.floor[0, 0]


def test_places_are_free_and_apart(flat_room):
    space = find_free_space(flat_room, ceiling_m=2.6)
    points = space.places_m
    assert len(points) >= 6
    assert (np.abs(points[:, :2]) < (1.75, 2.25)).all()
    apart = np.linalg.norm(points[:, None] - points[None], axis=2) + 9 * np.eye(len(points))
    assert apart.min() >= 0.69
    assert len(views_from(points)) == 6 * len(points)
