"""`scenes.prepare.align.rescaled`: every length of a scene grows by the factor, nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.cut import divide, restore
from scenes.formats.ply import write_ply
from scenes.frames import look_at
from scenes.mesh import BoxPart, CollisionMesh
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.reality import Reality
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.align.rescaled import rescale_scene, rescaled
from scenes.quad import QrCode
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.state import ObjectModel

FACTOR = 1.25
CAMERA = Pinhole.from_fov(96, 72, 1.0)
EYE = np.array([0.3, -3.0, 1.4])


@pytest.fixture
def package(random_cloud, tmp_path):
    """A scene with one of everything that has a length."""
    whole = random_cloud(400, 1)
    taken = np.zeros(len(whole), dtype=bool)
    taken[::9] = True
    room, cut = divide(whole, taken, object_id="crate", floaters=np.zeros_like(taken))
    crate = ObjectModel(
        "crate",
        "Crate",
        "",
        random_cloud(50, 1, 3),
        (0.4, 0.3, 0.5),
        0.7,
        Pose.from_yaw(0.4, (1.0, 2.0, 0.7)),
        (BoxPart(Pose.from_yaw(0.1, (0.0, 0.1, 0.25)), (0.2, 0.15, 0.25)),),
        8.0,
    )
    reality = tmp_path / "other.ply"
    write_ply(reality, random_cloud(30, 0, 5))
    return ScenePackage(
        "room",
        room,
        (crate,),
        (QrCode("a", 0.2, Pose.from_yaw(1.0, (0.0, 1.0, 1.5))),),
        Pose.from_yaw(0.2, (0.1, 0.2, 1.3)),
        np.array([[-2.0, -1.0], [2.0, 3.0]]),
        None,
        (),
        (ViewPoint("1.png", CAMERA, look_at(EYE, np.zeros(3))),),
        CollisionMesh(np.eye(3), np.array([[0, 1, 2]])),
        (cut,),
        Reality(reality, "test", 4, 3, np.diag([1.0] * 7), 0.01, np.array([1.0, 0.0, 2.0])),
    )


@pytest.fixture
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("scratch")


def test_lengths_grow_and_directions_stay(package, scratch):
    found = rescaled(package, factor=FACTOR, scratch=scratch)
    np.testing.assert_allclose(found.room.means, FACTOR * package.room.means, rtol=1e-6)
    np.testing.assert_allclose(found.room.scales, FACTOR * package.room.scales, rtol=1e-6)
    np.testing.assert_allclose(found.footprint_m, FACTOR * package.footprint_m)
    np.testing.assert_allclose(found.collision.vertices, FACTOR * package.collision.vertices)
    assert found.codes[0].side_m == pytest.approx(0.25)
    for after, before in (
        (found.world_from_rig, package.world_from_rig),
        (found.codes[0].world_from_code, package.codes[0].world_from_code),
        (found.views[0].world_from_camera, package.views[0].world_from_camera),
        (found.objects[0].world_from_object, package.objects[0].world_from_object),
        (
            found.objects[0].parts[0].object_from_box,
            package.objects[0].parts[0].object_from_box,
        ),
    ):
        np.testing.assert_allclose(after.rotation, before.rotation, atol=1e-12)
        np.testing.assert_allclose(after.translation, FACTOR * before.translation)
    assert found.objects[0].box_m == pytest.approx((0.5, 0.375, 0.625))
    assert found.objects[0].parts[0].half_size_m == pytest.approx((0.25, 0.1875, 0.3125))
    assert found.objects[0].support_z_m == pytest.approx(FACTOR * 0.7)
    assert found.objects[0].guessed_mass_kg == pytest.approx(8.0 * FACTOR**3)
    assert found.stages[-1].detail == "all lengths times 1.25"


def test_a_second_reconstruction_keeps_its_angles_and_relative_scale(package, scratch):
    found = rescaled(package, factor=FACTOR, scratch=scratch).reality
    np.testing.assert_allclose(np.diag(found.covariance)[:3], 1.0)
    np.testing.assert_allclose(np.diag(found.covariance)[3:6], FACTOR**2)
    assert found.covariance[6, 6] == 1.0
    np.testing.assert_allclose(found.centre_m, [FACTOR, 0.0, 2.0 * FACTOR])
    np.testing.assert_allclose(found.read().means, FACTOR * package.reality.read().means, rtol=1e-6)


def test_a_photo_of_it_looks_as_before(package, scratch):
    renderer = NativeRenderer()
    found = rescaled(package, factor=FACTOR, scratch=scratch)
    before, after = (
        renderer.render(
            [PosedSplats(p.room, Pose.identity())],
            CAMERA,
            p.views[0].world_from_camera,
            RenderOptions(near_m=1e-3),
        )
        for p in (package, found)
    )
    np.testing.assert_allclose(after.rgb, before.rgb, atol=0.02)
    seen = (before.alpha > 0.5) & (after.alpha > 0.5)
    assert seen.mean() > 0.2
    assert np.median(after.depth[seen] / before.depth[seen]) == pytest.approx(FACTOR, rel=0.01)


def test_a_cut_can_be_undone_after_it(package, scratch):
    found = rescaled(package, factor=FACTOR, scratch=scratch)
    whole = restore(package.room, package.cuts[0])
    np.testing.assert_allclose(
        restore(found.room, found.cuts[0]).means, FACTOR * whole.means, rtol=1e-6
    )


def test_there_and_back_is_the_same_room(package, tmp_path):
    save_package(package, tmp_path / "a.gnx")
    rescale_scene(tmp_path / "a.gnx", tmp_path / "b.gnx", factor=FACTOR)
    rescale_scene(tmp_path / "b.gnx", tmp_path / "c.gnx", factor=1 / FACTOR)
    first, last = load_package(tmp_path / "a.gnx"), load_package(tmp_path / "c.gnx")
    np.testing.assert_allclose(last.room.means, first.room.means, atol=1e-6)
    np.testing.assert_allclose(last.reality.read().means, first.reality.read().means, atol=1e-6)
    assert last.objects[0].box_m == pytest.approx(first.objects[0].box_m)


@pytest.mark.parametrize("factor", [0.0, -1.0, float("nan"), float("inf")])
def test_what_is_no_scale_is_refused(package, scratch, factor):
    with pytest.raises(ValueError, match="wanted a factor > 0"):
        rescaled(package, factor=factor, scratch=scratch)


def test_a_built_in_room_is_as_large_as_it_is(package, scratch):
    with pytest.raises(ValueError, match="whose scale is exact"):
        rescaled(replace(package, physical="lab"), factor=2.0, scratch=scratch)


def test_the_scene_that_is_read_is_never_written(package, tmp_path):
    save_package(package, tmp_path / "a.gnx")
    with pytest.raises(ValueError, match="choose another name"):
        rescale_scene(tmp_path / "a.gnx", tmp_path / "a.gnx", factor=2.0)
    np.testing.assert_array_equal(load_package(tmp_path / "a.gnx").room.means, package.room.means)
