"""The camera's pose refined against the room, in lenses of several sizes, and refused elsewhere."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.render.renderer import PosedSplats
from scenes.splats import SH_C0
from tests.conftest import raycast_picture
from tracking.camera import calibration
from tracking.camera.calibration import BLURS_PX, calibrate
from tracking.camera.window_slopes import by_slopes


@pytest.fixture(scope="module")
def filmed(table):
    """Frames of the room as scanned, filmed from meshes through a lens of a width."""
    from devices.messages import Frame

    frames = {}

    def film(width_px):
        if width_px not in frames:
            lens = Fisheye.from_fov(width_px, math.radians(200))
            physical = table.physical
            meshes = [(mesh, Pose.identity()) for mesh in physical.static]
            for item in physical.objects:
                meshes += [(mesh, item.world_from_object) for mesh in item.meshes]
            rgb, _, _ = raycast_picture(meshes, lens, physical.world_from_rig, shade=False)
            rig = Rig((lens,), (Pose.identity(),))
            image = np.asarray(rgb, dtype=np.uint8)
            frames[width_px] = Frame("camera", 0, 0, 0, (image,), rig, physical.world_from_rig)
        return frames[width_px]

    return film


def refined(table, frame, nominal, room=None):
    objects = tuple(PosedSplats(m.source.splats, table.poses[n]) for n, m in table.models.items())
    room = table.scan.room if room is None else room
    return calibrate(frame, nominal, room, table.renderer, objects=objects)


@pytest.mark.parametrize("width_px", [640, 960])
def test_a_marker_that_is_off_is_put_right_through_any_lens(table, filmed, width_px):
    true = table.physical.world_from_rig
    turn = rotation_from_vector(np.radians([0.3, -0.3, 0.25]))
    nominal = true @ Pose(turn, np.array([0.006, -0.006, 0.005]))
    found = refined(table, filmed(width_px), nominal)
    left = true.inverse() @ found.world_from_rig
    assert found.trusted
    assert math.degrees(rotation_angle(left.rotation)) < 0.1
    assert np.linalg.norm(left.translation) < 0.005
    assert "refined by 0." in found.described()


def worn(room):
    """A room scanned badly: wider splats of speckled colours."""
    rng = np.random.default_rng(3)
    sh = room.sh.copy()
    sh[:, 0] += rng.normal(0.0, 0.12 / SH_C0, (len(room), 1)).astype(np.float32)
    return replace(room, scales=room.scales * np.float32(1.25), sh=sh)


def test_where_it_ends_does_not_depend_on_where_a_bad_scan_and_a_small_lens_begin(table, filmed):
    true, room = table.physical.world_from_rig, worn(table.scan.room)
    ends = []
    for seed in range(3):
        axis, direction = np.random.default_rng(seed).standard_normal((2, 3))
        turn = rotation_from_vector(math.radians(0.5) * axis / np.linalg.norm(axis))
        nominal = true @ Pose(turn, 0.01 * direction / np.linalg.norm(direction))
        found = refined(table, filmed(640), nominal, room)
        assert found.trusted
        left = true.inverse() @ found.world_from_rig
        assert math.degrees(rotation_angle(left.rotation)) < 0.1
        assert np.linalg.norm(left.translation) < 0.005
        ends.append(found.world_from_rig)
    for end in ends[1:]:
        apart = ends[0].inverse() @ end
        assert math.degrees(rotation_angle(apart.rotation)) < 0.03
        assert np.linalg.norm(apart.translation) < 0.001


@pytest.fixture
def rounds(monkeypatch):
    """Blurs of the rounds that are computed."""
    blurs_px = []

    def noted(*args, blur_px):
        blurs_px.append(blur_px)
        return by_slopes(*args, blur_px=blur_px)

    monkeypatch.setattr(calibration, "by_slopes", noted)
    return blurs_px


def test_a_pose_that_was_just_fitted_is_refined_in_one_round_and_stays(table, filmed, rounds):
    true = table.physical.world_from_rig
    turn = rotation_from_vector(np.radians([0.3, -0.3, 0.25]))
    first = refined(table, filmed(960), true @ Pose(turn, np.array([0.006, -0.006, 0.005])))
    assert rounds == [*BLURS_PX]
    rounds.clear()
    again = refined(table, filmed(960), first.world_from_rig)
    assert rounds == [BLURS_PX[-1]]
    apart = first.world_from_rig.inverse() @ again.world_from_rig
    assert math.degrees(rotation_angle(apart.rotation)) < 0.03
    assert np.linalg.norm(apart.translation) < 0.001
    assert again.trusted
    assert again.found_share == pytest.approx(first.found_share, abs=0.05)
    assert again.sigma == pytest.approx(first.sigma, rel=0.2)


def test_a_pose_that_a_search_does_not_move_but_a_round_does_has_all_rounds(
    table, filmed, rounds, monkeypatch
):
    first = refined(table, filmed(960), table.physical.world_from_rig)
    rounds.clear()
    monkeypatch.setattr(calibration, "SEARCHED_TURN_RAD", math.radians(0.5))
    turn = rotation_from_vector(np.radians([0.1, -0.1, 0.1]))
    again = refined(table, filmed(960), first.world_from_rig @ Pose(turn, np.zeros(3)))
    assert rounds == [BLURS_PX[-1], *BLURS_PX]
    apart = first.world_from_rig.inverse() @ again.world_from_rig
    assert math.degrees(rotation_angle(apart.rotation)) < 0.03


def test_a_pose_from_which_the_room_looks_otherwise_is_refused_with_the_reason(table, filmed):
    turned = (
        table.physical.world_from_rig
        @ Pose.from_yaw(0.0)
        @ Pose(rotation_from_vector(np.array([0.0, 0.6, 0.0])), np.zeros(3))
    )
    found = refined(table, filmed(640), turned)
    assert not found.trusted
    assert found.world_from_rig is turned
    assert "NOT refined" in found.described()
    assert "details" in found.refusal or "limit" in found.refusal
