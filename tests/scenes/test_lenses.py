import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import Fisheye, Pinhole
from scenes.lenses import UnifiedSphere, as_fisheye, lens_from_json, lens_to_json
from scenes.pose import Pose
from scenes.warp import warp, warp_table

# As a consumer 360° camera states one of its lenses.
SOLD = UnifiedSphere(
    5376, 5376, 2.0, 4291.91, 4291.47, 2684.25, 2687.75,
    0.18322477, 2.08857179, -3.3665545, 0.00089921, 0.0003806,
)  # fmt: skip
PLAIN = UnifiedSphere(640, 640, 1.0, 320.0, 320.0, 320.0, 320.0)
unit = st.floats(0.0, 1.0)


def by_the_formula(lens, ray):
    """One ray's pixel, a line of the model at a time."""
    x, y, z = np.asarray(ray) / np.linalg.norm(ray)
    mx, my = x / (z + lens.xi), y / (z + lens.xi)
    r2 = mx**2 + my**2
    radial = 1 + lens.k1 * r2 + lens.k2 * r2**2 + lens.k3 * r2**3
    u = mx * radial + 2 * lens.p1 * mx * my + lens.p2 * (r2 + 2 * mx**2)
    v = my * radial + lens.p1 * (r2 + 2 * my**2) + 2 * lens.p2 * mx * my
    return lens.fx * u + lens.cx, lens.fy * v + lens.cy


def rays_within(angle, count=500, seed=0):
    rng = np.random.default_rng(seed)
    theta, phi = rng.uniform(0, angle, count), rng.uniform(0, 2 * math.pi, count)
    sine = np.sin(theta)
    return np.column_stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)])


def test_pixels_are_those_of_the_formula():
    for ray in rays_within(SOLD.max_angle):
        pixels, _ = SOLD.project(3.0 * ray[None])
        np.testing.assert_allclose(pixels[0], by_the_formula(SOLD, ray), rtol=0, atol=1e-9)


def test_a_sphere_seen_from_its_pole_is_stereographic():
    angle = math.radians(80)
    pixels, valid = PLAIN.project([[math.sin(angle), 0.0, math.cos(angle)]])
    assert pixels[0, 0] == pytest.approx(320 + 320 * math.tan(angle / 2), abs=1e-10)
    assert valid.all()


@given(
    xi=st.floats(0.0, 2.5),
    k=st.tuples(st.floats(-0.1, 0.3), st.floats(-0.2, 0.5), st.floats(-0.3, 0.3)),
    p=st.tuples(st.floats(-2e-3, 2e-3), st.floats(-2e-3, 2e-3)),
    angle=unit,
    turn=st.floats(0.0, 6.3),
    distance=st.floats(0.01, 100.0),
)
def test_unproject_undoes_project_within_the_lens(xi, k, p, angle, turn, distance):
    lens = UnifiedSphere(1000, 900, xi, 500.0, 505.0, 490.0, 460.0, *k, *p)
    theta = angle * min(lens.max_angle, math.radians(110))
    sine = math.sin(theta)
    ray = np.array([[sine * math.cos(turn), sine * math.sin(turn), math.cos(theta)]])
    pixels, _ = lens.project(distance * ray)
    np.testing.assert_allclose(lens.unproject(pixels), ray, atol=1e-11)


@given(share=unit, turn=st.floats(0.0, 6.3))
def test_every_pixel_of_the_lens_circle_has_a_unit_ray_that_leads_back(share, turn):
    radius = 1.02 * share * SOLD.circle_px
    pixel = np.array([[SOLD.cx + radius * math.cos(turn), SOLD.cy + radius * math.sin(turn)]])
    ray = SOLD.unproject(pixel)
    assert np.linalg.norm(ray) == pytest.approx(1.0, abs=1e-12)
    back, _ = SOLD.project(ray)
    np.testing.assert_allclose(back, pixel, atol=1e-6)


def test_the_lens_sees_beyond_the_side_and_ends_where_its_picture_folds():
    assert math.radians(100) < SOLD.max_angle < math.acos(-1 / SOLD.xi)
    angles = np.linspace(0.0, SOLD.max_angle, 400)
    rays = np.column_stack([np.sin(angles), np.zeros(400), np.cos(angles)])
    pixels, _ = SOLD.project(rays)
    assert (np.diff(pixels[:, 0]) > 0).all()
    past = SOLD.max_angle + 0.05
    _, valid = SOLD.project([[math.sin(past), 0.0, math.cos(past)], [0, 0, 0], [0, 0, -1]])
    assert not valid.any()


