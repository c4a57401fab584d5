import dataclasses

import numpy as np
import pytest

from scenes.prepare.align.align import align
from scenes.prepare.align.axis_scale import AxisScale, measured_axis_scale
from scenes.splats import SplatCloud
from tests.scenes.prepare.align.printed import SIDE_M, capture, wall_codes


@pytest.fixture(scope="module")
def alignment():
    codes = wall_codes(3)
    reconstruction, sightings, _ = capture(np.random.default_rng(0), codes=codes, feature_px=0.1)
    return align(
        reconstruction,
        sightings,
        sides_m=SIDE_M,
        world_from_codes=codes,
        rng=np.random.default_rng(0),
    )


def test_a_true_world_needs_no_stretch(alignment):
    assert measured_axis_scale(alignment).anisotropy < 0.01


def test_a_stretched_world_is_measured_and_told(alignment):
    wanted = AxisScale((1.03, 0.98, 1.01))
    squeezed = dataclasses.replace(
        alignment,
        anchors=tuple(
            dataclasses.replace(a, corners_m=a.corners_m / np.array(wanted.factors))
            for a in alignment.anchors
        ),
    )
    found = measured_axis_scale(squeezed)
    np.testing.assert_allclose(found.factors, wanted.factors, atol=0.008)
    assert found.anisotropy == pytest.approx(1.03 / 0.98 - 1, abs=0.01)
    assert "better calibrate" in found.warning()


def test_splats_are_stretched_with_the_space():
    rng = np.random.default_rng(0)
    quaternions = rng.normal(size=(30, 4))
    cloud = SplatCloud(
        rng.normal(size=(30, 3)).astype(np.float32),
        rng.uniform(0.01, 0.2, (30, 3)).astype(np.float32),
        (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).astype(np.float32),
        np.full(30, 0.5, np.float32),
        np.zeros((30, 1, 3), np.float32),
    )
    stretch = AxisScale((1.2, 0.9, 1.0))
    moved = stretch.moved_cloud(cloud)
    np.testing.assert_allclose(moved.means, cloud.means * [1.2, 0.9, 1.0], rtol=1e-6)
    d = np.diag(stretch.factors)
    np.testing.assert_allclose(moved.covariances(), d @ cloud.covariances() @ d, atol=1e-7)


@pytest.mark.parametrize("factors", [(0.0, 1, 1), (1, -1, 1), (1, 1, np.inf)])
def test_factors_that_are_none_are_refused(factors):
    with pytest.raises(ValueError, match="> 0"):
        AxisScale(factors)


def test_codes_and_views_move_with_the_space_and_stay_rigid(alignment):
    stretch = AxisScale((1.03, 0.98, 1.01))
    moved = stretch.moved_alignment(alignment)
    assert measured_axis_scale(moved).anisotropy > 0.03
    for before, after in zip(alignment.anchors, moved.anchors, strict=True):
        np.testing.assert_allclose(
            after.world_from_code.translation,
            before.world_from_code.translation * stretch.factors,
        )
        np.testing.assert_array_equal(
            after.world_from_code.rotation, before.world_from_code.rotation
        )
    assert moved.warnings[-1] == stretch.warning()
    reconstruction, _, _ = capture(np.random.default_rng(0), codes={}, frames=3)
    stretched = stretch.moved_reconstruction(reconstruction)
    np.testing.assert_allclose(stretched.points, reconstruction.points * stretch.factors)
    assert [v.name for v in stretched.views] == [v.name for v in reconstruction.views]
