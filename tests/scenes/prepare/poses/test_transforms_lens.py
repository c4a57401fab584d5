"""Lenses as programs write them."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from scenes.prepare.poses.transforms_lens import (
    LensError,
    ignored_keys,
    lens_of,
    pinhole_picture,
)

PICTURE = np.zeros((480, 640, 3), dtype=np.uint8)
PLAIN = {"w": 640, "h": 480, "fl_x": 500.0}
BENT = {"k1": -0.02, "k2": 0.004}


@pytest.mark.parametrize(
    "stated",
    [
        {"is_fisheye": True},
        {"is_fisheye": 1},
        {"camera_model": "OPENCV_FISHEYE"},
        {"camera_model": "OPENCV_FISHEYE", "is_fisheye": True},
        {"camera_model": "RADIAL_FISHEYE"},
    ],
)
def test_a_fisheye_is_one_however_it_is_stated(stated):
    lens = lens_of(PLAIN | BENT | stated, PICTURE)
    assert lens.fisheye
    assert lens.coefficients == (-0.02, 0.004, 0.0, 0.0)
    # A ray at 0.5 rad, by the fisheye's own polynomial.
    theta = 0.5
    r = 500.0 * (theta - 0.02 * theta**3 + 0.004 * theta**5)
    bent = np.zeros((480, 640, 3), dtype=np.uint8)
    cv2.circle(bent, (round(319.5 + r), 240), 3, (255, 255, 255), -1)
    flat, _ = pinhole_picture(bent, lens)
    column = float(np.average(np.arange(640), weights=flat[..., 0].sum(axis=0)))
    assert column == pytest.approx(319.5 + 500.0 * math.tan(theta), abs=1.0)


@pytest.mark.parametrize(
    "stated", [{}, {"is_fisheye": False}, {"is_fisheye": "false"}, {"camera_type": "perspective"}]
)
def test_a_perspective_lens_stays_one(stated):
    lens = lens_of(PLAIN | BENT | {"k3": 0, "k4": 0} | stated, PICTURE)
    assert not lens.fisheye
    assert lens.coefficients == (-0.02, 0.004, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "stated",
    [
        {"k4": 0.01},
        {"s1": 0.001},
        {"equirectangular": True},
        {"latlong": True},
        {"ftheta_p1": 0.2},
        {"lens": "fisheye"},
        {"distortion": [0, 0.1]},
        {"is_fisheye": True, "p1": 0.01},
        {"camera_model": "FISHEYE624"},
        {"w": 0},
        {"k1": True},
    ],
)
def test_a_lens_that_is_not_understood_is_refused(stated):
    with pytest.raises(LensError):
        lens_of(PLAIN | stated, PICTURE)


def test_a_rational_lens_has_its_eight_coefficients():
    lens = lens_of(PLAIN | {"camera_model": "FULL_OPENCV", "k4": 0.1, "k6": 0.2}, PICTURE)
    assert lens.coefficients == (0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.2)


@pytest.mark.parametrize(
    ("given", "fx", "fy"),
    [
        ({"fl_y": 400.0}, 400.0, 400.0),
        ({"camera_angle_x": math.pi / 2}, 320.0, 320.0),
        ({"camera_angle_x": math.pi / 2, "camera_angle_y": math.pi / 2}, 320.0, 240.0),
        ({"x_fov": 90.0}, 320.0, 320.0),
    ],
)
def test_a_focal_length_is_read_from_whatever_gives_it(given, fx, fy):
    camera = lens_of(given, PICTURE).camera
    assert (camera.fx, camera.fy) == pytest.approx((fx, fy))


def test_only_keys_that_nothing_is_known_of_are_ignored():
    assert ignored_keys(["w", "k5", "aabb_scale", "lens_type", "room"]) == ("room",)
