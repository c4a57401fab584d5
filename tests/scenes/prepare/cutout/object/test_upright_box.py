import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.object.upright_box import upright_box
from scenes.prepare.cutout.remainder.fill import fill_support
from scenes.prepare.cutout.votes.seen_from import SeenFrom
from scenes.prepare.cutout.votes.seen_surface import SeenSurface
from scenes.splats import SplatCloud


def flat(points, colour=0.0):
    n = len(points)
    sh = np.broadcast_to(np.asarray(colour, dtype=np.float32).reshape(-1, 1, 1), (n, 1, 3))
    scales = np.tile([0.012, 0.012, 0.001], (n, 1))
    return SplatCloud(points, scales, np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, 0.9), sh)


def floor_at(height, rng, without=0.0):
    points = rng.uniform((-1, -1, height), (1, 1, height + 1e-6), (12000, 3))
    return points[np.abs(points[:, :2]).max(axis=1) > without]


@settings(max_examples=40, deadline=None)
@given(
    size=st.tuples(*[st.floats(0.1, 0.8)] * 3),
    yaw=st.floats(-0.7, 0.7),
    height=st.floats(-1.0, 1.0),
)
def test_size_yaw_and_support_come_back(size, yaw, height):
    rng = np.random.default_rng(5)
    inner = rng.uniform(-0.5, 0.5, (6000, 3))
    side = rng.integers(0, 3, len(inner))
    inner[np.arange(len(inner)), side] = rng.choice([-0.5, 0.5], len(inner))
    world_from_box = Pose.from_yaw(yaw, (0.1, -0.2, height + size[2] / 2))
    cloud = flat(world_from_box @ (inner * size))
    found = upright_box(cloud, flat(floor_at(height, rng)))
    assert found.supported
    assert abs(found.support_z_m - height) < 0.002
    # Of the four rectangles alike the one next to the world's axes is told: sides may be swapped.
    turned = abs(found.world_from_box.yaw() - yaw) > np.pi / 4
    wanted = (size[1], size[0], size[2]) if turned else size
    np.testing.assert_allclose(found.size_m, wanted, atol=0.02)
    np.testing.assert_allclose(found.world_from_box.translation, (0.1, -0.2, height), atol=0.01)


def chair(rng, *, legs_from):
    """A seat and a back on four legs, as far down as they were found."""
    seat = rng.uniform((-0.2, -0.2, 0.43), (0.2, 0.2, 0.47), (2000, 3))
    back = rng.uniform((-0.2, 0.17, 0.47), (0.2, 0.2, 0.9), (2000, 3))
    legs = rng.uniform((-0.02, -0.02, legs_from), (0.02, 0.02, 0.43), (600, 3))
    legs[:, :2] += rng.choice([-0.18, 0.18], (600, 2))
    return np.concatenate([seat, back, legs])


@pytest.mark.parametrize("legs_from", [0.0, 0.12, 0.25])
def test_a_chair_stands_on_the_floor_and_not_on_the_table_beside_it(legs_from):
    rng = np.random.default_rng(6)
    table = rng.uniform((0.25, -0.6, 0.45), (0.9, 0.6, 0.4501), (9000, 3))
    room = np.concatenate([floor_at(0.0, rng), table])
    found = upright_box(flat(chair(rng, legs_from=legs_from)), flat(room))
    assert found.supported
    assert abs(found.support_z_m) < 0.005
    assert abs(found.size_m[2] - 0.9) < 0.02


def test_a_book_whose_splats_hang_through_its_table_lies_on_it():
    rng = np.random.default_rng(7)
    book = rng.uniform((-0.12, -0.08, 0.7), (0.12, 0.08, 0.73), (900, 3))
    hanging = rng.uniform((-0.12, -0.08, 0.6), (0.12, 0.08, 0.7), (80, 3))
    table = rng.uniform((-0.5, -0.4, 0.7), (0.5, 0.4, 0.7001), (6000, 3))
    room = np.concatenate([floor_at(0.0, rng), table])
    found = upright_box(flat(np.concatenate([book, hanging])), flat(room))
    assert abs(found.support_z_m - 0.7) < 0.005


def test_a_box_that_lost_an_end_is_boxed_as_its_masks_show_it():
    rng = np.random.default_rng(4)
    world_from_box = Pose.from_yaw(0.3, (0.1, -0.2, 0.0))
    places = rng.uniform((-0.15, -0.1, 0.0), (0.15, 0.1, 0.06), (6000, 3))
    ends = np.array([(x, y, z) for x in (-0.15, 0.15) for y in (-0.1, 0.1) for z in (0.0, 0.06)])
    camera, views = Pinhole.from_fov(480, 360, 0.5), []
    for turn in (0.0, 2.0):
        eye = world_from_box.translation + 2.0 * np.array([np.cos(turn), np.sin(turn), 0.8])
        world_from_camera = look_at(eye, world_from_box.translation)
        pixels, _ = camera.project(world_from_camera.inverse() @ (world_from_box @ ends))
        mask = np.zeros((camera.height_px, camera.width_px), dtype=np.uint8)
        cv2.fillConvexPoly(mask, cv2.convexHull(np.floor(pixels).astype(np.int32)), 1)
        views.append(MaskedView("v", camera, world_from_camera, mask > 0))
    cloud = flat(world_from_box @ places[places[:, 0] < 0.1])
    floor = flat(floor_at(0.0, rng))
    assert max(upright_box(cloud, floor).size_m) < 0.27
    found = upright_box(cloud, floor, masks=views)
    np.testing.assert_allclose(found.size_m, (0.3, 0.2, 0.06), atol=0.015)
    np.testing.assert_allclose(found.world_from_box.translation, (0.1, -0.2, 0.0), atol=0.01)
    assert abs(found.world_from_box.yaw() - 0.3) < 0.03


