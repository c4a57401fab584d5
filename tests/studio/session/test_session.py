import threading
from dataclasses import fields, replace

import numpy as np
import pytest

from devices.recording import read_recording
from devices.recording_codec import RecordedTrack
from scenes.state import Annotation
from studio.session.live_surfaces import live_surface
from studio.session.opening import open_session
from studio.session.pipeline import CancelledError, SessionInput, recorded_messages
from studio.session.plan import Pace, SessionPlan
from studio.session.trackers.methods import METHODS
from studio.verbs.sessions.replay import Comparison

OF_SIMULATIONS = (Pace.EXACT, Pace.PACED)
"""Live sessions have a camera: tests/studio/live."""


def run(tiny, plan, **options):
    outputs = []
    result = tiny.session(plan, **options).run(outputs.append)
    return outputs, result


def test_exact_sees_every_frame_and_reduces_the_state(tiny):
    outputs, result = run(tiny, SessionPlan())
    assert [o.input.frame.seq for o in outputs] == list(range(tiny.frames))
    assert (result.frames, result.dropped, result.lost) == (tiny.frames, 0, 0)
    last = outputs[-1].state
    assert set(last.objects) == {"chair-1", "stool-1"}
    assert set(last.avatars) == {"maya"}
    shown = outputs[-1].tracks["own"].objects[0]
    assert last.objects["chair-1"] is shown


def test_before_the_camera_was_found_nothing_is_tracked_and_after_it_all_is(tiny):
    def hidden_at(seqs):
        for message in tiny.inputs():
            hides = message.frame.seq in seqs
            frame = replace(message.frame, world_from_rig=None) if hides else message.frame
            yield message.with_frame(frame)

    outputs, result = run(tiny, SessionPlan(), inputs=lambda: hidden_at({0, 1, 6}))
    tracked = [o.input.frame.seq for o in outputs if o.tracks["own"].objects]
    assert tracked == list(range(2, tiny.frames))
    assert outputs[1].state.objects == {}
    assert (result.frames, result.lost) == (tiny.frames, 0)


def test_stages_of_the_shown_tracker_have_plain_names(tiny):
    _outputs, result = run(tiny, SessionPlan())
    stages = {stage.name: stage for stage in result.latencies.stages()}
    assert {"source", "detect", "pose", "track", "paper.detect", "paper.track"} <= set(stages)
    assert stages["pose"].p50_ms == pytest.approx(5.0)
    names = [row.name for row in result.latencies.rows()]
    assert "stage.pose.ms.p95" in names


@pytest.mark.parametrize("pace", OF_SIMULATIONS)
def test_what_is_recorded_comes_back(tiny, tmp_path, pace):
    path = tmp_path / "recording.mcap"
    plan = SessionPlan(pace=pace, record_to=path)
    session = tiny.session(plan)
    outputs = []
    result = session.run(outputs.append)
    inputs = list(recorded_messages(path, session.info))
    assert len(inputs) == tiny.frames
    assert result.frames + result.dropped == tiny.frames
    assert [e.text for i in inputs for e in i.input.events] == ["pushes chair 1"]
    assert all(i.truth is not None and len(i.input.avatars) == 1 for i in inputs)
    tracks = [v for v in read_recording(path) if isinstance(v, RecordedTrack)]
    assert len(tracks) == 2 * 2 * result.frames


@pytest.mark.parametrize("pace", OF_SIMULATIONS)
def test_what_is_drawn_is_recorded_and_stays_in_the_state(tiny, tmp_path, pace):
    def drawn(message):
        seq = message.frame.seq
        line = Annotation(
            "ana-1", "ana", np.arange(3.0 * (seq + 2)).reshape(-1, 3), (1.0, 0.0, 0.0)
        )
        lines = (line,) if seq < 3 else ()
        return replace(message, input=replace(message.input, annotations=lines))

    path = tmp_path / "recording.mcap"
    session = tiny.session(
        SessionPlan(pace=pace, record_to=path), inputs=lambda: map(drawn, tiny.inputs())
    )
    outputs = []
    session.run(outputs.append)
    # Frames may be dropped on the way, the line's last corner may not.
    assert len(outputs[-1].state.annotations["ana-1"].points_in_world) == 4
    again = [line for m in recorded_messages(path, session.info) for line in m.input.annotations]
    assert [len(line.points_in_world) for line in again] == [2, 3, 4]


def test_replay_of_an_exact_recording_gives_the_same_tracks(tiny, tmp_path):
    path = tmp_path / "recording.mcap"
    recorded = tiny.session(SessionPlan(record_to=path))
    recorded.run(lambda _output: None)
    comparison = Comparison()
    again = tiny.session(SessionPlan(), inputs=lambda: recorded_messages(path, recorded.info))
    again.run(comparison.add)
    assert comparison.compared == 2 * 2 * tiny.frames
    assert comparison.different == comparison.missing == 0
    assert not comparison.first


