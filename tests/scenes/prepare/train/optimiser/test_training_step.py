"""The native training step against the one put together of readable parts."""

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.prepare.train.optimiser.rows import (
    LOG_SCALE,
    LOGIT,
    MEAN,
    ROTATION,
    TrainingRows,
    fresh_rows,
)
from scenes.render.renderer import RenderOptions
from scenes.render.training import (
    FARTHEST,
    DepthBounds,
    Exposure,
    Trainee,
    TrainingTarget,
)
from tests.twins import loss, training_step

EXPOSURE = Exposure((1.1, 0.9, 1.0), (0.02, -0.01, 0.0), (-0.2, 0.05))
PLACE = Pose.from_yaw(0.2, (0.1, -0.2, 0.0))


@pytest.fixture(
    params=[Pinhole.from_fov(75, 53, np.radians(70)), Fisheye.from_fov(64, np.radians(190))],
    ids=["pinhole", "fisheye"],
)
def camera(request):
    return request.param


def some_rows(sh_count, seed=0, n=300):
    """Splats in view that have moved before: their next step is smooth in the slope."""
    rng = np.random.default_rng(seed)
    values = np.empty((n, 11 + 3 * sh_count), dtype=np.float32)
    values[:, MEAN] = rng.uniform([-2, -1.5, 1], [2, 1.5, 4], (n, 3))
    values[:, LOG_SCALE] = rng.uniform(-3.5, -1.5, (n, 3))
    values[:, ROTATION] = 1.7 * rng.normal(size=(n, 4))
    values[:, LOGIT] = rng.uniform(-4, 3, n)
    values[:, 11:] = 0.3 * rng.normal(size=(n, 3 * sh_count))
    rows = fresh_rows(values)
    return TrainingRows(
        rows.values,
        (1e-5 * rng.normal(size=values.shape)).astype(np.float32),
        np.full(values.shape, 1e-8, dtype=np.float32),
        rng.integers(1, 50, n).astype(np.uint32),
        rng.uniform(0, 1, n).astype(np.float32),
    )


def photo_of(camera, seed=1):
    rng = np.random.default_rng(seed)
    return rng.integers(0, 256, (camera.height_px, camera.width_px, 3), dtype=np.uint8)


def bounds_of(camera, seed=3):
    """Surfaces among the splats, and a part of the picture of which nothing is known."""
    rng = np.random.default_rng(seed)
    near = rng.uniform(1.5, 3.5, (camera.height_px, camera.width_px)).astype(np.float32)
    far = near * np.float32(1.02)
    near[:, :20], far[:, :20] = 0, FARTHEST
    return DepthBounds(near, far)


def arrays_of(rows):
    return rows.values, rows.first, rows.second, rows.steps, rows.error


