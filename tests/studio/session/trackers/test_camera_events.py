"""What a tracker says of the camera comes out of a session, is recorded, and is said once."""

from dataclasses import replace

from devices.messages import Event
from devices.recording import read_recording
from studio.session.pipeline import recorded_messages
from studio.session.plan import SessionPlan
from studio.session.trackers.camera_events import SOURCE, camera_events, is_camera_event
from tracking.output import CameraMoment, CameraNotice

BUMPED = CameraNotice(CameraMoment.BUMPED, 1.234, 2.34)
FOUND = CameraNotice(CameraMoment.FOUND, 1.234, 2.34)


def bumping(session, seq):
    """The session with a tracker that says a bump at one frame."""
    method = session._methods["own"]
    step = method.step

    def said(state, frame, now_ns):
        state, output = step(state, frame, now_ns)
        notices = (BUMPED, FOUND) if frame.seq == seq else ()
        return state, replace(output, notices=notices)

    method.step = said
    return session


def test_events_say_what_and_how_far():
    bumped, found = camera_events(7, (BUMPED, FOUND))
    assert bumped == Event(7, SOURCE, "camera-bumped", "the camera was moved by 1.23° and 2.3 cm")
    assert found.kind == "camera-found"
    assert is_camera_event(bumped)
    assert not is_camera_event(replace(bumped, source="physics"))
    assert camera_events(7, ()) == ()


def test_a_session_says_and_records_them_and_a_replay_says_its_own(tiny, tmp_path):
    path = tmp_path / "recording.mcap"
    session = bumping(tiny.session(SessionPlan(record_to=path)), 3)
    outputs = []
    session.run(outputs.append)
    said = [
        (o.input.frame.seq, e.kind) for o in outputs for e in o.input.events if is_camera_event(e)
    ]
    kinds = ["camera-bumped", "camera-found"]
    assert said == [(3, kind) for kind in kinds]
    assert [v.kind for v in read_recording(path) if is_camera_event(v)] == kinds
    again = [e for m in recorded_messages(path, session.info) for e in m.input.events]
    assert again
    assert not any(map(is_camera_event, again))
