import json
import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import (
    Fisheye,
    Pinhole,
    Rig,
    camera_from_json,
    camera_to_json,
    pixel_centres,
    rig_from_json,
    rig_to_json,
)
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose

PINHOLE = Pinhole(64, 48, 40.0, 50.0, 31.0, 25.5)
FISHEYE = Fisheye.from_fov(64, math.radians(200.0))
CAMERAS = pytest.mark.parametrize("camera", [PINHOLE, FISHEYE], ids=["pinhole", "fisheye"])
unit = st.floats(0.0, 1.0)


def inside_lens(camera, pixels):
    if isinstance(camera, Pinhole):
        return np.ones(len(pixels), bool)
    r = np.hypot(pixels[:, 0] - camera.cx, pixels[:, 1] - camera.cy)
    return r < camera.f_px * camera.max_angle - 1e-6


@CAMERAS
@given(x=unit, y=unit, distance=st.floats(0.01, 100.0))
def test_project_undoes_unproject(camera, x, y, distance):
    pixels = np.array([[x * camera.width_px, y * camera.height_px]])
    back, valid = camera.project(distance * camera.unproject(pixels))
    if inside_lens(camera, pixels).all():
        # The border itself may round to either side.
        if 1e-6 < x < 1 - 1e-6 and 1e-6 < y < 1 - 1e-6:
            assert valid.all()
        np.testing.assert_allclose(back, pixels, atol=1e-7)
    else:
        assert not valid.all() or np.hypot(*(pixels[0] - 32)) < 32 + 1e-6


@CAMERAS
def test_every_pixel_centre_round_trips_and_rays_are_unit(camera):
    pixels = pixel_centres(camera)
    assert pixels.shape == (camera.width_px * camera.height_px, 2)
    np.testing.assert_array_equal(pixels[:2], [[0.5, 0.5], [1.5, 0.5]])
    np.testing.assert_array_equal(pixels[camera.width_px], [0.5, 1.5])
    rays = camera.unproject(pixels)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0, atol=1e-12)
    keep = inside_lens(camera, pixels)
    back, valid = camera.project(rays)
    assert valid[keep].all()
    np.testing.assert_allclose(back[keep], pixels[keep], atol=1e-9)


@CAMERAS
def test_axes_are_opencv(camera):
    centre = np.array([camera.cx, camera.cy])
    right, _ = camera.project([[0.1, 0.0, 1.0]])
    down, _ = camera.project([[0.0, 0.1, 1.0]])
    ahead, valid = camera.project([[0.0, 0.0, 1.0]])
    np.testing.assert_allclose(ahead[0], centre, atol=1e-12)
    assert valid.all()
    assert right[0, 0] > centre[0]
    assert right[0, 1] == pytest.approx(centre[1])
    assert down[0, 1] > centre[1]
    assert down[0, 0] == pytest.approx(centre[0])


@CAMERAS
@pytest.mark.parametrize("point", [[0, 0, 0], [0, 0, -1]])
def test_the_centre_and_what_is_straight_behind_are_not_seen(camera, point):
    _, valid = camera.project([point])
    assert not valid.any()


def test_pinhole_against_the_formula_and_field_of_view():
    pixels, _ = PINHOLE.project([[0.3, -0.2, 2.0]])
    np.testing.assert_allclose(pixels, [[40 * 0.15 + 31, 50 * -0.1 + 25.5]])
    wide = Pinhole.from_fov(100, 50, math.radians(90.0))
    edge = wide.unproject([[100.0, 25.0]])[0]
    np.testing.assert_allclose(edge, [math.sqrt(0.5), 0, math.sqrt(0.5)], atol=1e-12)


def test_opencv_counts_pixels_from_the_middle_of_the_first():
    camera = Pinhole(40, 30, 50.0, 52.0, 20.0, 15.0)
    point = np.array([0.1, -0.2, 2.0])
    x, y, z = camera.opencv_matrix() @ point
    np.testing.assert_allclose(camera.project(point)[0][0] - 0.5, [x / z, y / z])


def test_pinhole_does_not_see_behind_or_outside():
    _, valid = PINHOLE.project([[0.1, 0.1, -1.0], [5.0, 0.0, 1.0], [0.0, 0.0, 1.0]])
    np.testing.assert_array_equal(valid, [False, False, True])


@given(theta=st.floats(0.0, math.radians(99.9)), azimuth=st.floats(-math.pi, math.pi))
def test_fisheye_radius_is_proportional_to_the_angle(theta, azimuth):
    ray = [
        math.sin(theta) * math.cos(azimuth),
        math.sin(theta) * math.sin(azimuth),
        math.cos(theta),
    ]
    pixels, valid = FISHEYE.project([ray])
    assert valid.all()
    radius = np.hypot(*(pixels[0] - 32.0))
    assert radius == pytest.approx(64 / math.radians(200.0) * theta, abs=1e-9)


def test_fisheye_sees_beyond_90_degrees_and_stops_at_its_edge():
    def ray(degrees):
        return [math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees))]

    pixels, valid = FISHEYE.project([ray(90.0), ray(99.0), ray(101.0), ray(180.0)])
    np.testing.assert_array_equal(valid, [True, True, False, False])
    np.testing.assert_allclose(pixels[0], [32 + 64 * 90 / 200, 32])


def test_two_lenses_see_everything():
    rig = Rig((FISHEYE, FISHEYE), (Pose.identity(), FRONT_FROM_BACK_LENS))
    directions = np.random.default_rng(1).normal(size=(500, 3))
    seen = np.zeros(500, bool)
    for lens, rig_from_lens in zip(rig.lenses, rig.rig_from_lens, strict=True):
        seen |= lens.project(rig_from_lens.inverse() @ directions)[1]
    assert seen.all()