def test_replay_with_another_tracker_is_noticed(tiny, tmp_path):
    path = tmp_path / "recording.mcap"
    recorded = tiny.session(SessionPlan(methods=("own",), record_to=path))
    recorded.run(lambda _output: None)
    comparison = Comparison()
    again = tiny.session(
        SessionPlan(methods=("own",)),
        inputs=lambda: recorded_messages(path, recorded.info),
        offset_m=0.05,
    )
    again.run(comparison.add)
    assert comparison.different == 2 * tiny.frames
    assert comparison.largest_cm == pytest.approx(2.0)
    assert "chair-1 (own) at frame 0" in comparison.first
    assert {r.name for r in comparison.rows() if r.passed is False} == {"replay.tracks.different"}


@pytest.mark.parametrize("pace", OF_SIMULATIONS)
def test_cancelling_stops_and_leaves_only_the_part_file(tiny, tmp_path, pace):
    path = tmp_path / "recording.mcap"
    cancelled = threading.Event()
    session = tiny.session(SessionPlan(pace=pace, record_to=path))
    with pytest.raises(CancelledError):
        session.run(lambda _output: cancelled.set(), cancelled=cancelled)
    assert not path.exists()
    assert path.with_name("recording.mcap.part").exists()


@pytest.mark.parametrize("pace", OF_SIMULATIONS)
def test_an_error_of_the_source_reaches_the_caller(tiny, pace):
    def broken():
        yield next(tiny.inputs())
        raise ValueError("camera fell over")

    with pytest.raises(ValueError, match="camera fell over"):
        tiny.session(SessionPlan(pace=pace), inputs=broken).run(lambda _output: None)


def test_a_slow_tracker_drops_frames_when_paced_and_they_are_counted(tiny):
    turn = threading.Event()
    slow = tiny.tracker(0.0)
    step = slow.step

    def wait_for_the_end(state, frame, now_ns):
        if frame.seq == 0:
            assert turn.wait(timeout=30)
        return step(state, frame, now_ns)

    slow.step = wait_for_the_end

    def inputs():
        yield from tiny.inputs()
        turn.set()

    outputs, result = run(
        tiny,
        SessionPlan(pace=Pace.PACED, methods=("own",)),
        inputs=inputs,
        methods={"own": slow},
    )
    assert result.dropped > 0
    assert result.frames + result.dropped == tiny.frames
    assert outputs[-1].input.frame.seq == tiny.frames - 1


def test_what_a_live_camera_would_give_has_no_masks_and_no_truth():
    given = {field.name for field in fields(SessionInput)}
    people = {"avatars", "events", "surfaces", "annotations", "gone", "placed", "voices"}
    assert given == {"frame", "packet", *people}


def test_a_detector_of_the_caller_sees_each_truth_before_the_methods_see_the_frame(tiny):
    seen = []

    class Detector:
        def see(self, frame, truth):
            assert truth.recorded.seq == frame.seq
            seen.append(("truth", frame.seq))

    class Method(type(tiny.tracker(0.0))):
        def step(self, state, frame, now_ns):
            seen.append(("frame", frame.seq))
            return super().step(state, frame, now_ns)

    method = Method(tiny.scene, 0.0)
    run(tiny, SessionPlan(methods=("own",)), methods={"own": method}, truth_detector=Detector())
    assert seen == [(what, seq) for seq in range(tiny.frames) for what in ("truth", "frame")]


def test_unknown_methods_are_refused():
    with pytest.raises(ValueError, match=f"wanted some of {', '.join(METHODS)}"):
        open_session(SessionPlan(methods=("magic",)))


BOARD = np.array([[-0.5, 1.5, 1.7], [0.5, 1.5, 1.7], [0.5, 1.5, 1.0], [-0.5, 1.5, 1.0]])


@pytest.mark.parametrize("pace", OF_SIMULATIONS)
def test_surfaces_show_live_video_and_come_back_from_the_recording(tiny, tmp_path, pace):
    def inputs():
        for message in tiny.inputs():
            first = message.frame.seq == 0
            surfaces = (live_surface("board", BOARD, message.frame),) if first else ()
            yield replace(message, input=replace(message.input, surfaces=surfaces))

    path = tmp_path / "recording.mcap"
    session = tiny.session(SessionPlan(pace=pace, record_to=path), inputs=inputs)
    outputs = []
    session.run(outputs.append)
    shown = [live for output in outputs for live in output.surfaces]
    assert len(shown) == len(outputs)
    assert {live.surface.surface_id for live in shown} == {"board"}
    assert set(outputs[-1].state.surfaces) == {"board"}
    assert len({live.picture.tobytes() for live in shown}) > 1
    recorded = [s for i in recorded_messages(path, session.info) for s in i.input.surfaces]
    assert len(recorded) == 1
    np.testing.assert_array_equal(recorded[0].corners_in_world, BOARD)


def test_a_surface_can_be_made_live_while_the_session_plays(tiny):
    session = tiny.session(SessionPlan())
    outputs = []

    def watch(output):
        if output.input.frame.seq == 4:
            session.make_live(live_surface("board", BOARD, output.input.frame))
        outputs.append(output)

    session.run(watch)
    assert [len(output.surfaces) for output in outputs] == [0] * 5 + [1] * (tiny.frames - 5)
