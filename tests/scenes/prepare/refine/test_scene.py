"""Refining a part of a package: everything else keeps its bytes, and undo gives them back."""

import numpy as np
import pytest

from scenes.cut import divide
from scenes.harmonics import turned
from scenes.package import ScenePackage, Stage, load_package, save_package
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.coverage.in_photos import with_coverage
from scenes.prepare.cutout.cutout import undo_cut
from scenes.prepare.cutout.object.added import add_object
from scenes.prepare.refine.refine import RefineOptions
from scenes.prepare.refine.scene import in_sphere, refine_object, refine_region
from scenes.render.native import NativeRenderer
from scenes.state import ObjectModel

FIELDS = ("means", "scales", "rotations", "opacities", "sh")
OPTIONS = RefineOptions(steps=40)


@pytest.fixture
def package(coarse_ball, is_upper, ball_views, tmp_path):
    """A ball of which the upper half was cut out and then moved elsewhere, through a file."""
    room, cut = divide(coarse_ball, is_upper, object_id="cap", floaters=np.zeros_like(is_upper))
    scanned = Pose.from_yaw(0.4, (0.1, -0.2, 0.0))
    own = turned(coarse_ball.select(is_upper), scanned.inverse())
    moved = Pose.from_yaw(2.0, (3.0, 0.0, 0.0))
    item = ObjectModel("cap", "Cap", "", own, (2.0, 2.0, 1.0), 0.0, moved)
    views = tuple(ViewPoint(v.name, v.camera, v.world_from_camera) for v in ball_views)
    made = ScenePackage(
        "ball",
        room,
        (item,),
        (),
        Pose.identity(),
        np.array([[-1.0, -1.0], [1.0, 1.0]]),
        None,
        (Stage("cut cap"),),
        views,
        cuts=(cut,),
    )
    save_package(made, tmp_path / "ball.gnx")
    return load_package(tmp_path / "ball.gnx")


def are_same(a, b):
    return all(
        np.array_equal(getattr(a, field), getattr(b, field), equal_nan=True) for field in FIELDS
    )


def refined_object(package, views, object_id="cap"):
    rng = np.random.default_rng(0)
    return refine_object(package, object_id, views=views, options=OPTIONS, rng=rng).package


def refined_region(package, mask, views):
    rng = np.random.default_rng(0)
    return refine_region(package, mask, views=views, options=OPTIONS, rng=rng)


def test_an_object_is_refined_where_it_was_scanned(package, ball_views, tmp_path):
    after = refined_object(package, ball_views)
    before, item = package.objects[0], after.objects[0]
    assert are_same(after.room, package.room)
    assert len(item.splats) >= 2 * len(before.splats)
    assert (item.box_m, item.world_from_object) == (before.box_m, before.world_from_object)
    # In its own frame it lies where it lay before.
    middle = np.array([-0.1, 0.2, 0.0])
    centre = Pose.from_yaw(-0.4).rotation @ middle
    radius = np.linalg.norm(item.splats.means - centre, axis=1)
    assert np.median(np.abs(radius - 1)) < 0.05
    save_package(after, tmp_path / "ball.gnx")
    back = undo_cut(load_package(tmp_path / "ball.gnx"))
    assert are_same(back.objects[0].splats, before.splats)
    assert [stage.name for stage in back.stages] == ["cut cap"]
    assert len(back.cuts) == 1
    assert undo_cut(back).objects == ()


def test_what_photos_saw_is_measured_anew_and_given_back(package, ball_views, tmp_path):
    seen = with_coverage(package, "cap", renderer=NativeRenderer())
    after = refined_object(seen, ball_views)
    assert len(after.objects[0].coverage) == len(after.objects[0].splats)
    save_package(after, tmp_path / "seen.gnx")
    back = undo_cut(load_package(tmp_path / "seen.gnx")).objects[0].coverage
    before = seen.objects[0].coverage
    for field in ("directions", "weights", "sides"):
        assert np.array_equal(getattr(back, field), getattr(before, field))


def test_a_refined_object_can_be_refined_again(package, ball_views):
    once = refined_object(package, ball_views)
    twice = refined_object(once, ball_views)
    # It begins with what was cut, so that it is the same.
    assert are_same(once.objects[0].splats, twice.objects[0].splats)
    back = undo_cut(undo_cut(twice))
    assert are_same(back.objects[0].splats, package.objects[0].splats)


def test_a_region_is_refined_and_all_other_splats_keep_their_bytes(package, ball_views, tmp_path):
    mask = in_sphere(package.room, centre=(0.0, -1.0, -0.3), radius_m=0.5)
    done = refined_region(package, mask, ball_views)
    kept = int((~mask).sum())
    room = done.package.room
    assert are_same(room.select(np.arange(kept)), package.room.select(~mask))
    assert len(room) - kept == len(done.refined.splats) > mask.sum()
    assert are_same(done.package.objects[0].splats, package.objects[0].splats)
    save_package(done.package, tmp_path / "ball.gnx")
    back = undo_cut(load_package(tmp_path / "ball.gnx"))
    assert are_same(back.room, package.room)
    assert [stage.name for stage in back.stages] == ["cut cap"]


def test_an_object_can_be_refined_after_the_region_beside_it(package, ball_views):
    mask = in_sphere(package.room, centre=(0.0, -1.0, -0.3), radius_m=0.5)
    region = refined_region(package, mask, ball_views).package
    both = refined_object(region, ball_views)
    assert are_same(both.room, region.room)
    assert are_same(undo_cut(undo_cut(both)).room, package.room)


def test_an_object_of_other_photos_is_refused(package, ball_views):
    mug = ObjectModel(
        "mug", "Mug", "", package.objects[0].splats, (0.1, 0.1, 0.1), 0.0, Pose.identity()
    )
    more = add_object(package, mug, Pose.identity(), detail="")
    with pytest.raises(ValueError, match="'mug' was not cut out of this room"):
        refined_object(more, ball_views, "mug")
    with pytest.raises(KeyError, match="no object 'cup'"):
        refined_object(more, ball_views, "cup")


def test_a_place_without_splats_is_refused(package):
    with pytest.raises(ValueError, match=r"no splat within 0.1 m of \(0, 0, 5\) m"):
        in_sphere(package.room, centre=(0.0, 0.0, 5.0), radius_m=0.1)
