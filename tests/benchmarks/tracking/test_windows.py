"""Labelled pictures: a room gives them, and the parts of the tracker are measured on them."""

import pytest

from benchmarks.evaluate.filmed.takes import TakeCache
from benchmarks.tracking.likelihood import measure_likelihood
from benchmarks.tracking.proposals import measure_proposals
from benchmarks.tracking.windows import LabelledRoom


@pytest.mark.slow
def test_a_room_gives_labelled_pictures_on_which_the_parts_are_measured(tmp_path):
    pytest.importorskip("open3d")
    room = LabelledRoom(100, cache=TakeCache(tmp_path))
    pictures = list(room.sequence())
    last = pictures[-1]
    assert last.moving
    for name, pose in last.poses.items():
        assert room.error_of(
            name, world_from_found=pose, world_from_true=pose
        ).world_cm == pytest.approx(0.0, abs=1e-6)
        assert name not in {other.object_id for other, _ in last.neighbours(name)}
    result = measure_likelihood(room)
    won = [item.true_nats > item.wrong_nats for item in result.visible]
    assert sum(won) > len(won) / 2
    assert measure_proposals(room, stopwatch_ns=lambda: 0)
