"""The shared origin on corners as a walking headset would see them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import WORLD_FROM_BOARD_FACING_X, look_at
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.quad import QrCode
from tracking.headset.codes import SeenCode
from tracking.headset.corner_fit import code_corners
from tracking.headset.origin import (
    CodePicture,
    Origin,
    OriginPlan,
    expected_corners,
    origin_after,
    shown_at,
)

CAMERA = Pinhole.from_fov(760, 428, math.radians(64.7))
DEVICE_FROM_WORLD = Pose.from_yaw(0.7, (1.0, 2.0, -1.5))


def upright(yaw_deg, place):
    return Pose.from_yaw(math.radians(yaw_deg), place) @ WORLD_FROM_BOARD_FACING_X


CODES = (
    QrCode("a", 0.24, upright(0, (-2, 0, 1.5))),
    QrCode("b", 0.24, upright(30, (-1.8, -1.2, 1.4))),
)
PLAN = OriginPlan(CODES, "camera", 0.12)
CAMERA_CODE = upright(20, (-1.2, 0.7, 1.1))


class Walker:
    def __init__(self, seed=0, device_from_world=DEVICE_FROM_WORLD):
        self.rng = np.random.default_rng(seed)
        self.device_from_world = device_from_world
        self.places = {c.payload: (c.world_from_code, c.side_m) for c in CODES}
        self.places["camera"] = (CAMERA_CODE, 0.12)
        self.count = 0

    def picture(self, *, only=None):
        k, self.count = self.count, self.count + 1
        eye = np.array([0.6 * math.cos(k / 9), 0.6 * math.sin(k / 9), 1.65])
        world_from_camera = look_at(eye, np.array([-1.8, -0.4, 1.4]))
        off = Pose(
            rotation_from_vector(self.rng.normal(0, math.radians(0.05), 3)),
            self.rng.normal(0, 0.002, 3),
        )
        codes = []
        for payload, (world_from_code, side_m) in self.places.items():
            corners = (world_from_camera.inverse() @ world_from_code) @ code_corners(side_m)
            pixels, is_in = CAMERA.project(corners)
            if is_in.all() and (only is None or payload in only):
                seen = pixels + self.rng.normal(0, 0.08, (4, 2))
                codes.append(SeenCode(payload, seen, np.full(4, 0.08)))
        device_from_camera = self.device_from_world @ world_from_camera @ off
        return CodePicture(k * 125_000_000, CAMERA, device_from_camera, tuple(codes))

    def walk(self, origin=None, *, pictures=60, plan=PLAN, only=None):
        origin = origin or Origin()
        for _ in range(pictures):
            picture = self.picture(only=only)
            origin = shown_at(origin_after(origin, picture, plan=plan), picture.t_ns, plan=plan)
        return origin


def error(origin, device_from_world=DEVICE_FROM_WORLD, at=PLAN.middle):
    off = origin.world_from_device @ device_from_world
    return 1e3 * np.linalg.norm(off @ at - at), math.degrees(rotation_angle(off.rotation))


def test_two_codes_give_the_origin_within_its_own_sigmas():
    for seed in range(4):
        origin = Walker(seed).walk()
        mm, degrees = error(origin)
        assert mm < 5.0
        assert degrees < 0.2
        assert mm < 3e3 * origin.sigma_m
        assert degrees < 3 * math.degrees(origin.sigma_rad)
        assert origin.seen
        assert not origin.moved


def test_one_code_is_enough_to_begin_and_is_known_to_be_less():
    one = Walker().walk(pictures=10, only={"a"})
    two = Walker().walk(pictures=10)
    assert one.sigma_rad > two.sigma_rad
    assert error(one)[0] < 25.0


def test_before_the_first_code_there_is_no_origin():
    origin = Walker().walk(only=set(), pictures=2)
    assert origin.world_from_device is None
    assert math.isinf(origin.sigma_m)
    assert expected_corners(origin, PLAN, camera=CAMERA, device_from_camera=Pose.identity()) == {}


def test_codes_are_expected_where_they_are_seen():
    walker = Walker()
    origin = walker.walk()
    picture = walker.picture()
    expected = expected_corners(
        origin, PLAN, camera=picture.camera, device_from_camera=picture.device_from_camera
    )
    assert set(expected) == {"a", "b", "camera"}
    for seen in picture.codes:
        assert np.abs(expected[seen.payload] - seen.corners_px).max() < 3.0


def test_a_headset_that_finds_itself_elsewhere_is_anchored_anew_and_what_is_shown_glides():
    walker = Walker()
    origin = walker.walk()
    walker.device_from_world = Pose.from_yaw(0.05, (0.3, 0.0, 0.0)) @ DEVICE_FROM_WORLD
    steps, before = [], origin.glide.b_from_a
    for _ in range(40):
        origin = walker.walk(origin, pictures=1)
        now = origin.glide.b_from_a
        steps.append(np.linalg.norm(now @ PLAN.middle - before @ PLAN.middle))
        before = now
    assert origin.anchor.restarts == 1
    assert error(origin, walker.device_from_world)[0] < 5.0
    shown = replace(origin.anchor.belief, a_from_b=before).a_from_b @ PLAN.middle
    assert np.linalg.norm(shown - walker.device_from_world @ PLAN.middle) < 0.02
    assert max(steps) < 0.08  # an eighth of a second of a third of a metre


def test_slow_drift_is_followed_without_a_restart():
    walker = Walker()
    origin = walker.walk()
    for k in range(120):
        walker.device_from_world = Pose.from_yaw(0.0, (2e-4 * k, 0.0, 0.0)) @ DEVICE_FROM_WORLD
        origin = walker.walk(origin, pictures=1)
    assert origin.anchor.restarts == 0
    assert error(origin, walker.device_from_world)[0] < 6.0


def test_a_code_that_was_moved_since_the_scan_is_left_out():
    walker = Walker()
    walker.places["b"] = (Pose.from_yaw(0.0, (0.0, 0.1, 0.0)) @ CODES[1].world_from_code, 0.24)
    origin = walker.walk(pictures=10, only={"a"})
    origin = walker.walk(origin, pictures=40)
    assert origin.moved == ("b",)
    assert error(origin)[0] < 12.0


def test_the_code_on_the_camera_is_followed_and_found_again_once_it_was_put_elsewhere():
    walker = Walker()
    origin = walker.walk()
    found = origin.carried.belief.a_from_b
    assert np.linalg.norm(found.translation - CAMERA_CODE.translation) < 0.006
    elsewhere = Pose.from_yaw(0.0, (0.2, -0.3, 0.0)) @ CAMERA_CODE
    walker.places["camera"] = (elsewhere, 0.12)
    origin = walker.walk(origin, pictures=20)
    assert origin.carried.restarts == 1
    found = origin.carried.belief.a_from_b
    assert np.linalg.norm(found.translation - elsewhere.translation) < 0.01


@pytest.mark.parametrize("plan", [OriginPlan(CODES), PLAN])
def test_payloads_are_those_of_all_codes(plan):
    assert plan.payloads == {"a", "b"} | ({"camera"} if plan.carried else set())
