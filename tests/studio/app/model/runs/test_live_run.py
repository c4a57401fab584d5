"""What the live session's button says and does, without a window."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.camera.address import AddressError
from studio.app.model.documents.document import Document
from studio.app.model.jobs.live_job import LiveJob, LivePlan
from studio.app.model.runs.live_run import NO_STEP, LiveChoice, LiveRun, Step, shown_address
from studio.app.model.settings import RECENT, Settings
from studio.app.model.workbench import Workbench
from studio.live.status import LiveState
from tracking.options import TrackerOptions


class Runner:
    """Takes jobs and plays none."""

    def __init__(self, out):
        self.job, self.out = None, out
        self.is_busy = self.is_playing = False
        self.stopped = 0

    def new_folder(self, *words, out=None):
        return self.out / "-".join(words)

    def play(self, job):
        self.job = job

    def stop(self):
        self.stopped += 1


class Playing(LiveJob):
    """A job that seems to run, with a session in a given state."""

    def __init__(self, plan, state):
        super().__init__(plan, options=TrackerOptions())
        self.live = SimpleNamespace(state=state, go_live=lambda: None)

    @property
    def running(self):
        return True


@pytest.fixture
def live(tmp_path):
    bench = Workbench(Document("lab"), Settings(), SimpleNamespace(push=lambda change: None))
    return LiveRun(bench, Runner(tmp_path))


def test_it_begins_with_what_was_typed_and_remembers_it_without_the_password(live):
    live.choose(LiveChoice("rtsp://me:secret@10.0.0.2/x", "side_by_side 0 180", "scan"))
    assert live.step is Step.CHECK
    live.go_on()
    plan = live._run.job.plan
    assert plan.setup.camera.host == "10.0.0.2"
    assert plan.setup.layout.turns == (0, 2)
    assert plan.setup.place == "scan"
    assert live._bench.settings.cameras == ("rtsp://10.0.0.2/x",)


def test_a_wrong_word_begins_nothing(live):
    live.choose(LiveChoice("ftp://10.0.0.2"))
    with pytest.raises(AddressError, match="ftp:// is not known"):
        live.begin()
    live.choose(LiveChoice(layout="sideways"))
    with pytest.raises(ValueError, match="sideways"):
        live.begin()
    assert live._run.job is None
    assert live._bench.settings.cameras == ()


def test_addresses_are_remembered_newest_first_and_not_for_ever(live):
    for number in range(RECENT + 3):
        live.choose(LiveChoice(f"udp://:{5000 + number}"))
        live.begin()
    live.choose(LiveChoice("udp://:5010"))
    live.begin()
    cameras = live._bench.settings.cameras
    assert cameras[:2] == ("udp://:5010", f"udp://:{5000 + RECENT + 2}")
    assert len(cameras) == len(set(cameras)) == RECENT


@pytest.mark.parametrize("state", list(LiveState))
def test_every_state_has_a_step(live, state, tmp_path):
    live._run.job = Playing(LivePlan("lab", live.setup(), tmp_path), state)
    usual = {
        LiveState.CONFIRMING: Step.CONFIRM,
        LiveState.REFUSED: Step.TRY_AGAIN,
        LiveState.READY: Step.GO_LIVE,
        LiveState.LIVE: Step.END,
        LiveState.ENDED: Step.ENDING,
    }
    assert live.step is usual.get(state, Step.GO_LIVE_SOON)
    if live.step is Step.GO_LIVE_SOON:
        live.go_on()
        assert live.step in NO_STEP


def test_the_camera_of_a_session_that_plays_is_not_changed(live, tmp_path):
    live._run.job = Playing(LivePlan("lab", live.setup(), tmp_path), LiveState.LIVE)
    with pytest.raises(ValueError, match="end the session first"):
        live.choose(LiveChoice("udp://:5000"))
    live.go_on()
    assert live._run.stopped == 1


def test_nothing_to_direct_is_said_in_words(live):
    for ask in (live.go_live, live.confirm, live.find_camera, live.undo_tracker, live.check_again):
        with pytest.raises(ValueError, match=r"check and connect first|no picture yet"):
            ask()
    live.end()
    assert live._run.stopped == 0


def test_the_command_does_the_same(live):
    live.choose(LiveChoice("udp://:5000", "stacked 90 270", "scan"))
    assert live.command() == (
        "nexus live lab --headless --camera udp://:5000 --layout 'stacked 90 270' --place scan"
    )
    live.choose(LiveChoice(is_simulated=True))
    assert live.command() == "nexus live lab --headless --simulated"
    assert live.setup().camera.port == 0


@given(st.text("abc/:@.?", max_size=20), st.text("abc:", min_size=1, max_size=10))
def test_no_password_is_shown(path, word):
    shown = shown_address(f"rtsp://user:{word}-secret@10.0.0.2/{path}")
    assert "secret" not in shown
    assert shown == f"rtsp://10.0.0.2/{path}"


def test_what_has_no_host_stays():
    assert shown_address(" v4l2:/dev/video0 ") == "v4l2:/dev/video0"
    assert shown_address("me@home.mp4") == "me@home.mp4"


def test_the_picture_of_a_headset_is_that_of_whoever_wears_it(live):
    assert live.headset_view() is None
    live._run.job = job = Playing(LivePlan("lab", None, live._run.out), LiveState.LIVE)
    job.live.worn = None
    assert live.headset_view() is None, "nobody wears one"
    anchoring = SimpleNamespace(picture=None)
    job.live.worn = SimpleNamespace(anchoring=anchoring, view=lambda: "picture")
    job.live.now_ns = lambda: 3_500_000_000
    assert live.headset_view().t_ns is None
    anchoring.picture = SimpleNamespace(t_ns=1_000_000_000)
    seen = live.headset_view()
    assert (seen.person_id, seen.t_ns, seen.age_s) == ("hololens", 1_000_000_000, 2.5)
    assert seen.draw() == "picture"


def test_a_doubtful_layout_is_confirmed_and_goes_live_by_one_press(live):
    live._run.job = job = Playing(LivePlan("lab", None, live._run.out), LiveState.CONFIRMING)
    done = []
    job.live.layout, job.live.choose_layout = "stacked", lambda layout: done.append(layout)
    job.live.go_live = lambda: done.append("live")
    assert live.step == "Confirm and go live"
    live.go_on()
    assert done == ["stacked", "live"]
    job.live.state = LiveState.CONNECTING
    assert live.step is Step.GOES_LIVE
    # Confirmed by its own command, the button still asks.
    live._goes_live, job.live.state = False, LiveState.CONFIRMING
    live.confirm()
    job.live.state = LiveState.CONNECTING
    assert live.step is Step.GO_LIVE_SOON
