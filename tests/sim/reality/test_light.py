"""`sim.reality.light`: the light at a place, and objects in it."""

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from sim.reality.light import irradiance_at, main_light, relit

PLACE = np.array([0.0, 0.0, 1.0])
AXES = np.concatenate([np.eye(3), -np.eye(3)])


@pytest.fixture(scope="module")
def light(scan):
    return irradiance_at(PLACE, scan.room, NativeRenderer())


def test_light_comes_from_the_bright_wall(light):
    towards = light.on(AXES, np.ones(6)).mean(axis=1)
    assert np.argmax(towards) == 0
    assert towards[0] > 3.0 * towards[3]
    direction, ambient, key = main_light(light)
    assert direction[0] > 0.9
    assert ambient > 0
    assert key > ambient


def test_what_is_round_takes_the_mean(light):
    flat = light.on(AXES, np.ones(6)).mean(axis=0)
    round_ = light.on(AXES, np.zeros(6))
    assert np.allclose(round_, round_[0])
    assert np.allclose(round_[0], flat, rtol=0.1)


def test_the_irradiance_of_a_uniform_surrounding_is_pi_times_its_radiance(scan):
    from dataclasses import replace

    grey = replace(scan.room, sh=np.zeros_like(scan.room.sh))
    found = irradiance_at(PLACE, grey, NativeRenderer()).on(AXES, np.ones(6))
    assert np.allclose(found, np.pi * 0.5**2.2, rtol=0.05)


def test_an_object_where_it_was_scanned_looks_as_it_did(scan, light):
    still = Pose.identity()
    same = relit(
        scan.box, before=light, world_from_object_before=still, now=light, world_from_object=still
    )
    assert np.allclose(same.sh, scan.box.sh, atol=1e-6)


def test_a_side_that_is_turned_to_the_light_becomes_lighter(scan, light):
    half_turn = Pose.from_yaw(np.pi)
    turned = relit(
        scan.box,
        before=light,
        world_from_object_before=Pose.identity(),
        now=light,
        world_from_object=half_turn,
    )
    dark_side = scan.box.means[:, 0] < -0.149
    lit_side = scan.box.means[:, 0] > 0.149
    assert (turned.colours()[dark_side] > scan.box.colours()[dark_side]).all()
    assert (turned.colours()[lit_side] < scan.box.colours()[lit_side]).all()
