import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackState
from studio.evaluate.metrics import pose_error
from studio.evaluate.samples import Sample, SampleRows


def sample(number, *, counted=True, visible=1.0):
    estimated = Pose.from_yaw(0.1 * number, (number, 0.5, 1e-9))
    true = Pose.from_yaw(0.05 * number, (number, 0.25, 0.0))
    state = tuple(TrackState)[number % len(TrackState)]
    t_ns = 2**60 + number
    return Sample(t_ns, estimated, true, visible, state, counted, pose_error(estimated, true))


@pytest.fixture
def kept():
    given = [
        sample(0, counted=False),
        sample(1, visible=0.2),
        sample(2, visible=0.9),
        sample(3, visible=0.5),
    ]
    rows = SampleRows()
    for one in given:
        rows.add(one)
    return given, rows


def test_samples_come_back_to_the_last_bit(kept):
    given, rows = kept
    found = list(rows.samples())
    assert len(found) == len(rows) == len(given)
    for a, b in zip(given, found, strict=True):
        assert (a.t_ns, a.visible, a.state, a.counted, a.error) == (
            b.t_ns,
            b.visible,
            b.state,
            b.counted,
            b.error,
        )
        for x, y in (
            (a.estimated_world_from_object, b.estimated_world_from_object),
            (a.true_world_from_object, b.true_world_from_object),
        ):
            assert np.array_equal(x.matrix(), y.matrix())


def test_only_frames_that_count_give_errors_by_whether_they_were_hidden(kept):
    given, rows = kept
    assert rows.errors(hidden=None, below=0.5) == [s.error for s in given[1:]]
    assert rows.errors(hidden=True, below=0.5) == [given[1].error]
    assert rows.errors(hidden=False, below=0.5) == [given[2].error, given[3].error]


def test_rows_go_on_while_they_are_read(kept):
    given, rows = kept
    reading = rows.samples()
    next(reading)
    rows.add(given[0])
    assert len(list(reading)) == len(given) - 1
    assert len(rows) == len(given) + 1
