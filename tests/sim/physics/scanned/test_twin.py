"""Physics of a scanned room: it carries, stops and lets through what the scan shows, edits too."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.twin.scan_like import block, scan_like
from scenes.mesh import BoxPart, CollisionMesh, PhysicalObject
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from sim.physics.collision.static_geoms import StaticGeoms
from sim.physics.collision.surface import rescanned, surface_of
from sim.physics.moving.primitives import Primitive, Shape
from sim.physics.scanned.opening import twin_of_package
from sim.physics.scanned.surface import without_objects
from sim.physics.scanned.twin import STEP_NS, Twin

SECOND_NS = 1_000_000_000
ROOM = block((0, 0, 0), (4, 3, 2.5), is_room=True)
TABLE_TOP_M = 0.74
TABLE = block((1, 1, TABLE_TOP_M - 0.03), (2.2, 2, TABLE_TOP_M))
AROUND_TABLE = np.array([[0.9, 0.9, 0.6], [2.3, 2.1, 0.8]])
NOTHING = np.zeros((0, 3, 3))


@pytest.fixture(scope="module")
def surface():
    triangles = np.concatenate([ROOM, TABLE])
    return surface_of(scan_like(triangles, edge_m=0.06, noise_m=0.003, seed=4))


def carton(object_id, place, side_m=0.2, yaw=0.3):
    half = 0.5 * side_m
    return PhysicalObject(
        object_id, "carton", (), (side_m,) * 3,
        (BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, half)), (half,) * 3),), 2.0, 0.5,
        Pose.from_yaw(yaw, place),
    )  # fmt: skip


def heights(twin):
    return {name: float(pose.translation[2]) for name, pose in twin.object_poses().items()}


def test_things_come_to_rest_on_floor_and_table(surface):
    ball = Primitive("ball", Shape.SPHERE, (0.1,) * 3, Pose.from_yaw(0, (1.3, 1.8, 0.9)))
    tin = Primitive("tin", Shape.CYLINDER, (0.1, 0.1, 0.2), Pose.from_yaw(0, (3.0, 2.0, 0.4)))
    cartons = (carton("low", (0.5, 0.5, 0.3)), carton("high", (1.6, 1.4, 1.0)))
    twin = Twin(surface, cartons, virtual=(ball, tin))
    twin.step(3 * SECOND_NS)
    before = heights(twin)
    assert before["low"] == pytest.approx(0.0, abs=0.003)
    assert before["high"] == pytest.approx(TABLE_TOP_M, abs=0.005)
    assert before["ball"] == pytest.approx(TABLE_TOP_M + 0.05, abs=0.005)
    assert before["tin"] == pytest.approx(0.1, abs=0.003)
    twin.step(SECOND_NS)
    assert heights(twin) == pytest.approx(before, abs=0.001)


def test_nothing_thrown_gets_out(surface):
    twin = Twin(surface, tuple(carton(f"c{k}", (0.5 + 0.7 * k, 0.5, 1.2), 0.12) for k in range(5)))
    rng = np.random.default_rng(7)
    for _ in range(6):
        for k, name in enumerate(twin.object_ids):
            twin.place(name, Pose.from_yaw(0.5 * k, (0.5 + 0.7 * k, 0.5, 1.2)))
            direction = rng.normal(size=3)
            twin.throw(name, 8.0 * direction / np.linalg.norm(direction), spin=rng.normal(size=3))
        assert max(twin.speed(name) for name in twin.object_ids) == pytest.approx(8.0)
        for _ in range(20):
            twin.step(50 * STEP_NS)
            centres = np.array([pose.translation for pose in twin.object_poses().values()])
            assert (centres > (0.0, 0.0, -0.1)).all()
            assert (centres < (4.0, 3.0, 2.6)).all()


@pytest.mark.parametrize("side_m", [0.02, 0.05])
def test_something_small_and_fast_does_not_pass_a_thin_table(surface, side_m):
    twin = Twin(surface, (carton("c", (1.6, 1.5, 1.1), side_m),))
    for yaw in (0.0, 0.4, 0.8):
        twin.place("c", Pose.from_yaw(yaw, (1.6, 1.5, 1.1)))
        twin.throw("c", np.array([0.0, 0.0, -8.0]), spin=np.array([3.0, 5.0, 0.0]))
        twin.step(SECOND_NS // 10)
        assert twin.object_pose("c").translation[2] > TABLE_TOP_M - side_m
    twin.rescan(AROUND_TABLE, NOTHING)
    twin.place("c", Pose.from_yaw(0.0, (1.6, 1.5, 1.1)))
    twin.throw("c", np.array([0.0, 0.0, -8.0]))
    twin.step(SECOND_NS // 10)
    assert twin.object_pose("c").translation[2] < 0.7


def test_a_throw_flies_a_parabola():
    twin = Twin(surface_of(ROOM), (carton("c", (0.5, 1.5, 1.5)),))
    twin.throw("c", np.array([4.0, 0.0, 2.0]))
    twin.step(SECOND_NS // 2)
    place = twin.object_pose("c").translation
    assert place[0] == pytest.approx(2.5, abs=0.1)
    assert place[2] == pytest.approx(1.5 + 1.0 - 0.5 * 9.81 * 0.25, abs=0.06)


def test_what_stood_on_a_table_falls_when_the_table_goes(surface):
    twin = Twin(surface, (carton("c", (1.6, 1.5, TABLE_TOP_M + 0.01)),))
    twin.step(2 * SECOND_NS)
    twin.rescan(AROUND_TABLE, NOTHING)
    twin.step(SECOND_NS)
    assert heights(twin)["c"] == pytest.approx(0.0, abs=0.003)


def test_a_new_scan_of_the_same_table_moves_nothing(surface):
    twin = Twin(surface, (carton("c", (1.6, 1.5, TABLE_TOP_M + 0.01)),))
    twin.step(2 * SECOND_NS)
    for seed in range(4):
        before = twin.object_pose("c")
        twin.rescan(AROUND_TABLE, scan_like(TABLE, edge_m=0.06, noise_m=0.003, seed=50 + seed))
        for _ in range(30):
            twin.step(5 * STEP_NS)
            moved = twin.object_pose("c").translation - before.translation
            assert np.linalg.norm(moved) < 0.005
            assert twin.speed("c") < 0.3


def test_a_surface_that_appears_in_something_lifts_it_gently():
    twin = Twin(surface_of(ROOM), (carton("c", (1.5, 1.5, 0.0)),))
    twin.step(SECOND_NS)
    podium = block((1.1, 1.1, 0.0), (1.9, 1.9, 0.15))
    twin.rescan(np.array([[1.0, 1.0, 0.02], [2.0, 2.0, 0.3]]), podium)
    fastest = 0.0
    for _ in range(150):
        twin.step(5 * STEP_NS)
        fastest = max(fastest, twin.speed("c"))
    assert fastest < 0.3
    assert heights(twin)["c"] == pytest.approx(0.15, abs=0.003)
    assert np.abs(twin.object_pose("c").translation[:2] - 1.5).max() < 0.01


def test_more_new_patches_than_spares_go_on_with_a_new_model(surface, monkeypatch):
    monkeypatch.setattr("sim.physics.collision.static_geoms.MIN_SPARES", 2)
    twin = Twin(surface_of(ROOM), (carton("c", (3.0, 2.0, 0.5)),))
    twin.throw("c", np.array([-1.0, 0.0, 0.0]))
    twin.step(SECOND_NS // 10)
    before, speed = twin.object_pose("c"), twin.speed("c")
    twin.rescan(AROUND_TABLE, TABLE)
    assert twin.object_pose("c").translation == pytest.approx(before.translation)
    assert twin.speed("c") == pytest.approx(speed)
    assert twin.t_ns == SECOND_NS // 10
    twin.place("c", Pose.from_yaw(0.0, (1.6, 1.5, 1.0)))
    twin.step(2 * SECOND_NS)
    assert heights(twin)["c"] == pytest.approx(TABLE_TOP_M, abs=0.003)


def test_a_change_of_an_older_surface_is_refused(surface):
    twin = Twin(surface, ())
    old = rescanned(twin.surface, AROUND_TABLE, NOTHING)
    twin.rescan(AROUND_TABLE, TABLE)
    with pytest.raises(ValueError, match="no longer there"):
        twin.apply(old)
    twin.apply(rescanned(twin.surface, AROUND_TABLE, NOTHING))
    assert len(twin.surface.patches) == len(old.surface.patches)


def test_a_freed_box_is_used_again(surface):
    twin = Twin(surface, ())
    spares = twin._static.spares
    for seed in range(3):
        twin.rescan(AROUND_TABLE, scan_like(TABLE, edge_m=0.06, noise_m=0.003, seed=seed))
    twin.rescan(AROUND_TABLE, NOTHING)
    assert twin._static.spares > spares
    assert isinstance(twin._static, StaticGeoms)


def test_friction_decides_how_far_a_thing_slides():
    reached = []
    for friction in (0.1, 0.8):
        twin = Twin(surface_of(ROOM), (carton("c", (0.5, 1.5, 0.0), yaw=0.0),))
        twin.step(SECOND_NS // 10)
        twin.set_friction("c", friction)
        twin.throw("c", np.array([1.5, 0.0, 0.0]))
        twin.step(3 * SECOND_NS)
        reached.append(twin.object_pose("c").translation[0] - 0.5)
    # v² / (2 μ g): 1.15 m and 0.14 m.
    assert reached[0] == pytest.approx(1.15, rel=0.15)
    assert reached[1] == pytest.approx(0.14, rel=0.3)


def test_the_heavier_one_wins():
    reached = []
    for mass_kg in (0.2, 20.0):
        twin = Twin(
            surface_of(ROOM), (carton("a", (1.0, 1.5, 0.0), yaw=0.0),
                               carton("b", (1.5, 1.5, 0.0), yaw=0.0)),
        )  # fmt: skip
        twin.step(SECOND_NS // 10)
        twin.set_mass("a", mass_kg)
        twin.throw("a", np.array([3.0, 0.0, 0.0]))
        twin.step(2 * SECOND_NS)
        reached.append(twin.object_pose("b").translation[0] - 1.5)
    assert reached[0] < 0.1 < 0.3 < reached[1]


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_impossible_masses_and_frictions_are_refused(value):
    twin = Twin(surface_of(ROOM), (carton("c", (1.0, 1.0, 0.0)),))
    with pytest.raises(ValueError, match="mass"):
        twin.set_mass("c", value)
    with pytest.raises(ValueError, match="friction"):
        twin.set_friction("c", value)


def test_a_tracked_thing_pushes_and_is_stopped_by_nothing():
    things = (carton("tracked", (1.0, 1.5, 0.0), yaw=0.0), carton("free", (1.5, 1.5, 0.0), yaw=0.0))
    twin = Twin(surface_of(ROOM), things, tracked=["tracked"])
    for k in range(1, 31):
        twin.follow({"tracked": Pose.from_yaw(0.0, (1.0 + 0.04 * k, 1.5, 0.0))},
                    within_ns=SECOND_NS // 30)  # fmt: skip
        twin.step(SECOND_NS // 30 + STEP_NS)
    assert twin.object_pose("tracked").translation == pytest.approx([2.2, 1.5, 0.0], abs=1e-6)
    assert twin.object_pose("free").translation[0] > 2.35
    with pytest.raises(KeyError, match="not free"):
        twin.throw("tracked", np.zeros(3))


def test_what_stands_on_a_tracked_thing_is_taken_along():
    things = (carton("tray", (1.0, 1.5, 0.5), 0.3, yaw=0.0), carton("cup", (1.0, 1.5, 0.8), 0.1))
    twin = Twin(surface_of(ROOM), things, tracked=["tray"])
    twin.step(SECOND_NS)
    for k in range(1, 46):
        twin.follow({"tray": Pose.from_yaw(0.0, (1.0 + 0.02 * k, 1.5, 0.5))},
                    within_ns=SECOND_NS // 30)  # fmt: skip
        twin.step(SECOND_NS // 30 + STEP_NS)
    cup = twin.object_pose("cup").translation
    assert cup[0] == pytest.approx(1.9, abs=0.06)
    assert cup[2] == pytest.approx(0.8, abs=0.005)


def test_a_tracked_thing_found_again_elsewhere_flings_nothing():
    things = (carton("tracked", (0.5, 0.5, 0.0)), carton("free", (2.0, 1.5, 0.0)))
    twin = Twin(surface_of(ROOM), things, tracked=["tracked"])
    twin.step(SECOND_NS)
    twin.follow({"tracked": Pose.from_yaw(0.0, (2.05, 1.5, 0.0))}, within_ns=SECOND_NS // 30)
    twin.step(SECOND_NS)
    assert np.linalg.norm(twin.object_pose("free").translation - (2.0, 1.5, 0.0)) < 0.005
    # Once it has left, it is solid again.
    twin.follow({"tracked": Pose.from_yaw(0.0, (1.0, 1.5, 0.0))}, within_ns=SECOND_NS // 30)
    twin.step(SECOND_NS // 10)
    for k in range(1, 31):
        twin.follow({"tracked": Pose.from_yaw(0.0, (1.0 + 0.04 * k, 1.5, 0.0))},
                    within_ns=SECOND_NS // 30)  # fmt: skip
        twin.step(SECOND_NS // 30 + STEP_NS)
    assert twin.object_pose("free").translation[0] > 2.3


def test_primitives_come_and_go_while_it_runs():
    twin = Twin(surface_of(ROOM), (carton("c", (1.5, 1.5, 1.0)),))
    shelf = Primitive(
        "shelf", Shape.BOX, (0.8, 0.8, 0.1), Pose.from_yaw(0, (1.5, 1.5, 0.5)), mass_kg=None
    )
    twin.add_virtual(shelf)
    twin.step(2 * SECOND_NS)
    assert heights(twin)["c"] == pytest.approx(0.55, abs=0.002)
    assert heights(twin)["shelf"] == pytest.approx(0.5)
    with pytest.raises(ValueError, match="taken"):
        twin.add_virtual(shelf)
    twin.remove_virtual("shelf")
    twin.step(SECOND_NS)
    assert heights(twin)["c"] == pytest.approx(0.0, abs=0.002)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"size_m": (0.1, 0.1, 0.001)}, "limit"),
        ({"shape": Shape.SPHERE, "size_m": (0.1, 0.1, 0.2)}, "round"),
        ({"shape": Shape.CYLINDER, "size_m": (0.1, 0.2, 0.2)}, "round"),
        ({"mass_kg": 0.0}, "mass"),
        ({"friction": -1.0}, "friction"),
    ],
)
def test_impossible_primitives_are_refused(changed, message):
    good = Primitive("p", Shape.BOX, (0.1, 0.1, 0.1), Pose.identity())
    with pytest.raises(ValueError, match=message):
        replace(good, **changed)


def test_ids_are_checked():
    one = carton("c", (1.0, 1.0, 0.0))
    with pytest.raises(ValueError, match="double"):
        Twin(surface_of(ROOM), (one, one))
    with pytest.raises(ValueError, match="tracked"):
        Twin(surface_of(ROOM), (one,), tracked=["d"])


def package(collision, *objects):
    cloud = SplatCloud(
        np.zeros((1, 3)), np.full((1, 3), 0.01), np.array([[1.0, 0, 0, 0]]), np.array([0.9]),
        np.zeros((1, 1, 3)),
    )  # fmt: skip
    return ScenePackage(
        "room", cloud, objects, (), Pose.identity(), np.array([[0, 0], [4, 3]]), None,
        collision=collision,
    )  # fmt: skip


def test_a_packages_objects_are_not_in_its_surface_twice():
    box = block((1.4, 1.4, 0.0), (1.6, 1.6, 0.2))
    triangles = scan_like(np.concatenate([ROOM, box]), edge_m=0.06, noise_m=0.0, seed=0)
    mesh = CollisionMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))
    half = BoxPart(Pose.from_yaw(0.0, (0, 0, 0.1)), (0.1, 0.1, 0.1))
    cloud = package(None).room
    item = ObjectModel(
        "box-1", "Box", "", cloud, (0.2, 0.2, 0.2), 0.0, Pose.from_yaw(0.0, (1.5, 1.5, 0.0)),
        (half,), 1.5,
    )  # fmt: skip
    twin = twin_of_package(package(mesh, item))
    twin.throw("box-1", np.array([1.0, 0.0, 0.0]))
    twin.step(2 * SECOND_NS)
    place = twin.object_pose("box-1").translation
    assert place[0] > 1.55
    assert place[2] == pytest.approx(0.0, abs=0.002)
    with pytest.raises(ValueError, match="no collision mesh"):
        twin_of_package(package(None))


def test_what_a_thing_stands_on_stays_when_the_thing_is_taken_out():
    floor = block((0, 0, -0.1), (3, 3, 0.0))
    pieces = scan_like(floor, edge_m=0.05, noise_m=0.002, seed=0)
    assert len(without_objects(pieces, (carton("c", (1.5, 1.5, 0.0)),))) == len(pieces)
