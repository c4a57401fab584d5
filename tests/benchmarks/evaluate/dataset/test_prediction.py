"""`benchmarks.evaluate.dataset.prediction`: rehearsed errors against measured ones."""

from types import SimpleNamespace

import pytest

from benchmarks.evaluate.answers import Answer, Visibility
from benchmarks.evaluate.dataset.prediction import factor, prediction_rows
from scenes.state import TrackState
from studio.evaluate.metrics import PoseError

SEEN = Visibility(1.0, 100.0)


def answer(world_cm, yaw_deg, object_id="chair", seen=SEEN):
    error = PoseError(world_cm, 0.0, 0.0, world_cm, yaw_deg)
    return Answer("room", "s", object_id, error, 0.0, 1.0, TrackState.TRACKED, True, seen)


def rows(rehearsed, measured):
    dataset = SimpleNamespace(sets={"room": SimpleNamespace(moving=("chair",))})
    found = prediction_rows(dataset, rehearsed=rehearsed, measured=measured)
    return {row.name: row for row in found}


def test_the_larger_over_the_smaller():
    assert factor(2.0, 1.0, least=0.01) == factor(1.0, 2.0, least=0.01) == 2.0
    assert factor(0.001, 0.0, least=0.01) == 1.0


def test_errors_are_those_of_right_poses_of_moving_objects_in_sight():
    found = rows(
        [answer(1.0, 0.5), answer(300.0, 90.0)],
        [
            answer(1.5, 1.5),
            answer(40.0, 3.0, object_id="table"),
            answer(40.0, 3.0, seen=Visibility(0.2, 100.0)),
        ],
    )
    assert found["twin.rehearsed_vs_measured.world"].value == pytest.approx(1.5)
    assert found["twin.rehearsed_vs_measured.yaw"].value == pytest.approx(3.0)
    assert found["twin.rehearsed.right_percent"].value == pytest.approx(50.0)
    assert found["twin.measured.right_percent"].value == pytest.approx(100.0)
    assert found["twin.rehearsed_vs_measured.world.all"].value == pytest.approx(150.5 / 1.5)


def test_a_factor_beyond_two_misses_the_bar():
    found = rows([answer(0.2, 1.0)], [answer(1.0, 1.0)])
    assert found["twin.rehearsed_vs_measured.world"].passed is False
    assert found["twin.rehearsed_vs_measured.yaw"].passed is True
