"""People before objects at rest take none of them along, and a book that one lifts is followed.

Simulated once a seed and tracked. While what is unknown was no coherent object, the chair ended 130
to 148 cm off in both seeds; while lost objects were looked for in the whole room alone, a lifted
book was lost to the end.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.evaluate.scores import VISIBLE_FRACTION, ScoreBoard
from studio.session.opening import open_session
from studio.session.plan import SessionPlan

HERE = Path(__file__).parent
SEEDS = (0, pytest.param(1, marks=pytest.mark.slow))
LAST_FRAMES = 10
"""Last pictures of a take, in which the book is carried slowly and put down."""

pytestmark = [pytest.mark.golden, pytest.mark.timeout(900)]


@pytest.fixture(scope="module", params=SEEDS)
def board(request):
    """The scores of one rehearsal."""
    return played("passers-by", request.param)


def played(scenario, seed):
    plan = SessionPlan(
        scene="lab", scenario=str(HERE / f"{scenario}.toml"), seed=seed, methods=("own",)
    )
    session = open_session(plan)
    board = ScoreBoard(session.scene.objects)
    session.run(lambda output: board.add(output.shown.objects, output.message.truth.recorded))
    return board


def test_a_chair_that_somebody_hid_is_where_it_was_once_it_shows(board):
    end = board.samples("chair-1")[-1]
    assert end.visible > VISIBLE_FRACTION
    assert end.error.world_cm < 3.0


def test_a_stool_that_somebody_passes_stays_where_it_is(board):
    samples = board.samples("stool-2")
    assert min(sample.visible for sample in samples) < 0.1
    assert max(sample.error.world_cm for sample in samples) < 3.0


@pytest.mark.parametrize("seed", SEEDS)
def test_a_book_lifted_fast_is_found_while_it_is_carried(seed):
    samples = played("lifted-book", seed).samples("book-1")
    assert max(sample.error.world_cm for sample in samples[-LAST_FRAMES:]) < 5.0
