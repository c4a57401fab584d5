"""Lens and pose found together from a room that is known, and refused where it is another."""

import math
from dataclasses import replace

import numpy as np
import pytest

from devices.messages import Frame
from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.render.renderer import PosedSplats
from tests.conftest import raycast_picture
from tracking.camera.lens_fit import averaged, calibrate_lenses
from tracking.camera.lens_shape import rms_px

TRUE = Fisheye(640, 640, 172.0, 324.0, 315.0, math.radians(100), (0.017, 0.0266, -0.0104, 0.0007))
GUESS = Fisheye(640, 640, 186.0, 320.0, 320.0, math.radians(100))
"""5 % longer than the true lens at the rim, and without its distortion."""


@pytest.fixture(scope="module")
def filmed(table):
    """The room through the true lens, from its meshes."""
    physical = table.physical
    meshes = [(mesh, Pose.identity()) for mesh in physical.static]
    for item in physical.objects:
        meshes += [(mesh, item.world_from_object) for mesh in item.meshes]
    rgb, _, _ = raycast_picture(meshes, TRUE, physical.world_from_rig, shade=False)
    return np.asarray(rgb, dtype=np.uint8)


def found(table, picture, start, room=None):
    objects = tuple(PosedSplats(m.source.splats, table.poses[n]) for n, m in table.models.items())
    frame = Frame("camera", 0, 0, 0, (picture,), Rig((GUESS,), (Pose.identity(),)), start)
    room = table.scan.room if room is None else room
    return calibrate_lenses([frame], start, room, table.renderer, objects=objects)


def off(true, degrees):
    turn = np.radians(degrees) * np.array([0.6, -0.64, 0.48])
    return true @ Pose(rotation_from_vector(turn), np.array([0.01, -0.012, 0.012]))


def test_a_lens_five_per_cent_off_and_a_pose_two_degrees_off_are_put_right(table, filmed):
    true = table.physical.world_from_rig
    result = found(table, filmed, off(true, 2.0))
    left = true.inverse() @ result.world_from_rig
    assert result.trusted
    assert rms_px(GUESS, TRUE, max_angle=math.radians(99)) > 8.0
    lens = result.rig.lenses[0]
    assert rms_px(lens, TRUE, max_angle=math.radians(99), b_from_a=left) < 0.4
    assert abs(lens.f_px - TRUE.f_px) < 0.3
    assert math.degrees(rotation_angle(left.rotation)) < 0.1
    assert np.linalg.norm(left.translation) < 0.005
    assert 0 < result.lens_sigma_px[0] < 0.5
    assert result.residual_px[0] < 0.5
    assert result.covariance.shape == (13, 13)
    assert math.radians(80) < result.seen_to_rad[0] < math.radians(100)
    assert "lenses found" in result.described()


def test_another_room_is_refused_with_the_reason(table, filmed):
    turned = replace(table.scan.room, means=table.scan.room.means[:, [1, 0, 2]])
    result = found(table, filmed, table.physical.world_from_rig, turned)
    assert not result.trusted
    assert "details" in result.refusal
    assert "NOT found" in result.described()


def test_what_a_covered_rim_does_not_tell_is_said(table, filmed):
    covered = filmed.copy()
    y, x = np.mgrid[0:640, 0:640]
    noise = np.random.default_rng(0).integers(0, 255, filmed.shape, np.uint8)
    rim = np.hypot(x - 320, y - 320) > 130
    covered[rim] = noise[rim]
    result = found(table, covered, table.physical.world_from_rig)
    assert result.seen_to_rad[0] < math.radians(60)
    assert any("distortion" in what for what in result.unseen)


def test_the_median_of_pictures_forgets_who_walked_by():
    still = np.full((4, 4, 3), 100, np.uint8)
    passed = np.full((4, 4, 3), 10, np.uint8)
    np.testing.assert_array_equal(averaged([[still], [passed], [still]])[0], still)
    np.testing.assert_array_equal(averaged([[still], [passed]])[0], np.full((4, 4, 3), 55))


def test_no_picture_is_refused(table):
    with pytest.raises(ValueError, match="no frame"):
        calibrate_lenses([], Pose.identity(), table.scan.room, table.renderer)
