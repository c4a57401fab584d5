"""The benches of the tracker's parts: what counts as wrong, and the figures that are made of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.tracking.likelihood import (
    LikelihoodResult,
    Weighed,
    likelihood_rows,
    poses_behind,
    wrong_poses,
)
from benchmarks.tracking.proposals import GAPS, Proposed, proposal_rows
from benchmarks.tracking.recovery import recovery_rows, wrong_runs
from scenes.pose import Pose

EYE = Pose(np.eye(3), np.array([0.0, 0.0, 1.3]))


def figures(rows):
    return {row.name: row for row in rows}


def model(support_z_m=0.0):
    return SimpleNamespace(
        radius_m=0.4,
        source=SimpleNamespace(support_z_m=support_z_m),
        centre_at=lambda pose: pose.translation + np.array([0.0, 0.0, 0.3]),
    )


def test_no_wrong_pose_is_the_true_one():
    true = Pose.from_yaw(0.3, (2.0, 1.0, 0.0))
    wrong = wrong_poses(model(), true, world_from_rig=EYE)
    assert len(wrong) == 4 * 3 + 2 + 11
    assert all(not np.allclose(pose.matrix(), true.matrix(), atol=1e-3) for pose in wrong)
    # Nothing is moved below what it stands on but along the line of sight.
    assert sum(pose.translation[2] < -1e-9 for pose in wrong) == 2


def test_poses_behind_a_person_are_farther_away_and_stand_on_the_support():
    person = np.array([2.0, 0.0, 0.9])
    picture = SimpleNamespace(scene=SimpleNamespace(world_from_rig=EYE), people=(person, person))
    poses = poses_behind(picture, model(0.7), rng=np.random.default_rng(0))
    assert len(poses) == 6
    assert all(pose.translation[2] == 0.7 for pose in poses)
    assert np.mean([pose.translation[0] for pose in poses]) > 2.0


def test_one_object_does_not_decide_the_log_loss():
    right = Weighed(50.0, 10.0, 0.0)
    wrong = Weighed(10.0, 500.0, 490.0)
    rows = figures(likelihood_rows([LikelihoodResult((right, wrong), (0.0,) * 99 + (40.0,))]))
    assert rows["likelihood.log_loss"].value == 10.0
    assert rows["likelihood.true_first_percent"].value == 50.0
    assert rows["likelihood.covered_silent_percent"].value == 99.0
    assert rows["likelihood.covered_nats.p999"].passed is False
    assert rows["likelihood.visible_nats.p5"].passed is True


def test_recall_is_said_for_each_gap():
    found = [Proposed(GAPS[0], True, True, 3.0), Proposed(GAPS[0], False, True, 5.0)]
    found += [Proposed(GAPS[-1], False, False, 9.0)]
    rows = figures(proposal_rows(found))
    assert rows["proposals.recall"].value == 50.0
    assert rows[f"proposals.recall_after_{GAPS[-1]}"].value == 0.0
    assert rows["proposals.ms"].value == pytest.approx(4.0)
    assert rows["proposals.ms_later"].value == 9.0


@pytest.mark.parametrize(
    ("right", "runs"),
    [([], []), ([True], []), ([False, False, True, False], [2, 1]), ([True, False], [1])],
)
def test_runs_of_wrong_pictures_end_with_the_next_right_one_or_the_sequence(right, runs):
    assert wrong_runs(right) == runs


def test_recovery_is_said_in_seconds_over_all_objects():
    rows = figures(recovery_rows([[True, False, False, True], [False] * 10, []]))
    assert rows["filter.losses"].value == 2.0
    assert rows["filter.recovery_s.p50"].value == pytest.approx(0.6)
    assert rows["filter.right_percent"].value == pytest.approx(100.0 * 2 / 14)
