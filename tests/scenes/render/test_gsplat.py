"""The adapter to gsplat: what it hands over, what comes back, and what it says without a GPU."""

import sys

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.gsplat import GsplatRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
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
def test_agrees_with_the_reference(renderer, reference, wild_cloud, camera, degree, antialias):
    objects = [
        PosedSplats(wild_cloud(80, degree=degree, seed=1), OBJECT_POSE),
        PosedSplats(wild_cloud(60, degree=3, seed=2), Pose.from_yaw(0.3, (0.1, 0.2, 0.5))),
    ]
    options = RenderOptions(background=(0.2, 0.4, 0.6), sh_degree=degree, antialias=antialias)
    drawn = renderer.render(objects, camera, POSE, options)
    oracle = reference.render(objects, camera, POSE, options)
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


def test_damaged_splats_stay_at_home(renderer, wild_cloud, at_origin, camera):
    cloud = wild_cloud(10, seed=1)
    scales = cloud.scales.copy()
    scales[:5] = np.nan
    damaged = SplatCloud(cloud.means, scales, cloud.rotations, cloud.opacities, cloud.sh)
    sound = cloud.select(np.arange(5, 10))
    pose = Pose(np.eye(3), [0.0, 0.0, -2.0])
    np.testing.assert_array_equal(
        renderer.render(at_origin(damaged), camera, pose).rgb,
        renderer.render(at_origin(sound), camera, pose).rgb,
    )


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
