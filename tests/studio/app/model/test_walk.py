"""Random walks through editing, playing, recorded and live, over the real model."""

import tempfile
from pathlib import Path
from random import Random

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from benchmarks.studio.walking import ACTIONS, Walk, walked
from studio.app.model.runs.leaving import Answer
from studio.app.model.standing import (
    EDGES,
    SESSIONS,
    Happening,
    Mode,
    Standing,
    StandingError,
    after,
)

FILE = Path("a.mcap")


@pytest.mark.parametrize("mode", list(Mode))
@pytest.mark.parametrize("happening", list(Happening))
def test_every_way_is_taken_or_refused_in_words(mode, happening):
    standing = Standing(mode, FILE if mode is Mode.RECORDED else None)
    if (mode, happening) not in EDGES:
        with pytest.raises(StandingError, match=r"stop it first|nothing is playing"):
            after(standing, happening, FILE)
        return
    then = after(standing, happening, FILE)
    assert (then.recording is not None) or then.mode is not Mode.RECORDED
    assert then.mode is (EDGES[mode, happening] or Mode.EDITING)


@pytest.mark.parametrize("mode", sorted(SESSIONS))
def test_a_session_that_leaves_nothing_goes_back_to_the_recording_it_began_at(mode):
    begun = after(Standing(Mode.RECORDED, FILE), Happening.PLAY)
    assert after(begun, Happening.END) == Standing(Mode.RECORDED, FILE)
    assert after(Standing(mode), Happening.END) == Standing()


class Walks(RuleBasedStateMachine):
    """Hypothesis looks for the shortest way on which something is lost."""

    def __init__(self):
        super().__init__()
        self._folder = tempfile.TemporaryDirectory()
        self.walk = Walk(Path(self._folder.name))

    @rule(action=st.sampled_from(ACTIONS))
    def step(self, action):
        action(self.walk)

    @rule(answer=st.sampled_from([Answer.SAVE, Answer.DISCARD, Answer.CANCEL]))
    def answer(self, answer):
        self.walk.answer(answer)

    @invariant()
    def nothing_is_lost(self):
        self.walk.check()
        assert self.walk.lost == []

    def teardown(self):
        self.walk.finish()
        assert self.walk.lost == []
        self._folder.cleanup()


TestWalks = Walks.TestCase
TestWalks.settings = settings(max_examples=25, stateful_step_count=40, deadline=None)


def test_a_short_walk_takes_every_way(tmp_path):
    walk = walked(tmp_path, 1500, Random(1))
    assert walk.lost == []
    assert walk.bench.edges == set(EDGES)


@pytest.mark.slow
def test_ten_thousand_steps_lose_nothing(tmp_path):
    walk = walked(tmp_path, 10_000, Random(2))
    assert walk.lost == []
    assert walk.bench.edges == set(EDGES)


def test_the_walk_notices_a_document_that_goes_without_a_question(tmp_path):
    from studio.app.model.documents.document import Document

    walk = Walk(tmp_path)
    walk.edit()
    walk.bench.open_document(Document("other"), None)
    assert walk.lost == ["edits of first went without a question"]
