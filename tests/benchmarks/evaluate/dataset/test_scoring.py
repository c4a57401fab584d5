"""`benchmarks.evaluate.dataset.scoring`: rows from answers."""

import pytest

from benchmarks.evaluate.answers import Answer, Visibility, calibration_error, is_right
from benchmarks.evaluate.dataset.layout import read_dataset
from benchmarks.evaluate.dataset.scoring import tracking_rows
from benchmarks.evaluate.dataset.tracking import CameraLeft, Tracked
from scenes.state import TrackState
from studio.evaluate.metrics import PoseError


def answer(world_cm, *, yaw=0.0, confidence=0.9, state=TrackState.STATIC, session="room", **more):
    error = PoseError(world_cm, 0.0, 0.0, world_cm, yaw)
    seen = Visibility(1.0, more.get("width", 30.0))
    moved = more.get("moved_cm", 0.0)
    return Answer(
        session, "s", "box", error, moved, confidence, state, more.get("is_moved", True), seen
    )


def rows(folder, *answers):
    tracked = Tracked(answers, (CameraLeft(0.2, 3.0),), (10.0, 20.0), (100.0,))
    return {row.name: row for row in tracking_rows(read_dataset(folder), tracked)}


@pytest.mark.parametrize(
    ("given", "right"),
    [
        (answer(4.9), True),
        (answer(5.1), False),
        (answer(1.0, yaw=6.0), False),
        (answer(1.0, state=TrackState.LOST), False),
    ],
)
def test_right_is_within_five_centimetres_and_degrees_and_not_lost(given, right):
    assert is_right(given) is right


def test_means_are_over_all_stills_and_flips_are_counted(folder):
    found = rows(folder, answer(1.0), answer(99.0, yaw=90.0))
    assert found["dataset.room.right"].value == 1
    assert found["dataset.room.of"].value == 2
    assert found["dataset.room.world_cm.mean"].value == pytest.approx(50.0)
    assert found["dataset.room.flips"].value == 1
    assert found["dataset.cold.right_percent"].value == pytest.approx(50.0)


def test_a_wrong_answer_is_flagged_by_low_confidence_or_by_being_lost(folder):
    lost = answer(99.0, state=TrackState.LOST)
    found = rows(folder, answer(99.0, confidence=0.4), lost, answer(99.0), answer(1.0))
    assert found["dataset.wrong_unflagged"].value == 1


def test_small_objects_are_not_asked_for_in_a_cold_start(folder):
    found = rows(folder, answer(99.0, width=20.0), answer(1.0))
    assert found["dataset.cold.of"].value == 1


def test_an_object_at_rest_must_stay(folder):
    still = answer(0.5, is_moved=False, moved_cm=0.5)
    dragged = answer(40.0, is_moved=False, moved_cm=40.0, session="room_chained")
    found = rows(folder, still, dragged)
    assert found["dataset.rest.moved_cm.max"].value == pytest.approx(40.0)
    assert found["dataset.rest.moved_cm.max"].passed is False


def test_calibration_is_the_gap_between_confidence_and_share_of_right_ones():
    half = [answer(1.0, confidence=0.75), answer(99.0, confidence=0.75)]
    assert calibration_error(half) == pytest.approx(0.25)
    assert calibration_error([answer(1.0, confidence=1.0)]) == pytest.approx(0.0)
