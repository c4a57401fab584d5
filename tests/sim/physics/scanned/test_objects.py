"""Objects that only a scan knows stand in the simulated room, with parts and a guessed mass."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.mesh import BoxPart
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.records import Stage
from scenes.pose import Pose
from scenes.prepare.cutout.object.added import add_object
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from sim.people.actors import TICK_NS, Actor
from sim.physics.moving.people import HandTarget, PersonTarget
from sim.physics.scanned.objects import missing, only_scanned, scanned_object, with_scanned
from sim.physics.world import World
from sim.scenarios.actions import Push

SECOND_NS = 1_000_000_000
ASIDE = HandTarget(np.array([-1.8, -1.8, 1.0]))
AWAY = {"ann": PersonTarget(np.array([-1.8, -1.8]), ASIDE, ASIDE)}


def box_part(low, high):
    low, high = np.asarray(low, float), np.asarray(high, float)
    x, y, z = 0.5 * (high - low)
    return BoxPart(Pose.from_yaw(0.0, 0.5 * (low + high)), (x, y, z))


def splats(n):
    return SplatCloud(
        np.zeros((n, 3)), np.full((n, 3), 0.01), np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, 0.9),
        np.zeros((n, 1, 3)),
    )  # fmt: skip


def table_like(**changed):
    """A low table: a top on two cheeks, open between them."""
    parts = (
        box_part((-0.3, -0.2, 0.30), (0.3, 0.2, 0.34)),
        box_part((-0.3, -0.2, 0.0), (-0.26, 0.2, 0.30)),
        box_part((0.26, -0.2, 0.0), (0.3, 0.2, 0.30)),
    )
    item = ObjectModel(
        "table-1", "Table", "", splats(3), (0.6, 0.4, 0.34), 0.0,
        Pose.from_yaw(0.0, (-0.2, -0.9, 0.0)), parts, 3.0,
    )  # fmt: skip
    return replace(item, **changed)


def scan_of(room, *objects):
    return ScenePackage(
        room.name, splats(5), objects, (), Pose.identity(), room.footprint_m, room.name
    )


def test_the_rooms_own_objects_keep_what_is_known_of_them(small_room):
    chair = table_like(object_id="chair-1", guessed_mass_kg=99.0)
    scan = replace(scan_of(small_room, chair), stages=(Stage("add chair-1"),))
    assert only_scanned(small_room, scan) == ()
    assert with_scanned(small_room, ()).objects == small_room.objects


def test_what_was_cut_out_of_the_scan_is_in_the_room_already(small_room, tmp_path):
    cut_out = replace(scan_of(small_room, table_like()), stages=(Stage("cut table-1"),))
    assert only_scanned(small_room, cut_out) == ()
    added = add_object(scan_of(small_room), table_like(), Pose.identity(), detail="")
    assert [item.object_id for item in only_scanned(small_room, added)] == ["table-1"]
    # A compact package has no cuts; its history still tells.
    save_package(added, tmp_path / "small.gnx", compact=True)
    (item,) = only_scanned(small_room, load_package(tmp_path / "small.gnx"))
    assert item.guessed_mass_kg == 3.0


def test_parts_collide_and_what_is_between_them_does_not(small_room):
    item = table_like()
    # A cube of 10 cm fits under the table's top, and another comes to rest on it.
    under = table_like(
        object_id="cube-1", box_m=(0.1, 0.1, 0.1), parts=(), guessed_mass_kg=0.5,
        world_from_object=Pose.from_yaw(0.0, (-0.2, -0.9, 0.0)),
    )  # fmt: skip
    above = replace(
        under, object_id="cube-2", world_from_object=Pose.from_yaw(0.0, (-0.2, -0.9, 0.36))
    )
    world = World(with_scanned(small_room, (item, under, above)), AWAY)
    world.step(2 * SECOND_NS)
    heights = {k: v.translation[2] for k, v in world.object_poses().items()}
    assert heights["cube-1"] == pytest.approx(0.0, abs=2e-3)
    assert heights["cube-2"] == pytest.approx(0.34, abs=2e-3)
    assert heights["table-1"] == pytest.approx(0.0, abs=2e-3)


def test_the_guessed_mass_is_what_physics_weighs(small_room):
    item = table_like(guessed_mass_kg=7.5)
    world = World(with_scanned(small_room, (item,)), AWAY)
    assert world._model.body("table-1").mass[0] == pytest.approx(7.5)


def test_without_parts_and_mass_its_box_stands_in_and_it_is_said():
    bare = scanned_object(table_like(parts=(), guessed_mass_kg=None))
    assert bare.parts[0].half_size_m == pytest.approx((0.3, 0.2, 0.17))
    assert bare.mass_kg > 0
    assert "the box around it" in missing(table_like(parts=(), guessed_mass_kg=None))
    assert "mass is guessed" in missing(table_like(guessed_mass_kg=None))
    assert "3 solid parts" in missing(table_like())
    assert "mass" not in missing(table_like())


def test_its_mesh_is_its_parts(small_room):
    item = scanned_object(table_like())
    bounds = item.meshes[0].bounds()
    assert bounds == pytest.approx(np.array([[-0.3, -0.2, 0.0], [0.3, 0.2, 0.34]]))
    assert (item.meshes[0].texture == 128).all()


def test_it_can_be_pushed(small_room):
    room = with_scanned(small_room, (table_like(),))
    actor = Actor(
        "ann", room, start=(-1.5, -1.5), yaw=0.0, actions=[Push("table-1", (0.6, -0.9))],
        camera_xy=np.array([0.0, -0.5]),
    )  # fmt: skip
    world = World(room, {"ann": actor.target()})
    for _ in range(round(10 * SECOND_NS / TICK_NS)):
        actor.tick(world)
        world.move_people({"ann": actor.target()})
        world.step(TICK_NS)
    assert world.object_pose("table-1").translation[0] > 0.2
