"""Expected picture of a window if the object is not in it."""

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.evidence.observation import (
    SHADOWED,
    misfit_in_shadow,
    observation_of,
    observe,
    with_layers,
)
from tracking.model.misfit import MAX_MISFIT, RESIDUAL_SIGMA, misfit
from tracking.window.filters import resized


def test_a_misfit_is_half_the_squared_residual_up_to_any_colour():
    residual = np.zeros((1, 3, 3), np.float32)
    residual[0, 1] = RESIDUAL_SIGMA
    residual[0, 2] = 1.0
    np.testing.assert_allclose(misfit(residual)[0], [0.0, 1.5, MAX_MISFIT], rtol=1e-5)


def test_the_room_misfits_where_something_stands_and_fits_elsewhere(table, as_scanned):
    evidence = table.evidence(as_scanned, "box-1", table.poses["box-1"])
    observation = observe(as_scanned, evidence)
    surely, hardly = evidence.foreground > 0.95, evidence.foreground < 0.02
    assert surely.any()
    assert hardly.any()
    assert np.median(observation.room_misfit[surely]) > 3.0
    assert observation.room_misfit[hardly].max() < 0.2
    assert observation.lens_px == evidence.view.shrink
    assert observation.range_m.max() > 0.5


def test_a_shadow_is_the_room_but_another_colour_is_not():
    """Darker by one factor, as far as a pixel's neighbours tell."""
    generator = np.random.default_rng(0)
    room = generator.uniform(0.3, 0.9, (64, 64, 3)).astype(np.float32)
    free = -np.log(SHADOWED)
    shadowed = np.median(misfit_in_shadow(0.6 * room, room))
    assert shadowed == pytest.approx(free, abs=0.5)
    darker = np.median(misfit_in_shadow(0.15 * room, room))
    flat = np.median(misfit_in_shadow(np.full_like(room, 0.4), room))
    assert min(darker, flat) > free + 3.0


def test_a_shadow_is_room_in_the_first_frame_and_where_an_object_is_looked_for(table, as_scanned):
    """Later on, a passer-by in grey covers an object."""
    evidence = table.evidence(as_scanned, "box-1", table.poses["box-1"])
    seen = observe(as_scanned, evidence)
    first, looked_for, followed = (
        observation_of(
            (0.6 * seen.empty).astype(np.float32),
            seen.empty,
            seen.expected,
            np.ones_like(seen.changed),
            hidden=seen.hidden,
            range_m=seen.range_m,
            camera=seen.camera,
            world_from_camera=seen.world_from_camera,
            lens_px=seen.lens_px,
            in_any_light=in_any_light,
            in_shadow=in_shadow,
        )
        for in_any_light, in_shadow in ((True, False), (False, True), (False, False))
    )
    assert np.median(first.foreground) < 0.2
    assert np.median(looked_for.foreground) == np.median(followed.foreground) == 1.0
    assert max(np.median(shown.room_misfit) for shown in (first, looked_for)) < 2.0
    assert np.median(followed.room_misfit) == pytest.approx(MAX_MISFIT)


def test_a_shrunk_observation_shows_the_same_with_fewer_pixels(table, as_scanned):
    observation = observe(as_scanned, table.evidence(as_scanned, "box-1", table.poses["box-1"]))
    half = observation.shrunk(2)
    assert half.live.shape[0] == observation.live.shape[0] // 2
    assert half.camera.f_px == pytest.approx(observation.camera.f_px / 2)
    assert half.lens_px == 2 * observation.lens_px
    assert half.live.mean() == pytest.approx(observation.live.mean(), abs=0.01)
    assert observation.shrunk(1) is observation
    assert observation.shrunk(10_000) is observation


def test_what_is_expected_shows_the_neighbours_as_they_were_scanned(table, as_scanned):
    """The live picture says nothing of what is expected where another object stands."""
    pose = table.poses["mug-1"]
    near = Pose(pose.rotation, pose.translation + np.array([0.08, 0.05, 0.0]))
    neighbours = ((table.models["book-1"], near),)
    beside = table.evidence(as_scanned, "mug-1", pose, neighbours=neighbours)
    alone = table.evidence(as_scanned, "mug-1", pose, neighbours=())
    with_others, without = (observe(as_scanned, evidence) for evidence in (beside, alone))
    rows, columns = beside.view.part
    laid, alpha = with_layers(
        as_scanned.background.images[beside.view.lens][rows, columns],
        beside.layers,
        (rows, columns),
    )
    assert laid.shape[:2] == alpha.shape
    changed = np.abs(with_others.expected - without.expected).max(axis=2) > 0.05
    covered = resized(alpha, changed.shape[::-1]) > 0.0
    assert changed.any()
    assert not (changed & ~covered).any()
