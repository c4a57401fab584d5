"""Coverage of an object by photos: bits of the splats they show, and none of those they do not."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.coverage.directions import bits_of, cells_of_directions, middles, packed, unpacked
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.coverage.in_photos import coverage_of, missing_records, with_coverage
from scenes.render.native import NativeRenderer

RENDERER = NativeRenderer()
AHEAD = (1.4, 0.1, 1.1)
MIDDLE = np.array([0.0, 0.0, 0.25])


def measured(package):
    found = coverage_of(package, package.objects[0], renderer=RENDERER)
    assert found is not None
    return found


def on_side(package, axis, at):
    """Splats of a face of the crate, but for its rim."""
    means = package.objects[0].splats.means
    inner = np.abs(means - MIDDLE) < 0.42 * np.array([0.4, 0.3, 0.5])
    inner[:, axis] = True
    return (np.abs(means[:, axis] - at) < 1e-3) & inner.all(axis=1)


def test_a_splat_that_a_camera_sees_has_its_bit_and_a_hidden_one_none(crate_seen_from):
    package = crate_seen_from(AHEAD)
    seen = measured(package)
    front, back = on_side(package, 0, 0.2), on_side(package, 0, -0.2)
    wanted = bits_of(np.array(AHEAD) - package.objects[0].splats.means)
    assert (seen.directions[front] == wanted[front]).all()
    assert (seen.directions[back] == 0).all()
    assert (seen.weights[front] > 1.0).all()
    assert seen.weights[back].max() < 0.1 * seen.weights[front].min()


def test_sides_are_those_that_face_a_camera(crate_seen_from):
    shares = measured(crate_seen_from(AHEAD)).seen_share_of_sides()
    assert shares[[0, 4]].min() == 1.0
    assert shares[[1, 2, 3, 5]].max() == 0.0
    both = measured(crate_seen_from(AHEAD, (-0.1, -1.4, 1.1))).seen_share_of_sides()
    assert both[[0, 3, 4]].min() == 1.0
    assert both[[1, 2, 5]].max() == 0.0


def test_what_stands_before_it_hides_it(crate_seen_from, flat_splats):
    across = np.linspace(-0.5, 0.5, 60)
    up = np.linspace(0.01, 1.2, 60)
    y, z = (axis.ravel() for axis in np.meshgrid(across, up))
    screen = flat_splats(
        np.column_stack([np.full(y.size, 0.8), y, z]), 0, (0.2, 0.2, 0.2), step_m=0.02
    )
    seen = measured(crate_seen_from(AHEAD, more=(screen,)))
    assert (seen.directions == 0).all()
    assert (seen.sides == 0).all()


def test_another_object_hides_it_too(crate_seen_from):
    package = crate_seen_from(AHEAD)
    crate = package.objects[0]
    before = replace(crate, object_id="b", world_from_object=Pose.from_yaw(1.57, (0.5, 0.0, 0.0)))
    seen = measured(replace(package, objects=(crate, before)))
    assert seen.seen_share_of_sides()[0] < 0.6
    assert measured(package).seen_share_of_sides()[0] == 1.0


@pytest.mark.parametrize("yaw", [0.4, 2.0, -1.1])
def test_a_room_that_is_turned_with_its_cameras_changes_no_record(crate_seen_from, yaw):
    package = crate_seen_from(AHEAD, (0.2, 1.5, 1.0))
    turn = Pose.from_yaw(yaw, (0.4, -0.2, 0.0))
    item = package.objects[0]
    moved = replace(
        package,
        room=package.room.transformed(turn),
        objects=(replace(item, world_from_object=turn @ item.world_from_object),),
        views=tuple(
            replace(view, world_from_camera=turn @ view.world_from_camera) for view in package.views
        ),
    )
    here, there = measured(package), measured(moved)
    assert (here.directions == there.directions).mean() > 0.995  # crops differ by part of a pixel
    np.testing.assert_array_equal(here.sides, there.sides)


def test_an_object_whose_axes_are_turned_a_quarter_has_its_bits_turned(crate_seen_from):
    turn = Pose.from_yaw(np.pi / 2)
    upright, turned = (
        measured(crate_seen_from(AHEAD, (0.3, -1.4, 0.9), object_from_crate=pose))
        for pose in (Pose.identity(), turn)
    )
    where = cells_of_directions(middles() @ turn.rotation.T)
    flags = np.zeros((len(upright), 64), dtype=bool)
    flags[:, where] = unpacked(upright.directions)
    assert (packed(flags) == turned.directions).mean() > 0.99


def test_measuring_again_gives_the_same_bytes(crate_seen_from):
    package = crate_seen_from(AHEAD, (0.2, 1.5, 1.0))
    one, two = measured(package), measured(package)
    for name in ("directions", "weights", "sides"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes()


def test_a_fisheye_sees_as_well(crate_seen_from):
    pose = look_at(np.array(AHEAD), MIDDLE)
    package = crate_seen_from(views=(ViewPoint("f", Fisheye.from_fov(640, 3.3), pose),))
    seen = measured(package)
    assert seen.seen_share_of_sides()[0] == 1.0
    assert (seen.directions[on_side(package, 0, 0.2)] != 0).mean() > 0.95


def test_a_part_of_it_in_the_picture_is_seen(crate_seen_from):
    beside = look_at(np.array(AHEAD), np.array([0.0, 0.95, 0.25]))
    full = crate_seen_from(AHEAD)
    part = replace(full, views=(replace(full.views[0], world_from_camera=beside),))
    share = measured(part).seen_share_of_sides()[0]
    assert 0.1 < share < 0.9


def test_a_camera_that_looks_away_or_stands_inside_sees_nothing(crate_seen_from):
    full = crate_seen_from(AHEAD)
    away = look_at(np.array(AHEAD), np.array([3.0, 0.0, 0.25]))
    inside = look_at(MIDDLE, np.array([3.0, 0.0, 0.25]))
    views = tuple(replace(full.views[0], world_from_camera=pose) for pose in (away, inside))
    assert (measured(replace(full, views=views)).directions == 0).all()


def test_a_package_keeps_what_is_measured_and_one_without_views_has_none(crate_seen_from):
    package = crate_seen_from(AHEAD)
    assert list(missing_records(package)) == ["crate"]
    kept = with_coverage(package, "crate", renderer=RENDERER)
    assert list(missing_records(kept)) == []
    assert kept.objects[0].coverage is not None
    blind = replace(package, views=())
    assert list(missing_records(blind)) == []
    assert with_coverage(blind, "crate", renderer=RENDERER).objects[0].coverage is None
    with pytest.raises(KeyError, match="no object 'box'"):
        with_coverage(package, "box", renderer=RENDERER)