@pytest.mark.parametrize("portable", [False, True])
@pytest.mark.parametrize(
    ("sh_count", "antialias", "depth_price"),
    [
        (1, False, 0.0),
        (4, True, 0.0),
        (16, False, 0.0),
        (1, False, 3.0),
        (4, True, 0.5),
    ],
)
def test_a_native_step_is_the_readable_one(camera, sh_count, antialias, portable, depth_price):
    rows = some_rows(sh_count)
    photo = photo_of(camera)
    rates = np.linspace(1e-3, 2e-2, rows.values.shape[1]).astype(np.float32)
    options = RenderOptions(background=(0.1, 0.2, 0.3), antialias=antialias)
    bounds = bounds_of(camera)
    wanted, wanted_distance = training_step.step(
        rows,
        photo,
        camera,
        PLACE,
        rates=rates,
        exposure=EXPOSURE,
        options=options,
        bounds=bounds,
        depth_price=depth_price,
    )
    trainee = Trainee(arrays_of(rows), portable=portable)
    target = TrainingTarget(photo, camera, PLACE, bounds)
    found = trainee.step(target, rates, EXPOSURE, options, depth_price)
    assert found.l1 == pytest.approx(wanted_distance.l1, rel=1e-5)
    assert found.dssim == pytest.approx(wanted_distance.dssim, rel=1e-5)
    np.testing.assert_allclose(found.d_gain, wanted_distance.d_gain, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(found.d_bias, wanted_distance.d_bias, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(found.d_falloff, wanted_distance.d_falloff, rtol=1e-3, atol=1e-6)
    after = TrainingRows(*trainee.arrays())
    np.testing.assert_array_equal(after.steps, wanted.steps)
    assert (after.steps > rows.steps).mean() > 0.3
    np.testing.assert_allclose(after.error, wanted.error, rtol=1e-4, atol=1e-4)
    # Moments say what the gradients were, values what Adam made of them.
    for name in ("first", "values"):
        before = getattr(rows, name).astype(np.float64)
        moved = getattr(after, name) - before
        expected = getattr(wanted, name) - before
        for column in range(moved.shape[1]):
            size = np.abs(expected[:, column]).max()
            off = np.abs(moved - expected)[:, column]
            assert off.max() < 1e-2 * size + 1e-6, (name, column)
            assert np.median(off) < 2e-5 * size + 1e-7, (name, column)


def test_threads_change_no_bit(camera):
    rows = some_rows(4)
    target = TrainingTarget(photo_of(camera), camera, PLACE)
    rates = np.full(rows.values.shape[1], 1e-2, dtype=np.float32)
    results = []
    for threads in (1, 3):
        trainee = Trainee(arrays_of(rows))
        for _ in range(3):
            trainee.step(target, rates, EXPOSURE, RenderOptions(threads=threads))
        results.append(trainee.arrays())
    for one, three in zip(*results, strict=True):
        np.testing.assert_array_equal(one, three)


def test_steps_lead_to_the_photo(camera):
    rows = some_rows(4)
    photo = np.full((camera.height_px, camera.width_px, 3), (200, 120, 40), dtype=np.uint8)
    target = TrainingTarget(photo, camera, PLACE)
    rates = np.full(rows.values.shape[1], 1e-2, dtype=np.float32)
    trainee = Trainee(arrays_of(rows))
    options = RenderOptions(background=(200 / 255, 120 / 255, 40 / 255))
    losses = [trainee.step(target, rates, Exposure(), options).loss for _ in range(60)]
    assert losses[-1] < 0.3 * losses[0]


def test_damaged_splats_do_no_harm(camera):
    rows = some_rows(1)
    rows.values[::7, 0] = np.nan
    rows.values[3::7, LOG_SCALE] = np.inf
    rows.values[5::7, ROTATION] = 0
    trainee = Trainee(arrays_of(rows))
    rates = np.full(rows.values.shape[1], 1e-2, dtype=np.float32)
    target = TrainingTarget(photo_of(camera), camera, PLACE)
    for _ in range(3):
        assert np.isfinite(trainee.step(target, rates, Exposure(), RenderOptions()).loss)
    sound = np.isfinite(rows.values).all(axis=1) & (rows.values[:, ROTATION] != 0).any(axis=1)
    assert np.isfinite(trainee.arrays()[0][sound]).all()


@pytest.mark.parametrize("size", [(40, 30), (11, 7), (3, 2)])
def test_the_native_distance_is_the_readable_one(size):
    camera = Pinhole.from_fov(*size, np.radians(60))
    photo = photo_of(camera)
    rgb = np.random.default_rng(2).uniform(0, 1, photo.shape).astype(np.float32)
    found, d_rgb = TrainingTarget(photo, camera, PLACE).distance(rgb, EXPOSURE)
    wanted, wanted_d_rgb = loss.distance(rgb.astype(np.float64), photo / 255, EXPOSURE)
    assert found.loss == pytest.approx(wanted.loss, abs=1e-6)
    np.testing.assert_allclose(d_rgb, wanted_d_rgb, atol=2e-4 * np.abs(wanted_d_rgb).max())


def test_a_photo_of_the_wrong_size_is_refused():
    camera = Pinhole.from_fov(40, 30, 1.0)
    with pytest.raises(ValueError, match=r"got uint8 \(40, 30, 3\), wanted .*\(30, 40, 3\)"):
        TrainingTarget(np.zeros((40, 30, 3), dtype=np.uint8), camera, PLACE)


def test_rows_that_do_not_fit_are_refused():
    rows = some_rows(4)
    with pytest.raises(ValueError, match="wanted"):
        Trainee((rows.values[:, :20], rows.first, rows.second, rows.steps, rows.error))
