import math

import numpy as np
import pytest

from benchmarks.evaluate.protocols.screen import SCREEN_ID
from benchmarks.evaluate.protocols.stations import WARM_UP
from benchmarks.evaluate.tables.occlusion import is_switched, refound_s, shots
from scenes.pose import Pose
from scenes.samples import sample_room

SOME_SHARES = (0.0, 0.3, 0.9)
TRUE = {"chair-1": Pose.identity(), "chair-2": Pose.from_yaw(0.0, (2.0, 0.0, 0.0))}


def run_of(answer, visible, off_m):
    return [
        answer(TRUE, off={"chair-1": (shift, 0.0)}, t_ns=k * 10**8, visible={"chair-1": seen})
        for k, (seen, shift) in enumerate(zip(visible, off_m, strict=True))
    ]


@pytest.mark.parametrize(
    ("visible", "off_m", "seconds"),
    [
        ([1, 0, 0, 1, 1, 1], [0, 0.2, 0.2, 0.2, 0.2, 0], 0.2),
        ([1, 0, 0, 1, 1, 1], [0, 0.2, 0.2, 0, 0, 0], 0.0),
        ([1, 0, 0, 1, 1, 1], [0, 0, 0, 0, 0.2, 0], 0.2),
        ([1, 0, 0, 1, 1, 1], [0, 0, 0, 0, 0, 0.2], math.inf),
        ([1, 0, 0, 0.4, 0.6, 1], [0, 1, 1, 1, 0, 0], 0.0),
    ],
)
def test_the_time_runs_from_being_seen_again_until_it_is_right_for_good(
    answer, visible, off_m, seconds
):
    assert refound_s(run_of(answer, visible, off_m)) == pytest.approx(seconds)


def test_a_track_that_went_over_to_the_twin_is_a_switch(answer):
    assert not is_switched(answer(TRUE, off={"chair-1": (0.9, 0.0)}))
    assert is_switched(answer(TRUE, off={"chair-1": (1.1, 0.0)}))


@pytest.fixture(scope="module")
def filmed():
    """The shots of a table of some shares, and its passages."""
    return shots(sample_room("lab"), SOME_SHARES)


def test_passages_follow_each_other_and_the_board_stands_where_something_is_hidden(filmed):
    taken, passages = filmed
    assert passages[0].begin == WARM_UP
    assert passages[-1].end == len(taken)
    assert [p.begin for p in passages[1:]] == [p.end for p in passages[:-1]]
    assert [p.name for p in passages] == [f"{s:.0%}" for s in SOME_SHARES] + ["still", "moved"]
    for passage, share in zip(passages, SOME_SHARES, strict=False):
        for shot in taken[passage.begin : passage.end]:
            assert (SCREEN_ID in shot.placements) == (share > 0)


def test_the_chair_moves_while_hidden_only_where_it_is_said(filmed):
    taken, passages = filmed
    for passage, moves in zip(passages[-2:], (False, True), strict=True):
        places = [
            taken[k].placements["chair-1"].world_from_part[0].translation
            for k in (passage.begin, passage.end - 1)
        ]
        assert (np.linalg.norm(places[1] - places[0]) > 0.2) == moves
