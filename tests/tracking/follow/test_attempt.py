"""One solve under one belief: what stands is kept on its support."""

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.evidence.rendering import RenderingCache
from tracking.follow.attempt import attempt
from tracking.follow.posterior import CONTACT_SIGMA_M
from tracking.solve.gauss_newton import COLD_REACHES, Prior
from tracking.solve.motion import pose_vector

TABLE_M = 0.74


def tried(table, scene, name, start, *, height_sigma_m, slide=False, height_m=TABLE_M):
    task = table.task(scene, name)
    mean = pose_vector(start)
    mean[2] = height_m
    prior = Prior(mean, np.array([0.15, 0.15, height_sigma_m, 0.25]))
    evidence = table.evidence(scene, name, table.poses[name])
    return attempt(
        task, evidence, RenderingCache(), start, prior, reaches_px=COLD_REACHES, slide=slide
    )


def raised(pose, metres):
    return Pose(pose.rotation, pose.translation + np.array([0.0, 0.0, metres]))


@pytest.mark.parametrize("above_m", [0.0, 0.04, -0.03, 0.08, -0.07])
def test_a_start_at_another_height_is_put_on_its_support_along_the_sight(
    table, as_scanned, above_m
):
    true = table.poses["book-1"]
    eye = as_scanned.world_from_rig.translation
    # Seen in the same direction, but nearer or farther.
    sight = true.translation - eye
    start = Pose(true.rotation, true.translation + above_m / sight[2] * sight)
    fit = tried(table, as_scanned, "book-1", start, height_sigma_m=CONTACT_SIGMA_M)
    assert np.linalg.norm(fit.world_from_object.translation - true.translation) < 0.010
    assert fit.world_from_object.translation[2] == pytest.approx(TABLE_M, abs=0.010)


def test_a_support_that_is_believed_too_high_holds_the_pose_there(table, as_scanned):
    true, wrong_m = table.poses["book-1"], TABLE_M + 0.06
    start = raised(true, 0.06)
    held = tried(
        table, as_scanned, "book-1", start, height_sigma_m=CONTACT_SIGMA_M, height_m=wrong_m
    )
    assert held.world_from_object.translation[2] == pytest.approx(wrong_m, abs=0.015)


def test_what_is_carried_finds_its_height_by_itself(table, as_scanned):
    true = table.poses["book-1"]
    start = raised(true, 0.02)
    free = tried(table, as_scanned, "book-1", start, height_sigma_m=0.08, height_m=TABLE_M + 0.02)
    assert free.world_from_object.translation[2] == pytest.approx(TABLE_M, abs=0.015)


def test_a_slide_first_comes_from_farther_away(table, as_scanned):
    true = table.poses["book-1"]
    far = Pose(true.rotation, true.translation + np.array([0.07, 0.05, 0.0]))
    fit = tried(table, as_scanned, "book-1", far, height_sigma_m=CONTACT_SIGMA_M, slide=True)
    assert np.linalg.norm(fit.world_from_object.translation - true.translation) < 0.01
