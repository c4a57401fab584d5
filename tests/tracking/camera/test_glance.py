"""Patches of a sphere of noise: what is suspect, and what is only other light or somebody there."""

import numpy as np
import pytest

from scenes.pose import Pose
from tests.tracking.camera.test_watch import FAR, LENS, seen
from tracking.camera.rig_state import CELLS, glance_at, is_suspect, renew
from tracking.camera.watch import begin_watch


@pytest.fixture(scope="module")
def glance():
    still = seen((0, 0, 0))
    return glance_at(begin_watch(still, LENS, Pose.identity(), FAR), still)


@pytest.mark.parametrize("turn_deg", [(0.1, 0, 0), (0, 0.5, -0.5), (0, 0, 3.0)])
def test_a_turned_lens_is_suspect(glance, turn_deg):
    assert is_suspect(glance, seen(np.radians(turn_deg), seed=1))


@pytest.mark.parametrize("how", [{}, {"gain": 0.9}, {"hidden": 0.3}])
def test_a_lens_that_stands_is_not(glance, how):
    assert not is_suspect(glance, seen((0, 0, 0), seed=1, **how))


def test_what_changed_for_good_is_suspect_once(glance):
    covered = seen((0, 0, 0), seed=1, hidden=0.8)
    assert is_suspect(glance, covered)
    assert not is_suspect(renew(glance, covered), seen((0, 0, 0), seed=2, hidden=0.8))


def test_patches_are_few_and_in_the_picture(glance):
    assert 50 < len(glance.corners) <= CELLS**2
    assert glance.corners.min() > 0
    assert glance.corners.max() < LENS.width_px - 5
