import numpy as np
import pytest

from benchmarks.evaluate.tables.rest import jitter
from scenes.pose import Pose

TRUE = {"chair-1": Pose.from_yaw(3.1, (1.0, 0.0, 0.0))}


def test_what_stands_still_does_not_shake_however_wrong_it_is(answer):
    run = [answer(TRUE, off={"chair-1": (0.3, 0.2)}) for _ in range(5)]
    assert jitter([run], "chair-1") == pytest.approx((0.0, 0.0), abs=1e-9)


def test_shaking_is_measured_about_each_run_s_own_mean(answer):
    """Two millimetres and half a degree to either side, across the seam of the yaw."""
    turn = np.radians(0.5)
    runs = [
        [
            answer(TRUE, off={"chair-1": (offset + side * 0.002, offset + side * turn)})
            for side in (-1, 1)
        ]
        for offset in (0.0, 0.1)
    ]
    assert jitter(runs, "chair-1") == pytest.approx((2.0, 0.5))
