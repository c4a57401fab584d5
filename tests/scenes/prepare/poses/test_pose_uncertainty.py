from __future__ import annotations

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.poses.pose_uncertainty import MEDIAN_LENGTH, MIN_ERROR_PX, pose_uncertainty_px

LENS = Pinhole(960, 720, 700.0, 700.0, 480.0, 360.0)


def swim(points, errors_px):
    return pose_uncertainty_px(
        points, errors_px, focal_px=LENS.fx, size_px=(LENS.width_px, LENS.height_px)
    )


def spread(rng, count, *, share=1.0):
    """Points at depths of 2 to 4 in the middle `share` of the picture."""
    z = rng.uniform(2, 4, count)
    across, down = (rng.uniform(-0.5, 0.5, count) * share * n / LENS.fx for n in (960, 720))
    return np.stack([across * z, down * z, z], axis=1)


def test_it_is_what_poses_found_from_noisy_features_are_off_by():
    rng = np.random.default_rng(4)
    points = spread(rng, 40, share=0.4)
    grid = np.stack(np.meshgrid(np.linspace(20, 940, 9), np.linspace(20, 700, 7)), -1).reshape(
        -1, 2
    )
    seen = np.median(points[:, 2]) * LENS.unproject(grid) / LENS.unproject(grid)[:, 2:]
    sigma_px, off = 0.7, []
    for _ in range(200):
        pose = Pose.identity()
        wanted = LENS.project(points)[0] + rng.normal(0, sigma_px, (40, 2))
        for _ in range(4):
            here = LENS.project(pose @ points)[0]
            slope = np.stack(
                [(LENS.project(_moved(k) @ pose @ points)[0] - here) / 1e-6 for k in range(6)], -1
            )
            step = np.linalg.lstsq(slope.reshape(-1, 6), (wanted - here).ravel(), rcond=None)[0]
            pose = Pose(rotation_from_vector(step[3:]), step[:3]) @ pose
        off.append(np.sum((LENS.project(pose @ seen)[0] - grid) ** 2, axis=1).mean())
    told = swim(points, np.full(40, sigma_px * MEDIAN_LENGTH))
    assert told == pytest.approx(np.sqrt(np.mean(off)), rel=0.1)


def _moved(axis):
    step = np.zeros(6)
    step[axis] = 1e-6
    return Pose(rotation_from_vector(step[3:]), step[:3])


def test_points_in_a_corner_say_less_than_as_many_all_over():
    rng = np.random.default_rng(1)
    everywhere = swim(spread(rng, 60), np.full(60, 0.5))
    together = swim(spread(rng, 60, share=0.1), np.full(60, 0.5))
    assert everywhere < 0.5
    assert together > 5 * everywhere


def test_units_of_the_scene_do_not_matter():
    points = spread(np.random.default_rng(2), 30)
    errors_px = np.full(30, 0.4)
    assert swim(17.0 * points, errors_px) == pytest.approx(swim(points, errors_px))


def test_a_perfect_fit_is_no_better_than_features_are():
    points = spread(np.random.default_rng(3), 30)
    at_best = np.full(30, MIN_ERROR_PX * MEDIAN_LENGTH)
    assert swim(points, np.zeros(30)) == pytest.approx(swim(points, at_best))


@pytest.mark.parametrize("count", [0, 2])
def test_too_few_points_leave_it_open(count):
    assert swim(np.ones((count, 3)), np.zeros(count)) == np.inf


def test_points_on_one_ray_leave_it_open():
    assert swim(np.array([[0.1, 0.1, 1.0]]) * np.arange(1, 9)[:, None], np.zeros(8)) == np.inf
