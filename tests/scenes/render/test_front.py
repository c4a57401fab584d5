"""Which body is in front: against formulas and against the reference."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.render.front import front_of
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import concatenate

PINHOLE = Pinhole(41, 31, 120.0, 120.0, 20.5, 15.5)
HERE = Pose.identity()


def test_shares_and_depths_follow_the_formula(renderer, ball, at_origin):
    veil, body = ball((0, 0, 2.0), opacity=0.2), ball((0, 0, 4.0), opacity=0.9)
    front = front_of(renderer, at_origin(veil, body), 1, PINHOLE, HERE)
    assert front.share[15, 20] == pytest.approx(0.72, abs=2e-6)
    assert front.alpha[15, 20] == pytest.approx(0.92, abs=2e-6)
    assert front.depth_m[15, 20] == pytest.approx(4.0, rel=1e-5)
    assert front.rest_depth_m[15, 20] == pytest.approx(2.0, rel=1e-5)
    assert front.is_seen[15, 20]
    assert not front.is_front[15, 20]
    veiled = front_of(renderer, at_origin(veil, body), 0, PINHOLE, HERE)
    assert not veiled.is_seen[15, 20]
    assert not front.is_seen[0, 0]
    assert front.depth_m[0, 0] == front.rest_depth_m[0, 0] == 0


def test_faint_splats_count_together(renderer, ball, at_origin):
    """The heaviest single splat is the wall's, but the body hides most of it."""
    body = at_origin(*(ball((0, 0, 2.0 + 0.01 * k), opacity=0.3) for k in range(3)))
    whole = PosedSplats(concatenate([posed.cloud for posed in body]), Pose.identity())
    wall = at_origin(ball((0, 0, 3.0), opacity=0.99))[0]
    assert renderer.render([wall, whole], PINHOLE, HERE).ids[15, 20] == 0
    assert front_of(renderer, [wall, whole], 1, PINHOLE, HERE).is_front[15, 20]


def test_shares_add_up_and_agree_with_the_reference(native, reference, wild_cloud, camera):
    objects = [
        PosedSplats(wild_cloud(120, seed=k, spread_m=0.5), Pose.from_yaw(k, (0.2 * k, 0.0, 1.5)))
        for k in range(3)
    ]
    options = RenderOptions(region=(5, 7, 50, 40))
    fronts = [front_of(native, objects, k, camera, HERE, options) for k in range(3)]
    alpha = native.render(objects, camera, HERE, options).alpha
    np.testing.assert_allclose(sum(front.share for front in fronts), alpha, atol=5e-6)
    assert any(front.is_seen.any() for front in fronts)
    for k, front in enumerate(fronts):
        oracle = front_of(reference, objects, k, camera, HERE, options)
        np.testing.assert_allclose(front.share, oracle.share, atol=2e-4)
        np.testing.assert_array_equal(front.alpha, alpha)
        firm = oracle.share > 0.05
        np.testing.assert_allclose(front.depth_m[firm], oracle.depth_m[firm], rtol=2e-3)
        firm = oracle.alpha - oracle.share > 0.05
        np.testing.assert_allclose(front.rest_depth_m[firm], oracle.rest_depth_m[firm], rtol=2e-3)


def test_an_index_out_of_range_is_refused(renderer, ball, at_origin):
    with pytest.raises(ValueError, match="index: got 2, wanted 0 to 1"):
        front_of(renderer, at_origin(ball((0, 0, 1)), ball((0, 0, 2))), 2, PINHOLE, HERE)
