"""The adapter to gsplat: what it hands over, what comes back, and what it says without a GPU."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.gsplat import GsplatRenderer
from scenes.render.renderer import TILE_PX, PosedSplats, RenderOptions, tiles_of
from scenes.splats import SplatCloud
from tests.scenes.render.gsplat_stand_in import StandInGsplat, stand_in_torch

POSE = Pose.from_yaw(-0.2, (0.0, 0.0, -1.5))
OBJECT_POSE = Pose.from_quaternion(np.array([0.5, 0.5, -0.5, 0.5]), (0.3, 0.1, 1.0))


@pytest.fixture
def kernels():
    return StandInGsplat()


@pytest.fixture
def renderer(kernels):
    return GsplatRenderer(torch=stand_in_torch(), gsplat=kernels)


@pytest.mark.parametrize("degree", [0, 1, 3])
@pytest.mark.parametrize("antialias", [False, True])
def test_agrees_with_the_reference(
    renderer, reference, wild_cloud, fitting_camera, degree, antialias
):
    objects = [
        PosedSplats(wild_cloud(80, degree=degree, seed=1), OBJECT_POSE),
        PosedSplats(wild_cloud(60, degree=3, seed=2), Pose.from_yaw(0.3, (0.1, 0.2, 0.5))),
    ]
    options = RenderOptions(background=(0.2, 0.4, 0.6), sh_degree=degree, antialias=antialias)
    drawn = renderer.render(objects, fitting_camera, POSE, options)
    oracle = reference.render(objects, fitting_camera, POSE, options)
    assert oracle.alpha.mean() > 0.05
    # A few needles seen along their length feel the float32 of the matrices.
    assert np.quantile(np.abs(drawn.alpha - oracle.alpha), 0.995) < 0.01
    # Alpha may reach 0.999 instead of 0.99: what is behind shows a little less.
    assert np.abs(drawn.rgb - oracle.rgb).mean() < 2e-3
    hit = (oracle.alpha > 0.1) & (drawn.alpha > 0.1)
    assert np.abs(drawn.depth / np.where(hit, oracle.depth, 1) - 1)[hit].mean() < 2e-3
    assert drawn.ids is None
    assert drawn.rgb.dtype == drawn.alpha.dtype == drawn.depth.dtype == np.float32


def test_a_pinhole_is_handed_over_in_pixels_and_metres(renderer, kernels, ball):
    camera = Pinhole(41, 31, 120.0, 110.0, 20.5, 14.0)
    options = RenderOptions(near_m=0.2, antialias=True)
    renderer.render([PosedSplats(ball((0, 0, 2.0)), OBJECT_POSE)], camera, POSE, options)
    (call,) = kernels.calls
    wanted = (POSE.inverse() @ OBJECT_POSE).matrix()
    np.testing.assert_allclose(call["viewmats"][0], wanted, atol=1e-6)
    np.testing.assert_array_equal(call["Ks"][0], [[120, 0, 20.5], [0, 110, 14], [0, 0, 1]])
    assert call["size"] == (41, 31)
    assert call["eps2d"] == pytest.approx(0.3)
    assert call["near_plane"] == pytest.approx(0.2)
    assert call["camera_model"] == "pinhole"
    assert call["calc_compensations"] is True


def test_a_fisheye_is_equidistant_and_sees_behind_itself(renderer, kernels, ball, at_origin):
    camera = Fisheye.from_fov(81, np.radians(240))
    picture = renderer.render(at_origin(ball((2.0, 0, -0.5), sigma_m=0.1)), camera, Pose.identity())
    (call,) = kernels.calls
    assert call["camera_model"] == "fisheye"
    assert call["near_plane"] < -1e6
    assert call["Ks"][0, 0, 0] == call["Ks"][0, 1, 1] == pytest.approx(camera.f_px)
    assert picture.alpha.max() > 0.7
    assert picture.depth.max() == pytest.approx(np.hypot(2.0, 0.5), rel=1e-5)


def test_damaged_splats_stay_at_home(renderer, wild_cloud, at_origin, fitting_camera):
    cloud = wild_cloud(10, seed=1)
    scales = cloud.scales.copy()
    scales[:5] = np.nan
    damaged = SplatCloud(cloud.means, scales, cloud.rotations, cloud.opacities, cloud.sh)
    sound = cloud.select(np.arange(5, 10))
    pose = Pose(np.eye(3), [0.0, 0.0, -2.0])
    np.testing.assert_array_equal(
        renderer.render(at_origin(damaged), fitting_camera, pose).rgb,
        renderer.render(at_origin(sound), fitting_camera, pose).rgb,
    )


def test_a_part_is_cut_out_of_the_whole(renderer, wild_cloud, at_origin):
    camera, objects = Pinhole.from_fov(50, 40, 1.0), at_origin(wild_cloud(60, seed=1))
    rows, columns = tiles_of(camera)
    mask = np.arange(rows * columns).reshape(rows, columns) % 2 == 0
    green = RenderOptions(background=(0.2, 0.7, 0.1))
    options = replace(green, region=(3, 5, 30, 20), tile_mask=mask)
    whole = renderer.render(objects, camera, POSE, green)
    part = renderer.render(objects, camera, POSE, options)
    drawn = mask.repeat(TILE_PX, axis=0).repeat(TILE_PX, axis=1)[:40, :50]
    drawn[:5], drawn[25:], drawn[:, :3], drawn[:, 33:] = False, False, False, False
    for name in ("rgb", "alpha", "depth"):
        inside = getattr(whole, name)[drawn]
        np.testing.assert_array_equal(getattr(part, name)[drawn], inside, name)
    assert inside.any()
    np.testing.assert_allclose(part.rgb[~drawn] - green.background, 0, atol=1e-7)
    assert not part.alpha[~drawn].any()
    assert not part.depth[~drawn].any()


def test_what_the_kernels_lack_is_refused(renderer):
    lens = Fisheye(90, 84, 27.0, 44.0, 43.0, 1.8, (-0.05, 0.01, -0.004, 0.0006))
    with pytest.raises(ValueError, match=r"camera\.distortion: got \(-0\.05, .*wanted zeros"):
        renderer.render([], lens, POSE)
    exact = RenderOptions(exact_above_rad=0.03)
    with pytest.raises(ValueError, match=r"exact_above_rad: got 0\.03, wanted inf: gsplat"):
        renderer.render([], Pinhole.from_fov(8, 8, 1.0), POSE, exact)


def test_a_cloud_is_uploaded_once(renderer, wild_cloud, at_origin, monkeypatch):
    uploads = []
    as_tensor = renderer._torch.as_tensor
    monkeypatch.setattr(
        renderer._torch,
        "as_tensor",
        lambda values, device: (uploads.append(values.shape), as_tensor(values, device))[1],
    )
    objects = at_origin(wild_cloud(7, degree=1))
    for _ in range(3):
        renderer.render(objects, Pinhole.from_fov(8, 8, 1.0), Pose.identity())
    assert uploads.count((7, 4, 3)) == 1


@pytest.mark.parametrize("missing", ["torch", "gsplat"])
def test_a_missing_package_says_what_to_install(monkeypatch, missing):
    monkeypatch.setitem(sys.modules, "torch", stand_in_torch())
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(ImportError, match=rf"needs {missing} .*\[cuda\]"):
        GsplatRenderer()


def test_a_missing_device_is_an_error_in_words():
    with pytest.raises(RuntimeError, match=r"CUDA device.*NativeRenderer"):
        GsplatRenderer(torch=stand_in_torch(has_cuda=False), gsplat=StandInGsplat())
