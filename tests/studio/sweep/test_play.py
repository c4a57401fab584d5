"""The figures of a run, on tracks and truths whose answer is known; and one run that is real."""

from __future__ import annotations

import os
import threading
from dataclasses import replace

import pytest

from devices.recording_codec import RecordedTruth
from scenes.pose import Pose
from studio.session.pipeline import CancelledError
from studio.session.plan import SessionPlan
from studio.sweep.child import RunDiedError, RunRefusedError, play_in_child
from studio.sweep.plan import parse_sweep
from studio.sweep.play import Arrival, lost_share, play, shown_cm

FRAME_NS = 100_000_000


def truth(seq, x_m, moved=True, **more):
    pose = Pose.from_yaw(0.0, (x_m, 0.0, 0.0))
    ids = frozenset({"chair-1"} if moved else ())
    return RecordedTruth(seq, seq * FRAME_NS, {"chair-1": pose}, {}, ids, pose, **more)


def arrival(seq, x_m, delay_ms):
    pose = Pose.from_yaw(0.0, (x_m, 0.0, 0.0))
    return Arrival(seq, seq * FRAME_NS + round(delay_ms * 1e6), {"chair-1": pose})


def test_what_is_shown_is_late_by_the_delay():
    truths = [truth(k, 0.1 * k) for k in range(6)]
    for delay_ms, behind in ((0, 0), (60, 1), (150, 2)):
        arrivals = [arrival(k, 0.1 * k, delay_ms) for k in range(6)]
        assert shown_cm(arrivals, truths, {"chair-1"}) == pytest.approx(
            [10.0 * behind] * (6 - behind)
        )


def test_an_older_frame_that_comes_late_is_not_shown():
    arrivals = [arrival(0, 0.0, 0), arrival(1, 5.0, 250), arrival(2, 0.2, 0)]
    truths = [truth(k, 0.1 * k) for k in (0, 2, 4)]
    assert shown_cm(arrivals, truths, {"chair-1"}) == pytest.approx([0.0, 0.0, 20.0])


def test_an_object_counts_from_its_first_motion_and_by_the_session_s_clock():
    truths = [truth(0, 0.0, moved=False), truth(1, 0.1), truth(2, 0.1, captured_ns=5)]
    arrivals = [arrival(0, 0.0, 0), arrival(1, 0.1, 0)]
    assert shown_cm(arrivals, truths, {"chair-1"}) == pytest.approx([0.0, 0.0])
    assert shown_cm(arrivals, truths, set()) == []
    assert shown_cm([], truths, {"chair-1"}) == []


def test_nothing_moved_has_no_lost_share():
    assert lost_share([]) is None


@pytest.fixture
def run():
    text = '[sweep]\nscenario = "lab-short"\nduration_s = 0.3\n[faults]\nblur = { px = [2] }\n'
    return parse_sweep(text, source="s.toml", scene="lab").runs[1]


def test_a_run_gives_a_row_for_each_tracker(run, tiny, monkeypatch):
    asked = []

    def opened(plan: SessionPlan, truth_detector):
        asked.append((plan.scene, plan.seed, plan.record_to))
        return tiny.session(SessionPlan(scene="tiny", seed=plan.seed, methods=plan.methods))

    monkeypatch.setattr("studio.sweep.play.open_session", opened)
    found = play(replace(run, methods=("own", "paper")))
    own, paper = found["rows"]
    assert asked == [("lab", 0, None)]
    assert (own["fault"], own["size"], own["unit"], own["seed"]) == ("blur", 2.0, "px", 0)
    assert own["world_cm_mean"] == pytest.approx(3.0)
    assert paper["world_cm_mean"] == pytest.approx(6.0)
    assert own["frames"] == tiny.frames
    assert own["lost_share"] == 0.0
    assert own["shown_cm_mean"] > own["world_cm_mean"]
    assert found["seconds"] > 0.0


def test_a_run_in_a_process_of_its_own_says_why_it_is_refused(run):
    foreign = replace(run, scenario=run.scenario.replace('room = "lab"', 'room = "attic"'))
    with pytest.raises(RunRefusedError, match=r"run blur-2-seed-0: .*'attic', wanted 'lab'"):
        play_in_child(foreign)


def test_a_process_that_is_cancelled_or_dies_is_told_apart(run, monkeypatch, tmp_path):
    cancelled = threading.Event()
    cancelled.set()
    with pytest.raises(CancelledError):
        play_in_child(run, cancelled=cancelled)
    broken = tmp_path / "python"
    broken.write_text("#!/bin/sh\necho out of memory >&2\nkill -9 $$\n")
    broken.chmod(0o755)
    monkeypatch.setattr("studio.sweep.child.sys.executable", str(broken))
    with pytest.raises(RunDiedError, match="code -9: out of memory"):
        play_in_child(run)
    assert os.access(broken, os.X_OK)