@CAMERAS
def test_json_round_trip(camera):
    assert camera_from_json(camera_to_json(camera)) == camera


def test_rig_json_round_trip():
    rig = Rig((FISHEYE, FISHEYE), (Pose.identity(), FRONT_FROM_BACK_LENS))
    back = rig_from_json(rig_to_json(rig))
    assert back.lenses == rig.lenses
    for ours, theirs in zip(rig.rig_from_lens, back.rig_from_lens, strict=True):
        np.testing.assert_allclose(theirs.matrix(), ours.matrix(), atol=1e-12)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Pinhole(0, 4, 1, 1, 0, 0), "size 0×4"),
        (lambda: Pinhole(4, 4, -1, 1, 0, 0), "focal length"),
        (lambda: Pinhole(4, 4, math.nan, 1, 0, 0), "focal length"),
        (lambda: Pinhole.from_fov(4, 4, math.pi), "field of view"),
        (lambda: Fisheye(4, 4, 1.0, 2, 2, 0.0), "max_angle"),
        (lambda: Fisheye(4, 4, 1.0, 2, 2, 4.0), "max_angle"),
        (lambda: Fisheye(4, 4, math.inf, 2, 2, 1.0), "focal length"),
        (lambda: Rig((), ()), "0 lenses"),
        (lambda: Rig((FISHEYE,), ()), "1 lenses and 0 poses"),
        (lambda: camera_from_json({"model": "tele"}), "'tele'"),
        (lambda: camera_from_json({"model": "pinhole", "fx": 1}), "missing"),
        (lambda: rig_from_json({"lenses": []}), "rig_from_lens"),
        (
            lambda: rig_from_json({"lenses": [camera_to_json(PINHOLE)], "rig_from_lens": []}),
            "fisheye",
        ),
    ],
)
def test_what_is_no_camera_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


def in_order(limit):
    """Coefficients of a lens of 210° whose radii grow: slopes of each term stay small."""
    sizes = [limit / ((2 * n + 3) * math.radians(105) ** (2 * n + 2)) for n in range(4)]
    return st.tuples(*(st.floats(-size, size) for size in sizes))


@given(in_order(0.24), st.floats(0.0, 1.0), st.floats(0, 6.2831), st.floats(0.1, 10.0))
def test_a_distorted_fisheye_is_inverted(distortion, share, azimuth, range_m):
    lens = Fisheye(300, 280, 70.0, 151.0, 138.0, math.radians(105), distortion)
    angle = share * 1.2 * lens.max_angle
    sine = math.sin(angle)
    ray = np.array([sine * math.cos(azimuth), sine * math.sin(azimuth), math.cos(angle)])
    pixels, valid = lens.project(range_m * ray)
    np.testing.assert_allclose(lens.unproject(pixels)[0], ray, atol=1e-9)
    assert not valid[0] or angle <= lens.max_angle
    radius = np.hypot(pixels[0, 0] - lens.cx, pixels[0, 1] - lens.cy)
    assert radius == pytest.approx(float(lens.radius_px(np.array(angle))), abs=1e-9)


@given(in_order(0.24))
def test_radii_grow_as_their_slope_says(distortion):
    lens = Fisheye(300, 280, 70.0, 151.0, 138.0, math.radians(105), distortion)
    angles = np.linspace(0.0, 1.3 * lens.max_angle, 60)
    numeric = (lens.radius_px(angles + 1e-6) - lens.radius_px(angles - 1e-6)) / 2e-6
    np.testing.assert_allclose(lens.f_px * lens.radius_slope(angles), numeric, rtol=1e-4)
    assert (numeric > 0).all()


def test_a_distorted_fisheye_agrees_with_opencv():
    """`cv2.fisheye` maps x/z, y/z by the same polynomial, in front of the lens."""
    lens = Fisheye(640, 480, 210.0, 320.5, 240.25, math.radians(80), (0.03, -0.01, 0.002, -0.0003))
    rng = np.random.default_rng(4)
    points = np.column_stack([rng.uniform(-1, 1, (50, 2)), rng.uniform(0.6, 2.0, 50)])
    matrix = np.array([[210.0, 0, 320.5], [0, 210.0, 240.25], [0, 0, 1]])
    wanted, _ = cv2.fisheye.projectPoints(
        points[:, None], np.zeros(3), np.zeros(3), matrix, np.array(lens.distortion)
    )
    np.testing.assert_allclose(lens.project(points)[0], wanted[:, 0], atol=1e-9)


def test_a_lens_that_folds_back_is_refused():
    with pytest.raises(ValueError, match=r"folds back 1\.29\d* rad off axis.*max_angle, 1\.5"):
        Fisheye(64, 64, 20.0, 32.0, 32.0, 1.5, (-0.2, 0.0, 0.0, 0.0))
    Fisheye(64, 64, 20.0, 32.0, 32.0, 1.2, (-0.2, 0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"distortion: .*wanted four finite"):
        Fisheye(64, 64, 20.0, 32.0, 32.0, 1.2, (0.1, math.nan, 0.0, 0.0))


def test_coefficients_survive_json():
    lens = Fisheye(64, 60, 20.0, 32.0, 30.0, 1.5, (0.02, -0.01, 0.003, -0.0002))
    assert camera_from_json(json.loads(json.dumps(camera_to_json(lens)))) == lens
    assert camera_to_json(FISHEYE)["model"] == "equidistant"


def test_a_resized_lens_sees_the_same():
    lens = Fisheye(64, 60, 20.0, 31.0, 29.0, 1.5, (0.02, -0.01, 0.003, -0.0002))
    twice = lens.resized(128, 120)
    point = np.array([0.3, -0.8, 0.4])
    np.testing.assert_allclose(twice.project(point)[0], 2 * lens.project(point)[0])
