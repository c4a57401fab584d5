"""People's input enters a session with its frames, within limits, and is part of the recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from devices.hub.server import Arrived
from devices.messages import VoicePacket
from devices.recorded.people import RecordedAvatar, RecordedAvatarGone
from devices.recording import read_recording, read_session
from scenes.pose import Pose
from scenes.state import Annotation, Avatar, LiveSurface
from studio.live.people import entering
from studio.live.people.entering import Entrance
from studio.session.pipeline import PEOPLE, recorded_messages

BOARD = np.array([[-0.5, 1.5, 1.7], [0.5, 1.5, 1.7], [0.5, 1.5, 1.0], [-0.5, 1.5, 1.0]])
NOTHING = np.zeros((0, 3))


class FakeHub:
    """Gives what a test has put in, and keeps what is published."""

    def __init__(self, *arrived):
        self.arrived = list(arrived)
        self.states = []
        self.pictures = {}

    def take(self):
        return self.arrived.pop(0) if self.arrived else Arrived()

    def show(self, surface_id, jpeg):
        self.pictures[surface_id] = jpeg

    def publish(self, state):
        self.states.append(state)


def avatar(user_id="p1", number=0):
    hands = (NOTHING, np.arange(75.0).reshape(25, 3) / 7 + number)
    return Avatar(user_id, "remote", Pose.from_yaw(0.1 * number), hands, np.eye(3)[:2] / 3)


def line(key, count=2):
    return Annotation(key, "p1", np.ones((count, 3)), (1.0, 0.0, 0.0))


def surface(key, corners=BOARD):
    return LiveSurface(key, corners, (0, 0), "")


def entered(tiny, *arrived):
    entrance = Entrance(FakeHub(*arrived))
    return [entrance.enter(message).input for message in tiny.inputs()]


def test_avatars_enter_with_every_frame_and_end_after_two_seconds_of_silence(tiny):
    hub = FakeHub(Arrived(avatars=(avatar(),)))
    entrance = Entrance(hub)
    found = []
    for number, message in enumerate(tiny.inputs()):
        frame = replace(message.frame, t_ns=500_000_000 * number)
        live = entrance.enter(message.with_frame(frame)).input
        found.append(("p1" in {one.user_id for one in live.avatars}, len(live.gone)))
    assert found[:6] == [(True, 0)] * 4 + [(False, 1), (False, 0)]


def test_voices_enter_with_the_frame_they_came_with(tiny):
    said = VoicePacket(77, 77, "p1", 3, 2880, b"opus")
    first, second = entered(tiny, Arrived(voices=(said,)))[:2]
    assert first.voices == (replace(said, t_ns=first.frame.t_ns),)
    assert (first.voices[0].heard_ns, second.voices) == (77, ())


def test_hands_and_rays_keep_a_tenth_of_a_millimetre(tiny):
    live = entered(tiny, Arrived(avatars=(avatar(),)))[0]
    shown = live.avatars[-1]
    assert [hand.shape for hand in shown.hands] == [(0, 3), (25, 3)]
    assert shown.hands[1][0, 1] == 0.1429
    assert shown.ray[0, 0] == 0.3333


def test_surfaces_are_as_fine_as_the_camera_sees_them_and_bad_ones_are_refused(tiny):
    bent = BOARD + np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0], [0, 0, 0.0]])
    first, second, third = entered(
        tiny,
        Arrived(surfaces=(surface("board"), surface("bent", bent))),
        Arrived(surfaces=(surface("board", NOTHING), surface("never", NOTHING))),
        Arrived(surfaces=(surface("board", NOTHING),)),
    )[:3]
    assert [item.surface_id for item in first.surfaces] == ["board"]
    assert first.surfaces[0].stream_id == "camera-360"
    assert min(first.surfaces[0].size_px) > 0
    assert [(e.source, e.kind) for e in first.events] == [(PEOPLE, "refused")]
    assert "bent" in first.events[0].text
    assert [len(item.corners_in_world) for item in second.surfaces] == [0]
    assert not third.surfaces


def test_lines_beyond_the_limits_wait_or_are_refused(tiny, monkeypatch):
    monkeypatch.setattr(entering, "MAX_LINES", 5)
    monkeypatch.setattr(entering, "MAX_LINES_A_FRAME", 3)
    monkeypatch.setattr(entering, "MAX_EVENTS_A_FRAME", 2)
    many = tuple(line(f"p1-{number}") for number in range(9))
    first, second, third, fourth = entered(
        tiny,
        Arrived(lines=many),
        Arrived(lines=(line("p1-4", 3), line("p1-0", 0))),
        Arrived(lines=(line("p1-8"),)),
        Arrived(lines=(line("never", 0),)),
    )[:4]
    assert [item.annotation_id for item in first.annotations] == ["p1-0", "p1-1", "p1-2"]
    assert [event.kind for event in first.events] == ["refused", "refused", "more"]
    assert first.events[-1].text == "2 more events at once"
    # The newest of a line that waited, and an erased one makes room.
    assert {item.annotation_id: len(item.points_in_world) for item in second.annotations} == {
        "p1-3": 2,
        "p1-4": 3,
        "p1-0": 0,
    }
    assert [item.annotation_id for item in third.annotations] == ["p1-8"]
    assert not fourth.annotations


def state_of(output):
    state = output.state
    people = {key: [hand.tolist() for hand in a.hands] for key, a in state.avatars.items()}
    lines = {key: item.points_in_world.tolist() for key, item in state.annotations.items()}
    return state.version, people, lines, sorted(state.surfaces)


def test_a_live_session_records_people_and_sends_them_its_state(live, tiny):
    board = surface("board")
    hub = FakeHub(
        Arrived(avatars=(avatar(),), lines=(line("p1-1"),), events=(("joined", "Ann"),)),
        Arrived(voices=(VoicePacket(1, 1, "p1", 7, 960, b"opus"),)),
        *[Arrived(avatars=(avatar(number=n),), lines=(line("p1-1", 2 + n),)) for n in range(1, 6)],
        Arrived(avatars=(avatar("p2"),), lines=(line("p1-1", 0),), surfaces=(board,)),
        Arrived(surfaces=(surface("board", NOTHING),)),
    )
    session = live.session(people=hub)
    states = {}
    played = live.run(session, lambda o: states.update({o.input.frame.seq: state_of(o)}))
    live.push(session)
    live.until(lambda: len(states) >= 70 or played.error)
    session.end()
    played.thread.join(120)
    assert played.error is None
    assert [state.version for state in hub.states] == [version for version, *_ in states.values()]
    assert any("Ann" in event.text for event in played.result.events)
    boards = [state.surfaces["board"] for state in hub.states if state.surfaces]
    assert boards
    assert all(shown is board for shown in boards)  # by which a hub knows its people's own

    path = live.folder / "live.mcap"
    values = list(read_recording(path))
    assert sum(isinstance(value, RecordedAvatar) for value in values) > 10
    assert {v.gone.user_id for v in values if isinstance(v, RecordedAvatarGone)} == {"p1", "p2"}
    assert [v.opus for v in values if isinstance(v, VoicePacket)] == [b"opus"]
    info = read_session(path)
    from studio.session.plan import SessionPlan

    again = {}
    replay = tiny.session(
        SessionPlan(methods=("own",)),
        inputs=lambda: recorded_messages(path, info),
        methods={"own": tiny.tracker(0.0)},
    )
    replay.run(lambda output: again.update({output.input.frame.seq: state_of(output)}))
    assert again == states
    seen = [set(surfaces) for *_, surfaces in states.values()]
    assert {"board"} in seen
    assert seen[-1] == set()


@pytest.mark.parametrize("kind", ["line", "surface"])
def test_what_comes_and_goes_between_two_frames_never_enters(tiny, kind):
    if kind == "line":
        arrived = Arrived(lines=(line("p1-1"), line("p1-1", 0)))
    else:
        arrived = Arrived(surfaces=(surface("board"), surface("board", NOTHING)))
    first = entered(tiny, arrived)[0]
    assert not first.annotations
    assert not first.surfaces
    assert not [event for event in first.events if event.source == PEOPLE]
