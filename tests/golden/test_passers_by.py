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
SEEDS = (0, 1)
LAST_FRAMES = 10
"""Last pictures of a take, in which the book is carried slowly and put down."""

pytestmark = [pytest.mark.golden, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def boards():
    """The scores of one rehearsal a seed."""
    return [played("passers-by", seed) for seed in SEEDS]


def played(scenario, seed):
    plan = SessionPlan(
        scene="lab", scenario=str(HERE / f"{scenario}.toml"), seed=seed, methods=("own",)
    )
    session = open_session(plan)
    board = ScoreBoard(session.scene.objects)
    session.run(lambda output: board.add(output.shown.objects, output.message.truth.recorded))
    return board


def test_a_chair_that_somebody_hid_is_where_it_was_once_it_shows(boards):
    ends = [board.samples("chair-1")[-1] for board in boards]
    assert min(end.visible for end in ends) > VISIBLE_FRACTION
    assert max(end.error.world_cm for end in ends) < 3.0


def test_a_stool_that_somebody_passes_stays_where_it_is(boards):
    samples = [sample for board in boards for sample in board.samples("stool-2")]
    assert min(sample.visible for sample in samples) < 0.1
    assert max(sample.error.world_cm for sample in samples) < 3.0


def test_a_book_lifted_fast_is_found_while_it_is_carried():
    for seed in SEEDS:
        samples = played("lifted-book", seed).samples("book-1")
        assert max(sample.error.world_cm for sample in samples[-LAST_FRAMES:]) < 5.0
