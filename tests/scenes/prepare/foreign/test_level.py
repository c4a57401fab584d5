"""`scenes.prepare.foreign.level`: up, floor and ceiling of rooms whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.opening import open_scene
from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.foreign.level import AXES, find_level, upright
from scenes.splats import concatenate

TURNS = {
    "z": np.eye(3),
    "-y": WORLD_FROM_FORWARD_CAMERA.inverse().rotation,
    "y": rotation_from_vector(np.array([-np.pi / 2, 0.0, 0.0])),
    "x": rotation_from_vector(np.array([0.0, np.pi / 2, 0.0])),
}


def _turned(cloud, rotation, shift=(0.0, 0.0, 0.0)):
    return turned(cloud, Pose(rotation, np.asarray(shift)))


@pytest.mark.parametrize("up", TURNS)
@pytest.mark.parametrize("convention", ["z", "-y"])
def test_up_is_found_whatever_the_convention(flat_room, up, convention):
    file = _turned(flat_room, TURNS[up])
    level = find_level(file, convention=convention)
    np.testing.assert_allclose(level.up, AXES[up], atol=1e-3)
    assert level.found
    assert abs(level.floor) < 0.01
    assert abs(level.ceiling - 2.6) < 0.02
    assert f"up is {up} of the file" in level.evidence


def test_a_tilted_room_is_made_upright(flat_room):
    tilt = rotation_from_vector(np.array([0.12, -0.06, 0.0]))
    file = _turned(flat_room, tilt @ TURNS["-y"], (0.3, 0.4, -0.2))
    level = find_level(file, convention="-y")
    assert "tilted by" in level.evidence
    back = turned(file, upright(level))
    on_floor = flat_room.means[:, 2] == 0
    assert np.abs(back.means[on_floor, 2]).max() < 0.01


def test_what_is_said_is_not_looked_for(flat_room):
    level = find_level(flat_room, convention="-y", up="x")
    assert level.up[0] > 0.9
    assert "as said" in level.evidence


@pytest.mark.parametrize("name", ["desk", "lab"])
def test_the_floor_of_a_scan_is_found_within_3_cm(name):
    package = open_scene(name)
    placed = [turned(item.splats, item.world_from_object) for item in package.objects]
    file = _turned(concatenate([package.room, *placed]), TURNS["-y"])
    level = find_level(file, convention="-y")
    assert abs(level.floor) < 0.03
    assert np.degrees(np.arccos(min(1.0, level.up @ AXES["-y"]))) < 0.3


def test_a_cloud_of_haze_is_refused(flat_room):
    haze = replace(flat_room, opacities=np.full(len(flat_room), 0.05, np.float32))
    with pytest.raises(ValueError, match="none with an opacity"):
        find_level(haze, convention="-y")
