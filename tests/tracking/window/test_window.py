"""Windows of a lens picture, what is drawn into them, and when a drawing still serves."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from tracking.background.layers import LayerCache, drawn_layer
from tracking.model.object_model import make_model
from tracking.window.window import LARGEST_SIDE_PX, window_around

LENS = Fisheye.from_fov(480, math.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
PLACES = st.tuples(*[st.floats(-3.0, 3.0)] * 3).filter(lambda p: np.linalg.norm(p) > 0.3)


def ball(count=300):
    rng = np.random.default_rng(5)
    means = rng.normal(size=(count, 3))
    means *= 0.1 / np.linalg.norm(means, axis=1, keepdims=True)
    return SplatCloud(
        means.astype(np.float32),
        np.full((count, 3), 0.015, np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        np.full(count, 0.9, np.float32),
        rng.uniform(-1, 1, (count, 1, 3)).astype(np.float32),
    )


@given(PLACES, st.floats(0.05, 0.8))
def test_a_window_lies_in_the_picture_and_sees_what_the_lens_sees(place, radius_m):
    window = window_around(RIG, Pose.identity(), place, radius_m=radius_m)
    left, top, width, height = window.corner_and_size
    assert left >= 0
    assert left + width * window.shrink <= LENS.width_px
    assert top >= 0
    assert top + height * window.shrink <= LENS.height_px
    assert max(width, height) <= LARGEST_SIDE_PX
    point = window.world_from_camera.inverse() @ np.array([place])
    in_window, _ = window.camera.project(point)
    in_lens, seen = LENS.project(point)
    np.testing.assert_allclose(window.lens_pixels(in_window), in_lens, atol=1e-6)
    if seen[0]:
        assert (in_window[0] >= 0).all()
        assert (in_window[0] <= (width, height)).all()


def test_a_near_object_is_looked_at_in_whole_shrunk_pixels():
    near = window_around(RIG, Pose.identity(), (0.0, 0.1, 0.7), radius_m=0.5)
    far = window_around(RIG, Pose.identity(), (0.0, 0.1, 3.0), radius_m=0.5)
    assert near.shrink == 2
    assert far.shrink == 1
    rows, columns = near.part
    assert rows.stop - rows.start == 2 * near.camera.height_px
    assert columns.stop - columns.start == 2 * near.camera.width_px


@given(PLACES, st.floats(0.05, 0.8), st.floats(0.1, 1.0))
def test_a_window_about_a_box_leaves_out_only_what_lies_beside_it(place, radius_m, slender):
    box = np.array(list(product((-1, 1), repeat=3))) * radius_m / 3**0.5 * (slender, slender, 1.0)
    whole = window_around(RIG, Pose.identity(), place, radius_m=radius_m, lens=0)
    part = window_around(
        RIG, Pose.identity(), place, radius_m=radius_m, box_in_world=place + box, lens=0
    )
    assert part.shrink == whole.shrink
    assert part.camera.width_px <= whole.camera.width_px + 1
    assert part.camera.height_px <= whole.camera.height_px + 1
    pixels = LENS.project(place + box)[0]
    pixels = pixels[_within(whole, pixels, 0.0)]
    assert _within(part, pixels, 1.0 + part.shrink).all()


def _within(window, pixels, margin_px):
    rows, columns = window.part
    low = np.array([columns.start, rows.start]) - margin_px
    high = np.array([columns.stop, rows.stop]) + margin_px
    return ((pixels >= low) & (pixels <= high)).all(axis=1)


@pytest.mark.parametrize("place", [(0.2, 0.1, 1.5), (1.5, 0.0, 0.05)])
def test_a_layer_lies_where_the_lens_sees_the_object(place):
    posed = PosedSplats(ball(), Pose.from_yaw(0.3, place))
    window = window_around(RIG, Pose.identity(), place, radius_m=0.15, lens=0)
    layer = drawn_layer(posed, window, LENS, NativeRenderer())
    height, width = layer.alpha.shape
    row, column = np.mgrid[0:height, 0:width] + 0.5
    total = layer.alpha.sum()
    middle = ((column * layer.alpha).sum() / total, (row * layer.alpha).sum() / total)
    seen = LENS.project(np.array([place]))[0][0]
    np.testing.assert_allclose(np.add(middle, (layer.left, layer.top)), seen, atol=0.5)
    distance = float(np.linalg.norm(place))
    assert abs(float(np.median(layer.range_m[layer.alpha > 0.9])) - distance) < 0.12
    nearer = np.asarray(layer.request(own_range_m=10.0)["nearer"])
    np.testing.assert_array_equal(nearer > 0, layer.range_m > 0)
    assert not np.asarray(layer.request(own_range_m=0.1)["nearer"]).any()


def test_a_memo_remembers_what_stands_still_and_nothing_that_moved_on():
    renderer, memo = NativeRenderer(), LayerCache()
    source = ObjectModel("ball", "ball", "", ball(20), (0.2, 0.2, 0.2), 0.0, Pose.identity())
    model = make_model(source, renderer)

    def layer(x, lens=0, rig_at_m=0.0):
        pose = Pose.from_yaw(0.0, (x, 0.0, 2.0))
        rig_pose = Pose.from_yaw(0.0, (0.0, rig_at_m, 0.0))
        return memo.layer(model.source, pose, RIG, rig_pose, renderer, lens=lens)

    first, behind = layer(0.0), layer(0.0, lens=1)
    assert layer(0.0) is first
    assert layer(0.0, rig_at_m=0.01) is not first
    for k in range(200):
        memo = LayerCache(memo.kept())
        layer(0.01 + 0.001 * k)
    assert len(memo.kept()) == 2
    assert layer(0.0, lens=1) is behind
    again = layer(0.0)
    assert again is not first
    np.testing.assert_array_equal(again.alpha, first.alpha)
