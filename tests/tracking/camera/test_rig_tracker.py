"""The camera in its room from frame to frame: kept while its marker stands, placed anew after."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.background.layers import LayerCache
from tracking.background.learning import Care, whole_lens
from tracking.camera.rig_state import RIG_MOVED_M
from tracking.camera.rig_tracker import RigTracker, StandingObjects


@pytest.fixture(scope="module")
def tracker(table):
    return RigTracker(table.scan.room, table.renderer)


@pytest.fixture(scope="module")
def standing(table):
    models = tuple(model.source for model in table.models.values())
    return StandingObjects(models, table.poses, LayerCache(), Care.CAUTIOUS)


def located(tracker, standing, known, frame, marker_world_from_rig):
    return tracker.locate(
        known,
        frame,
        marker_world_from_rig=marker_world_from_rig,
        standing=standing,
        is_refined=False,
    )


@pytest.fixture(scope="module")
def first(tracker, standing, as_scanned):
    frame = as_scanned.frame
    return located(tracker, standing, None, frame, frame.world_from_rig)


def test_unrefined_the_camera_is_where_its_marker_says(first, as_scanned):
    assert first.calibration.world_from_rig is as_scanned.frame.world_from_rig
    assert first.background.is_at(as_scanned.frame.world_from_rig)


def test_a_camera_that_stands_keeps_its_background(tracker, standing, first, as_scanned):
    marker = as_scanned.frame.world_from_rig @ Pose(np.eye(3), np.full(3, 0.2 * RIG_MOVED_M))
    assert located(tracker, standing, first, as_scanned.frame, marker) is first


def test_the_camera_goes_where_its_marker_goes(tracker, standing, first, as_scanned):
    step = Pose(np.eye(3), np.array([0.0, 0.0, 2.0 * RIG_MOVED_M]))
    # The refined camera is not where the marker says: it goes the same way nevertheless.
    off = Pose(np.eye(3), np.array([0.003, 0.0, 0.0]))
    refined = off @ first.calibration.world_from_rig
    known = replace(first, calibration=replace(first.calibration, world_from_rig=refined))
    moved = step @ as_scanned.frame.world_from_rig
    after = located(tracker, standing, known, as_scanned.frame, moved)
    assert after.marker_world_from_rig is moved
    translation = after.calibration.world_from_rig.translation
    np.testing.assert_allclose(translation, (step @ refined).translation, atol=1e-12)
    assert after.background.is_at(after.calibration.world_from_rig)


def test_nothing_is_learned_where_objects_stand(tracker, standing, first, as_scanned, table):
    frame = as_scanned.frame
    black = replace(frame, images=(np.zeros_like(frame.images[0]),))
    exposure = as_scanned.exposures[0]
    band = whole_lens(0, frame.rig.lenses[0].height_px)
    after = tracker.learn(first.background, black, standing, exposure=exposure, band=band)
    assert after is not first.background
    before, now = (np.asarray(b.images[0][:, :]) for b in (first.background, after))
    for item in standing.models:
        layer = standing.layers.layer(
            item, table.poses[item.object_id], frame.rig, after.world_from_rig, table.renderer,
            lens=0,
        )  # fmt: skip
        rows = slice(layer.top, layer.top + len(layer.alpha))
        columns = slice(layer.left, layer.left + layer.alpha.shape[1])
        solid = layer.alpha > 0.5
        np.testing.assert_array_equal(before[rows, columns][solid], now[rows, columns][solid])
