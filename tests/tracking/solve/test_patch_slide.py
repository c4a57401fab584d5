"""A small object slid over a filmed table to where it explains most of the change."""

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.evidence.surroundings import surroundings_of
from tracking.solve.patch_slide import SLID, SmallSlide


@pytest.mark.parametrize("step_m", [(0.03, 0.02), (-0.04, 0.0), (0.0, -0.03)])
def test_it_is_slid_to_its_place_without_being_turned(table, as_scanned, step_m):
    true = table.poses["mug-1"]
    beside = Pose(true.rotation, true.translation + np.array([*step_m, 0.0]))
    evidence = table.evidence(as_scanned, "mug-1", true)
    found = SmallSlide(surroundings_of(as_scanned, table.models["mug-1"], evidence)).best(beside)
    assert np.linalg.norm(found.translation - true.translation) < 0.012
    assert found.translation[2] == pytest.approx(true.translation[2], abs=1e-9)
    np.testing.assert_array_equal(found.rotation, true.rotation)


def test_it_is_slid_by_no_more_than_its_own_size(table, as_scanned):
    true, mug = table.poses["mug-1"], table.models["mug-1"]
    evidence = table.evidence(as_scanned, "mug-1", true)
    slide = SmallSlide(surroundings_of(as_scanned, mug, evidence))
    camera_from_world = evidence.world_from_camera.inverse()
    for step_m in ((0.25, 0.0), (0.0, 0.2)):
        far = Pose(true.rotation, true.translation + np.array([*step_m, 0.0]))
        found = slide.best(far)
        ends = camera_from_world @ np.stack([far.translation, found.translation])
        apart = np.abs(np.diff(evidence.camera.project(ends)[0], axis=0)).max()
        reach = SLID * evidence.camera.f_px * mug.radius_m / evidence.view.target_range_m
        assert apart <= reach + 3.0


def test_what_is_not_drawn_into_the_window_stays(table, as_scanned):
    evidence = table.evidence(as_scanned, "mug-1", table.poses["mug-1"])
    slide = SmallSlide(surroundings_of(as_scanned, table.models["mug-1"], evidence))
    behind = Pose.from_yaw(0.0, (0.0, -1.5, 0.74))
    assert slide.best(behind) is behind