def test_a_field_of_view_that_is_given_is_kept_where_the_picture_can_show_it():
    assert replace(SOLD, max_angle=1.2).max_angle == 1.2
    # Undistorted, a lens with ξ below 1 shows up to where z + ξ vanishes, and less of it well.
    assert replace(PLAIN, xi=0.0).max_angle < math.pi / 2


def test_axes_are_opencv():
    centre, right, down = SOLD.project([[0, 0, 1], [0.1, 0, 1], [0, 0.1, 1]])[0]
    np.testing.assert_allclose(centre, [SOLD.cx, SOLD.cy], atol=1e-9)
    assert right[0] > centre[0]
    assert down[1] > centre[1]


def test_a_resized_lens_sees_the_same_rays():
    rays = rays_within(math.radians(95))
    small = SOLD.resized(1344, 1344)
    np.testing.assert_allclose(small.project(rays)[0] * 4, SOLD.project(rays)[0], atol=1e-9)
    assert small.circle_px * 4 == pytest.approx(SOLD.circle_px)


def test_the_nearest_fisheye_is_as_near_as_it_says():
    fit = as_fisheye(SOLD.resized(1440, 1440))
    rays = rays_within(math.radians(100), 4000)
    there = SOLD.resized(1440, 1440).project(rays)[0]
    left = np.linalg.norm(fit.fisheye.project(rays)[0] - there, axis=1)
    assert fit.rms_px < 0.3
    assert left.max() < 1.05 * fit.max_px
    assert np.sqrt(np.mean(left**2)) < 1.1 * fit.rms_px


def test_the_nearest_fisheye_of_a_round_lens_is_the_lens():
    round_lens = replace(SOLD.resized(1440, 1440), fx=1150.0, fy=1150.0, p1=0.0, p2=0.0)
    fit = as_fisheye(round_lens)
    assert fit.max_px < 0.1
    assert (fit.fisheye.cx, fit.fisheye.cy) == pytest.approx((round_lens.cx, round_lens.cy))


def test_what_the_fisheye_leaves_is_tangential_and_the_two_focal_lengths():
    lens = SOLD.resized(1440, 1440)
    apart = as_fisheye(replace(lens, fy=1.01 * lens.fx))
    assert apart.rms_px > 5 * as_fisheye(lens).rms_px


def test_a_picture_can_be_taken_to_the_fisheye_without_any_rest():
    lens = UnifiedSphere(200, 200, 1.5, 150.0, 160.0, 101.0, 98.0, 0.1, p1=0.004)
    target = Fisheye.from_fov(160, math.radians(160))
    table = warp_table(lens, target, Pose.identity())
    rows, columns = np.mgrid[0:200, 0:200].astype(np.float32)
    places = warp(np.dstack([columns + 0.5, rows + 0.5]), table)
    ray = target.unproject(np.array([[120.5, 40.5]]))
    np.testing.assert_allclose(places[40, 120], lens.project(ray)[0][0], atol=0.05)


@pytest.mark.parametrize(
    "lens",
    [SOLD, PLAIN, Fisheye.from_fov(64, 3.0), Pinhole(64, 48, 40.0, 50.0, 31.0, 25.5)],
    ids=["sold", "plain", "fisheye", "pinhole"],
)
def test_json_round_trip(lens):
    assert lens_from_json(json.loads(json.dumps(lens_to_json(lens)))) == lens


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"width_px": 0}, "0×"),
        ({"fx": -1.0}, "focal length"),
        ({"fy": 0.0}, "focal length"),
        ({"xi": -0.1}, "xi"),
        ({"k2": math.nan}, "k2"),
        ({"max_angle": 4.0}, "max_angle"),
    ],
)
def test_what_no_lens_can_be_is_refused(change, said):
    with pytest.raises(ValueError, match=said):
        replace(PLAIN, **change)


def test_a_missing_field_is_named():
    values = lens_to_json(PLAIN)
    del values["xi"]
    with pytest.raises(ValueError, match="xi"):
        lens_from_json(values)
