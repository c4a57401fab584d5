"""The headset's numbers as the studio's, on cases that are worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from devices.hololens.axes import (
    camera_of,
    camera_pose,
    head_and_hands,
    in_headset_m,
    pose_of_rows,
    surface_of,
    unity_transform,
)
from devices.hololens.values import Joint
from devices.hololens.wire.packets import Packet
from devices.hololens.wire.personal_video import VideoTrailer
from devices.hololens.wire.spatial_input import HAND_JOINTS, JOINT_LAYOUT, SpatialInput, Valid
from devices.hololens.wire.spatial_mapping import ObservedSurface
from devices.hololens.wire.surface_mesh import MeshNumbers
from devices.hololens.wire.taking import WireError
from scenes.pose import Pose


def rows(place=(0.0, 0.0, 0.0)):
    """No turn, for row vectors."""
    matrix = np.eye(4, dtype=np.float32)
    matrix[3, :3] = place
    return matrix


def test_a_camera_that_looks_ahead_looks_along_y():
    # The headset's world: x right, y up, -z ahead. Two metres ahead, one up, three right.
    pose = camera_pose(Packet(0, b"", rows((3, 1, -2))))
    assert pose is not None
    assert np.allclose(pose.translation, [3, 2, 1])
    ahead, down = pose.rotation[:, 2], pose.rotation[:, 1]
    assert np.allclose(ahead, [0, 1, 0])
    assert np.allclose(down, [0, 0, -1])


def test_matrices_are_for_row_vectors():
    # A quarter turn to the left about y up: what was ahead, -z, is at the left, -x.
    matrix = rows()
    matrix[:3, :3] = [[0, 0, -1], [0, 1, 0], [1, 0, 0]]
    assert np.allclose(np.array([0, 0, -1, 1]) @ matrix, [-1, 0, 0, 1])
    pose = camera_pose(Packet(0, b"", matrix))
    assert pose is not None
    assert np.allclose(pose.rotation[:, 2], [-1, 0, 0])


def test_a_headset_that_is_lost_has_no_pose():
    assert camera_pose(Packet(0, b"", np.zeros((4, 4), np.float32))) is None
    assert camera_pose(Packet(0, b"")) is None


@pytest.mark.parametrize("value", [2.0, math.nan, math.inf, -1.0])
def test_what_is_no_rotation_is_refused(value):
    matrix = rows()
    matrix[0, 0] = value
    with pytest.raises(WireError, match="no rotation"):
        pose_of_rows(matrix)


def test_pixels_are_counted_from_the_corner():
    camera = camera_of(VideoTrailer((600.0, -601.0), (379.5, 213.5), 760, 428), 760, height_px=428)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (600.0, 601.0, 380.0, 214.0)
    with pytest.raises(WireError, match="focal"):
        camera_of(VideoTrailer((math.nan, 1.0), (1.0, 1.0), 760, 428), 760, height_px=428)


def sample(valid, **parts):
    hand = np.zeros(HAND_JOINTS, JOINT_LAYOUT)
    hand["orientation"] = (0, 0, 0, 1)
    given = {
        "head": np.array([[1, 2, 3], [0, 0, -1], [0, 1, 0]], np.float32),
        "eyes": np.array([[1, 2, 3], [0, 0, -2]], np.float32),
        "left": hand,
        "right": hand,
        **parts,
    }
    return SpatialInput(valid, **given)


def test_head_and_eyes():
    found = head_and_hands(sample(Valid.HEAD | Valid.EYES), seq=1, t_ns=2, arrived_ns=3)
    assert found.world_from_head is not None
    assert found.gaze is not None
    assert np.allclose(found.world_from_head.translation, [1, -3, 2])
    assert np.allclose(found.world_from_head.rotation, [[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert np.allclose(found.gaze.direction, [0, 1, 0])
    assert found.left is None
    assert found.right is None


def test_hands():
    hand = np.zeros(HAND_JOINTS, JOINT_LAYOUT)
    hand["orientation"] = (0, 0, 0, 1)
    hand["position"][Joint.INDEX_TIP] = (0.1, 1.2, -0.3)
    hand["radius"] = 0.01
    hand["accuracy"][3] = 1
    found = head_and_hands(sample(Valid.RIGHT, right=hand), seq=0, t_ns=0, arrived_ns=0)
    assert found.right is not None
    assert found.left is None
    assert found.world_from_head is None
    assert np.allclose(found.right.positions_m[Joint.INDEX_TIP], [0.1, 0.3, 1.2])
    # Not turned: -z, to the fingertips, is ahead.
    assert np.allclose(-found.right.rotations[0][:, 2], [0, 1, 0])
    assert found.right.is_exact.tolist().count(False) == 1


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e30])
def test_what_is_no_number_is_not_there(value):
    hand = np.zeros(HAND_JOINTS, JOINT_LAYOUT)
    hand["orientation"] = (0, 0, 0, 1)
    hand["position"][5] = value
    head = np.full((3, 3), value, np.float32)
    eyes = np.full((2, 3), value, np.float32)
    everything = Valid.HEAD | Valid.EYES | Valid.LEFT | Valid.RIGHT
    spoilt = sample(everything, head=head, eyes=eyes, left=hand)
    found = head_and_hands(spoilt, seq=0, t_ns=0, arrived_ns=0)
    assert found.world_from_head is None
    assert found.gaze is None
    assert found.left is None
    assert found.right is not None


def test_surfaces_are_wound_the_other_way():
    numbers = MeshNumbers(
        np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]),
        np.array([[0, 1, 2]], np.int32),
        np.zeros((3, 3)),
    )
    found = surface_of(ObservedSurface(bytes(16), 7), numbers, pose=rows((0, 1, 0)), t_ns=5)
    assert (found.id, found.version, found.t_ns) == ("00" * 16, 7, 5)
    assert found.triangles.tolist() == [[2, 1, 0]]
    assert np.allclose(found.vertices_in_world_m, [[0, 0, 1], [1, 0, 1], [0, 0, 2]])


def test_the_display_is_left_handed():
    # One right, two ahead, three up; a quarter turn to the left seen from above.
    numbers = unity_transform(Pose.from_yaw(math.pi / 2, (1, 2, 3)), (0.1, 0.2, 0.3))
    assert numbers[:3] == pytest.approx((1, 3, 2))
    assert numbers[7:] == pytest.approx((0.1, 0.3, 0.2))
    # In a left-handed world, y up, it is a turn by -90° about y.
    x, y, z, w = numbers[3:7]
    assert (x, z) == pytest.approx((0, 0))
    assert y / w == pytest.approx(-1)


def test_places_in_the_headset_s_own_axes():
    assert np.allclose(in_headset_m([1.0, 2.0, 3.0]), [1, 3, -2])
