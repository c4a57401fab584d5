"""A tracker of somebody else raises, loops or answers wrongly: the session goes on."""

import sys
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.state import TrackState
from studio.session.plan import SessionPlan
from studio.session.trackers.guarded import GuardedMethod
from tracking.output import TrackOutput


class Failing:
    """Is right for some frames, then does something else."""

    def __init__(self, good, then, frames=2):
        self.good, self.then, self.frames = good, then, frames

    def start(self):
        return self.good.start()

    def step(self, state, frame, now_ns):
        if frame.seq >= self.frames:
            return self.then(state, frame)
        return self.good.step(state, frame, now_ns)


def loop(_state, _frame):
    while True:
        time.sleep(0.001)


def guarded(tiny, then, **limits):
    said = []
    maker = lambda scene: Failing(tiny.tracker(0.03), then)  # noqa: E731
    return GuardedMethod("mine", maker, tiny.scene, say=said.append, **limits), said


def play(tiny, method):
    seen = []
    session = tiny.session(SessionPlan(methods=("mine",)), methods={"mine": method})
    session.run(seen.append)
    return seen


def test_what_a_good_tracker_gives_is_passed_on(tiny):
    said = []
    method = GuardedMethod("mine", lambda _: tiny.tracker(0.03), tiny.scene, say=said.append)
    seen = play(tiny, method)
    assert not said
    assert len(seen) == tiny.frames
    assert {t.state for t in seen[-1].shown.objects} == {TrackState.TRACKED}


@pytest.mark.parametrize(
    ("then", "words"),
    [
        (lambda _s, _f: 1 / 0, "ZeroDivisionError: division by zero"),
        (lambda _s, _f: sys.exit(3), "SystemExit: 3"),
        (lambda _s, _f: None, "step gave NoneType, wanted (state, TrackOutput)"),
        (
            lambda s, _f: (s, TrackOutput(())),
            "tracks of [], wanted ['chair-1', 'stool-1']",
        ),
    ],
)
def test_one_that_fails_is_said_once_with_its_place_and_its_objects_stay_lost(tiny, then, words):
    method, said = guarded(tiny, then)
    seen = play(tiny, method)
    assert len(seen) == tiny.frames
    assert len(said) == 1
    assert words in said[0]
    assert said[0].startswith("tracker mine: ")
    if "Zero" in words:
        assert f"{__file__}:" in said[0]
    before, after = seen[1].shown.objects[0], seen[-1].shown.objects[0]
    assert after.state is TrackState.LOST
    assert np.array_equal(before.world_from_object.matrix(), after.world_from_object.matrix())


def test_one_that_loops_is_stopped_and_said_where(tiny):
    method, said = guarded(tiny, loop, limit_s=0.2)
    seen = play(tiny, method)
    assert len(seen) == tiny.frames
    assert len(said) == 1
    assert "does not end (0.2 s a frame)" in said[0]
    assert f"{__file__}:" in said[0]
    deadline = time.monotonic() + 120
    while any(thread.name == "tracker mine" for thread in threading.enumerate()):
        assert time.monotonic() < deadline, "the loop still holds a core"
        time.sleep(0.01)


@pytest.mark.parametrize("make", [lambda _scene: 1 / 0, lambda _scene: SimpleNamespace(start=int)])
def test_one_that_cannot_be_made_leaves_the_objects_where_the_scan_has_them(tiny, make):
    said = []
    seen = play(tiny, GuardedMethod("mine", make, tiny.scene, say=said.append))
    assert len(said) == 1
    found = seen[-1].shown.objects
    for item, track in zip(tiny.scene.objects, found, strict=True):
        assert track.state is TrackState.LOST
        scan = item.world_from_object.matrix()
        assert np.array_equal(track.world_from_object.matrix(), scan)
