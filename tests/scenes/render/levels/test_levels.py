"""Levels of detail: which splats are kept, and what the kept ones look like."""

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.render.levels.levels import contributions, levels_of, prune
from scenes.render.levels.object_views import views_around
from scenes.render.levels.refit import refit
from scenes.render.native import NativeRenderer
from scenes.render.reference.renderer import ReferenceRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud, concatenate

VALUES = ("means", "scales", "rotations", "opacities", "sh")


@pytest.fixture(scope="module")
def renderer():
    return NativeRenderer()


@pytest.fixture(scope="module")
def shell():
    """make(count) -> a ball's surface of flat splats with a pattern, in front of splats inside."""

    def make(count, *, inside=0, seed=0):
        rng = np.random.default_rng(seed)
        directions = rng.normal(size=(count + inside, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        radii = np.where(np.arange(count + inside) < count, 0.2, 0.08)
        sh = np.sin(4 * directions)[:, None, :] / SH_C0 * 0.4
        return SplatCloud(
            (directions * radii[:, None]).astype(np.float32),
            np.full((count + inside, 3), 0.6 / np.sqrt(count), np.float32),
            np.tile(np.array([1, 0, 0, 0], np.float32), (count + inside, 1)),
            rng.uniform(0.6, 1.0, count + inside).astype(np.float32),
            sh.astype(np.float32),
        )

    return make


def pictures(renderer, cloud, views):
    options = RenderOptions(antialias=True)
    posed = [PosedSplats(cloud, Pose.identity())]
    return [renderer.render(posed, v.camera, v.object_from_camera, options) for v in views]


def decibels(renderer, cloud, whole, views):
    """PSNR over what either cloud shows."""
    pairs = zip(pictures(renderer, cloud, views), pictures(renderer, whole, views), strict=True)
    squares = [((a.rgb - b.rgb) ** 2)[(a.alpha > 0.5) | (b.alpha > 0.5)].mean() for a, b in pairs]
    return -10 * np.log10(np.mean(squares))


def test_a_contribution_is_what_a_white_splat_adds_to_the_picture(renderer, wild_cloud):
    """The oracle draws one splat white among black ones: the sum of the picture is its weight."""
    cloud = wild_cloud(12, degree=2, seed=3, spread_m=0.3)
    views = views_around(cloud, count=2, sides_px=(40,))
    found = contributions(cloud, renderer, views)
    reference = ReferenceRenderer()
    for splat in range(len(cloud)):
        sh = np.full((len(cloud), 1, 3), -0.5 / SH_C0, np.float32)
        sh[splat] = 0.5 / SH_C0
        lit = SplatCloud(cloud.means, cloud.scales, cloud.rotations, cloud.opacities, sh)
        wanted = sum(float(p.rgb[..., 0].sum()) for p in pictures(reference, lit, views))
        assert found[splat] == pytest.approx(wanted, rel=1e-3, abs=0.02)


def test_hidden_and_damaged_splats_contribute_nothing(renderer, shell):
    cloud = shell(4000, inside=50)
    arrays = {name: getattr(cloud, name).copy() for name in VALUES}
    arrays["opacities"][:4000] = 1.0
    arrays["means"][7] = np.nan
    arrays["scales"][8] = 0.0
    found = contributions(SplatCloud(**arrays), renderer, views_around(cloud, count=6))
    assert found[7] == found[8] == 0
    assert found[4000:].sum() < 1e-3 * found[:4000].sum()
    assert np.count_nonzero(found[:4000]) > 3900


def test_pruning_keeps_the_heaviest_as_they_are(renderer, shell):
    cloud = shell(600, inside=200, seed=1)
    views = views_around(cloud, count=5, sides_px=(64,))
    weights = contributions(cloud, renderer, views)
    kept = np.sort(np.argsort(-weights, kind="stable")[:300])
    pruned = prune(cloud, 300, renderer=renderer, views=views)
    for name in VALUES:
        np.testing.assert_array_equal(getattr(pruned, name), getattr(cloud, name)[kept])
    seen = prune(cloud, 10_000, renderer=renderer, views=views)
    assert len(seen) == np.count_nonzero(weights)


def test_levels_look_like_the_whole_from_views_they_were_not_fitted_to(renderer, shell):
    cloud = shell(3000, inside=300, seed=2)
    small, same = levels_of(cloud, (800, 5000), renderer=renderer)
    assert len(small) == 800
    assert same is cloud
    turned = [
        type(view)(view.camera, Pose.from_yaw(0.5) @ view.object_from_camera)
        for view in views_around(cloud, count=5, sides_px=(90,))
    ]
    pruned = prune(cloud, 800, renderer=renderer)
    fitted_db = decibels(renderer, small, cloud, turned)
    assert fitted_db > decibels(renderer, pruned, cloud, turned) + 8
    assert fitted_db > 30


def test_refitting_is_deterministic_and_stays_drawable(renderer, shell):
    cloud = shell(300, seed=4)
    start = cloud.select(np.arange(0, 300, 3))
    views = views_around(cloud, count=4, sides_px=(48,))
    one, two = (refit(start, cloud, renderer=renderer, views=views, steps=12) for _ in range(2))
    for name in VALUES:
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
        assert np.isfinite(getattr(one, name)).all()
    assert (one.scales > 0).all()
    assert ((one.opacities > 0) & (one.opacities < 1)).all()


def test_views_show_the_whole_object_from_all_sides(renderer, shell):
    cloud = shell(4000)
    far = SplatCloud(*(getattr(cloud.select([0]), name) for name in VALUES))
    stray = SplatCloud(far.means + 50, far.scales, far.rotations, far.opacities, far.sh)
    views = views_around(concatenate([cloud, stray]), count=12, sides_px=(120, 60))
    assert [view.camera.width_px for view in views[:3]] == [120, 60, 120]
    eyes = np.array([view.object_from_camera.translation for view in views])
    assert np.abs(eyes.mean(axis=0)).max() < 0.1 * np.linalg.norm(eyes[0])
    for picture in pictures(renderer, cloud, views):
        border = np.concatenate([picture.alpha[[0, -1]].ravel(), picture.alpha[:, [0, -1]].ravel()])
        assert border.max() < 0.5
        assert (picture.alpha > 0.5).mean() > 0.2


def test_nothing_comes_of_nothing(renderer, wild_cloud):
    empty = wild_cloud(0)
    assert len(prune(empty, 5, renderer=renderer)) == 0
    assert levels_of(empty, (5,), renderer=renderer) == (empty,)
    assert levels_of(empty, (), renderer=renderer) == ()


@pytest.mark.parametrize("count", [0, -3])
def test_a_level_without_splats_is_refused(renderer, shell, count):
    with pytest.raises(ValueError, match=rf"count: got {count}, wanted at least 1"):
        prune(shell(10), count, renderer=renderer)
    with pytest.raises(ValueError, match="wanted at least 1"):
        levels_of(shell(10), (5, count), renderer=renderer)


def test_refitting_to_nothing_is_refused(renderer, shell):
    with pytest.raises(ValueError, match="views: got none"):
        refit(shell(10), shell(10), renderer=renderer, views=())