def stool_seen_from_one_side(rng, *beside):
    """Size of the box of a stool with a round seat, and of what else lies in (low, high) corners.

    Views look along x, where the seat's near side is lost and its far side drawn too near.
    """
    turn, apart = rng.uniform(0, 2 * np.pi, 12_000), 0.18 * np.sqrt(rng.uniform(0, 1, 12_000))
    seat = np.column_stack([apart * np.cos(turn), apart * np.sin(turn), np.full(12_000, 0.45)])
    legs = [rng.uniform((x, y, 0.0), (x + 0.03, y + 0.03, 0.44), (1500, 3))
            for x in (-0.1, 0.07) for y in (-0.1, 0.07)]  # fmt: skip
    more = [rng.uniform(low, high, (1500, 3)) for low, high in beside]
    whole = np.concatenate([seat, *legs, *more])
    views = []
    for angle in (-0.3, -0.15, 0.0, 0.15, 0.3):
        eye = np.array([-2.2 * np.cos(angle), 2.2 * np.sin(angle), 1.5])
        nearer = 1.0 - 0.012 * (whole[:, :1] + 0.18) / 0.36
        views.append(SeenFrom(eye, eye + (whole - eye) * nearer))
    agreed = whole[(whole[:, 0] > -0.13) & (whole[:, 0] < 0.15)]
    floor = floor_at(0.0, rng, without=0.3)
    surface = SeenSurface(agreed, floor, tuple(views))
    return upright_box(flat(agreed), flat(floor), surface).size_m


def test_a_round_seat_is_as_long_as_wide_though_it_is_seen_from_one_side():
    size = stool_seen_from_one_side(np.random.default_rng(6))
    np.testing.assert_allclose(size, (0.36, 0.36, 0.45), atol=0.012)


def test_floor_beside_a_round_seat_is_not_its_but_legs_and_a_handle_are():
    rng = np.random.default_rng(7)
    left = ((-0.05, 0.17, 0.02), (0.05, 0.24, 0.1))
    right = ((-0.05, -0.24, 0.02), (0.05, -0.17, 0.1))
    handle = ((-0.02, 0.17, 0.3), (0.02, 0.24, 0.4))
    for beside, width_m in (((left,), 0.36), ((left, right), 0.48), ((handle,), 0.42)):
        size = stool_seen_from_one_side(rng, *beside)
        assert abs(size[1] - width_m) < 0.015, (beside, size)


def test_a_few_points_that_views_agree_about_do_not_make_a_thing_longer():
    rng = np.random.default_rng(8)
    inner = rng.uniform((-0.2, -0.2, 0.0), (0.2, 0.2, 0.4), (8000, 3))
    inner[np.arange(8000), rng.integers(0, 2, 8000)] = rng.choice([-0.2, 0.2], 8000)
    strays = rng.uniform((0.28, -0.1, 0.01), (0.34, 0.1, 0.05), (40, 3))
    views = tuple(
        SeenFrom(np.array([-3.0, y, 1.0]), np.concatenate([inner, strays]))
        for y in (-0.4, 0.0, 0.4)
    )
    floor = floor_at(0.0, rng, without=0.4)
    surface = SeenSurface(np.concatenate([inner, strays]), floor, views)
    found = upright_box(flat(inner), flat(floor), surface)
    np.testing.assert_allclose(found.size_m, (0.4, 0.4, 0.4), atol=0.015)


def test_nothing_below_is_no_support():
    rng = np.random.default_rng(1)
    cloud = flat(rng.uniform((0, 0, 1), (0.3, 0.3, 1.3), (2000, 3)))
    found = upright_box(cloud, flat(floor_at(0.0, rng)))
    assert not found.supported
    assert abs(found.support_z_m - 1.0) < 0.01
    with pytest.raises(ValueError, match="3 splats, wanted at least 4"):
        upright_box(flat(np.zeros((3, 3))), cloud)


def test_a_hole_is_filled_with_the_colours_around_it_and_only_a_hole():
    rng = np.random.default_rng(2)
    inner = rng.uniform((-0.2, -0.2, 0.0), (0.2, 0.2, 0.4), (4000, 3))
    points = floor_at(0.0, rng, without=0.2)
    floor = flat(points, np.where(points[:, 0] > 0, 1.0, -1.0))
    box = upright_box(flat(inner), floor)
    laid = fill_support(floor, inner, box)
    assert laid is not None
    assert np.abs(laid.means[:, :2]).max() < 0.25
    np.testing.assert_allclose(laid.means[:, 2], 0.0, atol=0.003)
    cells = np.unique(np.floor(laid.means[:, :2] / 0.05).astype(int), axis=0)
    assert len(cells) >= 60
    well_inside = np.abs(laid.means[:, 0]) > 0.05
    same = np.sign(laid.means[:, 0]) == np.sign(laid.sh[:, 0, 0])
    assert same[well_inside].mean() > 0.9
    whole = flat(floor_at(0.0, rng))
    again = fill_support(whole, inner, box)
    assert again is None or len(again) < 0.1 * len(laid)
