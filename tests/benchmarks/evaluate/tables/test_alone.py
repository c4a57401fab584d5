"""One object on one core: what it does, and on which core."""

import os

import numpy as np
import pytest

from benchmarks.evaluate.tables.alone import MOVES_FRAMES, STANDS_FRAMES, STARTS, one_core, shots
from scenes.pose import Pose

SCANNED = {STARTS[0].object_id: Pose.from_yaw(0.4, (1.0, 2.0, 0.3))}


def poses():
    taken = shots(SCANNED, STARTS[0])
    return [next(iter(shot.placements.values())).world_from_part[0] for shot in taken]


def test_the_object_stands_elsewhere_at_first_and_then_goes_to_and_fro():
    path = np.array([pose.translation for pose in poses()])
    assert len(path) == STANDS_FRAMES + MOVES_FRAMES
    scanned = SCANNED[STARTS[0].object_id].translation
    np.testing.assert_allclose(path[0] - scanned, [*STARTS[0].shift_m, 0.0], atol=1e-12)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert not steps[: STANDS_FRAMES - 1].any()
    assert 0.0 < steps.max() < 0.03
    np.testing.assert_allclose(path[-1], path[0], atol=0.02)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system cannot tell cores")
def test_a_thread_is_kept_on_one_core_for_a_while():
    before = os.sched_getaffinity(0)
    with one_core():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before
