import numpy as np
import pytest

from benchmarks.evaluate.tables.twins import TWINS, shots, switches
from scenes.pose import Pose
from scenes.samples import sample_room

APART = {"chair-1": Pose.identity(), "chair-2": Pose.from_yaw(0.0, (2.0, 0.0, 0.0))}


@pytest.fixture(scope="module")
def lab():
    return sample_room("lab")


def test_a_track_that_stays_never_switches(answer):
    run = [answer(APART, off={"chair-1": (shift, 0.0)}) for shift in (0.0, 0.5, 0.7, 0.0)]
    assert switches(run) == 0


def test_going_over_and_back_is_two_switches(answer):
    run = [answer(APART, off={"chair-1": (shift, 0.0)}) for shift in (0.0, 2.0, 2.0, 0.0)]
    assert switches(run) == 2


def test_exchanged_tracks_switch_both(answer):
    off = {"chair-1": (2.0, 0.0), "chair-2": (-2.0, 0.0)}
    assert switches([answer(APART), answer(APART, off=off)]) == 2


def test_midway_nothing_can_be_told(answer):
    run = [answer(APART, off={"chair-1": (shift, 0.0)}) for shift in (0.0, 1.05, 0.0)]
    assert switches(run) == 0


@pytest.mark.parametrize("seed", range(10))
def test_the_twins_change_places_and_never_touch(lab, seed):
    scanned = {item.object_id: item.world_from_object for item in lab.objects}
    taken = shots(scanned, np.random.default_rng([seed, 2]))
    ways = {
        name: np.array([s.placements[name].world_from_part[0].translation for s in taken])
        for name in scanned
    }
    first, second = TWINS
    assert np.allclose(ways[first][-1], scanned[second].translation, atol=1e-9)
    assert np.allclose(ways[second][-1], scanned[first].translation, atol=1e-9)
    # Half diagonals of the boxes: nothing stands within another thing.
    for name in scanned:
        for twin in TWINS:
            if name == twin:
                continue
            gap = np.linalg.norm(ways[twin][:, :2] - ways[name][:, :2], axis=1).min()
            radius = 0.18 if name.startswith("stool") else 0.32
            assert gap > 0.30 + radius - 0.08, name
