from dataclasses import replace

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.object.box_in_masks import box_in_masks

CAMERA = Pinhole.from_fov(640, 480, 0.5)
HEIGHT_M = 0.05


def prism(outline, bottom=0.7):
    """Points all over the hull of a level outline (N, 2), from one height to another."""
    return np.concatenate(
        [np.column_stack([outline, np.full(len(outline), bottom + up)]) for up in (0.0, HEIGHT_M)]
    )


def seen_from(turn, bodies):
    """A view of convex bodies, each the hull of points, from two metres away and above."""
    middle = np.concatenate(bodies).mean(axis=0)
    eye = middle + 2.0 * np.array([np.cos(turn), np.sin(turn), 0.7])
    world_from_camera = look_at(eye, middle)
    mask = np.zeros((CAMERA.height_px, CAMERA.width_px), dtype=np.uint8)
    for points in bodies:
        pixels, _ = CAMERA.project(world_from_camera.inverse() @ points)
        cv2.fillConvexPoly(mask, cv2.convexHull(np.floor(pixels).astype(np.int32)), 1)
    return MaskedView("v", CAMERA, world_from_camera, mask > 0)


def rectangle(size, yaw, middle=(0.3, -0.2)):
    corners = 0.5 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * size
    turned = Pose.from_yaw(yaw, (*middle, 0.0)) @ np.column_stack([corners, np.zeros(4)])
    return turned[:, :2]


SPAN = 0.7, 0.7 + HEIGHT_M


@settings(max_examples=15, deadline=None)
@given(
    size=st.tuples(st.floats(0.1, 0.3), st.floats(0.1, 0.3)),
    yaw=st.floats(-0.75, 0.75),
    turns=st.lists(st.floats(0.0, 6.28), min_size=1, max_size=3),
)
def test_a_box_is_found_to_the_pixel_though_little_is_known_of_its_place(size, yaw, turns):
    outline = rectangle(size, yaw)
    views = [seen_from(turn, [prism(outline)]) for turn in turns]
    found = box_in_masks(views, outline + np.array([0.02, 0.015]), SPAN)
    assert found is not None
    assert abs(found.yaw - yaw) < np.deg2rad(3.0)
    np.testing.assert_allclose(found.sides_m, size, atol=0.012)
    np.testing.assert_allclose(found.middle, (0.3, -0.2), atol=0.008)


def test_of_three_masks_one_may_be_wrong():
    outline = rectangle((0.25, 0.18), 0.4)
    views = [seen_from(turn, [prism(outline)]) for turn in (0.3, 2.0)]
    wrong = seen_from(4.0, [prism(outline), prism(outline + np.array([0.15, 0.0]))])
    found = box_in_masks([*views, wrong], outline, SPAN)
    assert found is not None
    np.testing.assert_allclose(found.sides_m, (0.25, 0.18), atol=0.012)


def test_what_is_no_box_is_not_taken_for_one():
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    round_one = 0.08 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    handle = rectangle((0.05, 0.015), 0.0, middle=(0.1, 0.0))
    corner = [rectangle((0.3, 0.1), 0.0, (0.0, 0.0)), rectangle((0.1, 0.3), 0.0, (-0.1, 0.1))]
    for outlines in ([round_one], [round_one, handle], corner):
        views = [seen_from(turn, [prism(o) for o in outlines]) for turn in (0.2, 2.2, 4.4)]
        assert box_in_masks(views, np.concatenate(outlines), SPAN) is None


def test_views_from_too_far_away_are_not_heard():
    outline = rectangle((0.25, 0.18), 0.4)
    near = seen_from(0.3, [prism(outline)])
    far = replace(near, camera=replace(CAMERA, fx=CAMERA.fx / 4, fy=CAMERA.fy / 4))
    assert box_in_masks([near], outline, SPAN) is not None
    assert box_in_masks([far], outline, SPAN) is None
    assert box_in_masks([near, far], outline, SPAN) == box_in_masks([near], outline, SPAN)


def test_without_masks_nothing_is_told():
    assert box_in_masks((), rectangle((0.2, 0.2), 0.0), SPAN) is None


def test_a_box_that_leaves_much_of_the_thing_out_is_none():
    legs = rectangle((0.2, 0.2), 0.3)
    views = [seen_from(turn, [prism(legs)]) for turn in (0.3, 2.0, 4.0)]
    across = np.linspace(-0.5, 0.5, 9)
    seat = np.stack(np.meshgrid(across, across), axis=-1).reshape(-1, 2)
    assert box_in_masks(views, 0.2 * seat + (0.3, -0.2), SPAN) is not None
    assert box_in_masks(views, 0.34 * seat + (0.3, -0.2), SPAN) is None


def test_a_seat_that_reaches_out_above_legs_is_no_box():
    def slab(width, low, high):
        outline = rectangle((width, width), 0.3)
        return np.concatenate([np.column_stack([outline, np.full(4, z)]) for z in (low, high)])

    # Masks often take in what is seen between legs, as if they were one block.
    legs, span = slab(0.24, 0.7, 1.1), (0.7, 1.1)
    known = rectangle((0.24, 0.24), 0.3)
    turns = (0.3, 2.0)
    block = [seen_from(turn, [legs]) for turn in turns]
    stool = [seen_from(turn, [legs, slab(0.3, 1.06, 1.1)]) for turn in turns]
    assert box_in_masks(block, known, span) is not None
    assert box_in_masks(stool, known, span) is None
