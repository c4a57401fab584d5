"""The tracker's settings change while a session runs: tried beside, followed, replayed, forked."""

import numpy as np
import pytest

from devices.messages import Event
from devices.recording import read_recording, read_session
from studio.session.fork import open_fork
from studio.session.opening import open_session
from studio.session.pipeline import recorded_messages
from studio.session.plan import SessionPlan
from studio.session.trackers.settings import is_settings, settings_event
from tracking.options import TrackerOptions

PLAIN = TrackerOptions(texture=False)


class Adjusted:
    """Knows the truth; is 5 cm off without texture."""

    def __init__(self, tiny):
        self._by_texture = {True: tiny.tracker(0.0), False: tiny.tracker(0.05)}

    def start(self):
        return TrackerOptions()

    def adjusted(self, state, options):
        return options

    def step(self, state, frame, now_ns):
        _, output = self._by_texture[state.texture].step(0, frame, now_ns)
        return state, output


@pytest.fixture
def play(tiny):
    """Plays a session and calls back after each frame; gives y of the chair by frame."""

    def run(plan, after=lambda _session, _seq: None, **given):
        session = tiny.session(plan, methods={"own": Adjusted(tiny)}, **given)
        seen = []

        def watch(output):
            seen.append(output)
            after(session, output.input.frame.seq)

        session.run(watch)
        return seen

    return run


def off_cm(tiny, output, tracks=None):
    truth = output.message.truth.recorded.world_from_object["chair-1"]
    found = (tracks or output.shown).objects[0].world_from_object
    return round(100 * float(np.linalg.norm(found.translation - truth.translation)), 6)


def at_frame(seq, do):
    return lambda session, now: do(session) if now == seq else None


def test_a_change_holds_from_the_next_frame_on_is_recorded_and_replayed(tiny, play, tmp_path):
    path = tmp_path / "a.mcap"
    plan = SessionPlan(methods=("own",), record_to=path)
    seen = play(plan, at_frame(4, lambda session: session.adjust_tracker(PLAIN)))
    found = [off_cm(tiny, output) for output in seen]
    assert found == [0.0] * 5 + [5.0] * (tiny.frames - 5)
    (event,) = [v for v in read_recording(path) if isinstance(v, Event) and is_settings(v)]
    frame = seen[5].input.frame
    assert event == settings_event(frame.t_ns, PLAIN)
    assert event in seen[5].input.events

    again_path = tmp_path / "b.mcap"
    again = play(
        SessionPlan(methods=("own",), record_to=again_path),
        inputs=lambda: recorded_messages(path, read_session(path)),
    )
    for was, now in zip(seen, again, strict=True):
        assert now.input.events == was.input.events
        for a, b in zip(was.shown.objects, now.shown.objects, strict=True):
            assert np.array_equal(a.world_from_object.matrix(), b.world_from_object.matrix())
    assert [v for v in read_recording(again_path) if isinstance(v, Event) and is_settings(v)] == [
        event
    ]


def test_settings_to_begin_with_are_recorded_and_override_what_a_recording_says(
    tiny, play, tmp_path
):
    path = tmp_path / "a.mcap"
    first = play(SessionPlan(methods=("own",), record_to=path, options=PLAIN))
    assert {off_cm(tiny, output) for output in first} == {5.0}
    recorded = lambda: recorded_messages(path, read_session(path))  # noqa: E731
    assert {off_cm(tiny, o) for o in play(SessionPlan(methods=("own",)), inputs=recorded)} == {5.0}
    usual = SessionPlan(methods=("own",), options=TrackerOptions())
    assert {off_cm(tiny, o) for o in play(usual, inputs=recorded)} == {0.0}


def test_what_is_tried_runs_beside_and_changes_nothing(tiny, play):
    def act(session, seq):
        if seq in (3, 7):
            session.try_tracker(PLAIN if seq == 3 else None)

    seen = play(SessionPlan(methods=("own",)), act)
    assert {off_cm(tiny, output) for output in seen} == {0.0}
    tried = [None if o.trial is None else off_cm(tiny, o, o.trial) for o in seen]
    assert tried == [None] * 4 + [5.0] * 4 + [None] * (tiny.frames - 8)


def test_settings_of_another_version_are_refused_with_their_instant(tiny, play):
    def inputs():
        for message in tiny.inputs():
            live = message.input
            event = Event(live.frame.t_ns, "tracker", "settings", "colour=on")
            yield type(message)(
                type(live)(live.frame, live.packet, live.avatars, (event,)), message.truth
            )

    with pytest.raises(ValueError, match=r"at 0 s: the tracker has no setting 'colour'"):
        play(SessionPlan(methods=("own",)), inputs=inputs)


MINI = 'room = "lab"\nduration_s = 1.2\n[camera]\nfps = 5\nlens_size_px = 240\n'


def test_the_real_tracker_replays_and_forks_to_the_bit_with_its_changes(tmp_path):
    scenario = tmp_path / "mini.toml"
    scenario.write_text(MINI)
    path = tmp_path / "recording.mcap"
    plan = SessionPlan("lab", str(scenario), methods=("own",), record_to=path)
    session = open_session(plan)

    def play(session, after=lambda _seq: None):
        poses = []

        def watch(output):
            tracks = output.shown.objects
            poses.append([track.world_from_object.matrix().tolist() for track in tracks])
            after(output.input.frame.seq)

        session.run(watch)
        return poses

    changed = TrackerOptions(texture=False, recover=False, search_ms=5.0)
    first = play(session, lambda seq: session.adjust_tracker(changed) if seq == 1 else None)
    assert play(open_session(SessionPlan("lab", recording=path, methods=("own",)))) == first
    usual = SessionPlan("lab", recording=path, methods=("own",), options=TrackerOptions())
    assert play(open_session(usual)) != first
    fork = open_fork(path, at_s=0.8)
    assert play(open_session(SessionPlan("lab", methods=("own",), fork=fork))) == first
