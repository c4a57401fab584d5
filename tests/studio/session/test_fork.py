"""What can be forked, and the proof that a fork is the recorded session until its instant."""

from dataclasses import replace

import numpy as np
import pytest

from devices.messages import Event
from devices.recording import Recorder, read_session
from devices.session_info import ForkOrigin, ScenarioChange
from scenes.pose import Pose
from scenes.state import Annotation, Avatar, AvatarGone, Proposal, SharedPrimitive
from sim.scenarios.scenario import parse_scenario
from studio.session.fork import Fork, open_fork
from studio.session.pipeline import PEOPLE, recorded_messages
from studio.session.plan import SessionPlan

TEXT = "room = 'lab'\nduration_s = 1.2\n[camera]\nfps = 10\n"
AT_NS = 700_000_000


@pytest.fixture(scope="module")
def recorded(tiny, tmp_path_factory):
    path = tmp_path_factory.mktemp("fork") / "recording.mcap"
    session = tiny.session(SessionPlan(methods=("own",), record_to=path))
    outputs = []
    session.run(outputs.append)
    return path, outputs


def fork_of(recorded, *, is_changed=True):
    path, _outputs = recorded
    origin = ForkOrigin(path.name, "", AT_NS)
    scenario = parse_scenario(TEXT, source="tiny.toml")
    return Fork(path, read_session(path), origin, scenario, (), (), is_changed)


def other_picture(message):
    packet = replace(message.input.packet, data=message.input.packet.data + b"\0")
    return replace(message, input=replace(message.input, packet=packet))


@pytest.mark.parametrize(("is_changed", "held"), [(True, 7), (False, 12)])
def test_frames_and_tracks_that_are_as_recorded_pass(tiny, recorded, is_changed, held):
    fork = fork_of(recorded, is_changed=is_changed)
    messages = list(fork.proven(tiny.inputs()))
    assert [m.frame.seq for m in messages] == list(range(tiny.frames))
    assert sum(bool(m.recorded) for m in messages) == held
    for message, output in zip(messages, recorded[1], strict=True):
        fork.check_tracks(message, output.tracks)


def test_a_frame_that_comes_out_differently_is_named_with_versions(tiny, recorded):
    messages = (other_picture(m) if m.frame.seq == 4 else m for m in tiny.inputs())
    with pytest.raises(ValueError, match="cannot be exact") as refused:
        list(fork_of(recorded).proven(messages))
    said = str(refused.value)
    assert "frame 4 (0.4 s) differs from the recorded one in its picture" in said
    assert "numpy missing then" in said
    assert "\n" not in said


def test_frames_after_the_instant_may_differ_if_the_scenario_does(tiny, recorded):
    messages = [other_picture(m) if m.frame.t_ns >= AT_NS else m for m in tiny.inputs()]
    assert len(list(fork_of(recorded).proven(iter(messages)))) == tiny.frames
    with pytest.raises(ValueError, match="frame 7"):
        list(fork_of(recorded, is_changed=False).proven(iter(messages)))


def test_a_frame_too_many_or_too_few_is_noticed(tiny, recorded):
    fork = fork_of(recorded)
    without = (m for m in tiny.inputs() if m.frame.seq != 2)
    with pytest.raises(ValueError, match="frame 3 "):
        list(fork.proven(without))


def test_tracks_that_come_out_differently_are_named(tiny, recorded):
    fork = fork_of(recorded)
    tracker = tiny.tracker(0.031)
    message = next(fork.proven(tiny.inputs()))
    _state, output = tracker.step(tracker.start(), message.frame, 0)
    with pytest.raises(ValueError, match=r"frame 0 \(0 s\) .* the track of chair-1 \(own\)"):
        fork.check_tracks(message, {"own": output})


def test_what_a_user_made_live_comes_back_from_the_recording(tiny, tmp_path):
    path = tmp_path / "recording.mcap"
    session = tiny.session(SessionPlan(methods=("own",), record_to=path))
    board = ((-0.5, 1.5, 1.7), (0.5, 1.5, 1.7), (0.5, 1.5, 1.0), (-0.5, 1.5, 1.0))

    def watch(output):
        if output.input.frame.seq == 3:
            from studio.session.live_surfaces import live_surface

            session.make_live(live_surface("board", board, output.input.frame))

    session.run(watch)
    fork = fork_of((path, None))
    given = [
        (m.frame.seq, s.surface_id) for m in fork.proven(tiny.inputs()) for s in m.input.surfaces
    ]
    replayed = [
        (m.frame.seq, s.surface_id)
        for m in recorded_messages(path, session.info)
        for s in m.input.surfaces
    ]
    assert given == replayed == [(4, "board")]


def guest_inputs(tiny):
    """The tiny session with somebody who draws a line, puts a box, proposes, erases and leaves."""
    line = np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.2, 0.0, 1.1]])
    for message in tiny.inputs():
        seq, live = message.frame.seq, message.input
        head = Pose.from_yaw(0.1 * seq, (0.3, 0.1 * seq, 1.6))
        hands = (np.zeros((0, 3)), 0.01 * seq + np.arange(75.0).reshape(25, 3) / 300)
        guest = Avatar("p1", "remote", head, hands, np.eye(3)[:2], "Ann")
        drawn = {2: line[:2], 3: line, 8: line[:0]}.get(seq)
        notes = () if drawn is None else (Annotation("p1-1", "p1", drawn, (0.0, 0.5, 1.0)),)
        shape = {3: "arrow", 5: "arrow", 9: None}.get(seq, "")
        size, colour = (0.5, 0.1, 0.1), (0.1, 0.2, 0.3)
        bodies = (SharedPrimitive("p1/b", "p1", shape, size, colour, head),) if shape != "" else ()
        wanted = {4: "chair-1", 6: "chair-1", 10: ""}.get(seq)
        copies = () if wanted is None else (Proposal("p1/c", "p1", "Ann", wanted, head),)
        came = (Event(live.frame.t_ns, PEOPLE, "joined", "Ann"),) if seq == 1 else ()
        live = replace(
            live,
            avatars=live.avatars + ((guest,) if 1 <= seq < 10 else ()),
            annotations=live.annotations + notes,
            events=live.events + came,
            gone=(AvatarGone("p1"),) if seq == 10 else (),
            placed=(*bodies, *copies),
        )
        yield replace(message, input=live)


def states_of(session):
    """Of every frame: people, their things and version of the state, as plain numbers."""
    found = []

    def watch(output):
        state = output.state
        found.append(
            (
                state.version,
                {
                    key: (
                        item.name,
                        item.world_from_head.matrix().tolist(),
                        [hand.tolist() for hand in item.hands],
                        None if item.ray is None else item.ray.tolist(),
                    )
                    for key, item in state.avatars.items()
                },
                {key: item.points_in_world.tolist() for key, item in state.annotations.items()},
                {
                    key: (item.shape, item.world_from_primitive.matrix().tolist())
                    for key, item in state.primitives.items()
                },
                {
                    key: (item.object_id, item.world_from_object.matrix().tolist())
                    for key, item in state.proposals.items()
                },
                [event.text for event in output.input.events],
            )
        )

    session.run(watch)
    return found


def test_people_who_were_connected_replay_and_fork_to_the_bit(tiny, tmp_path):
    path, again = tmp_path / "recording.mcap", tmp_path / "again.mcap"
    plan = SessionPlan(methods=("own",), record_to=path)
    session = tiny.session(plan, inputs=lambda: guest_inputs(tiny))
    states = states_of(session)
    assert [len(people) for _, people, *_ in states] == [1, *[2] * 9, 1, 1]
    assert [len(lines) for _, _, lines, *_ in states] == [0, 0, *[1] * 6, *[0] * 4]
    assert [len(bodies) for *_, bodies, _, _ in states] == [*[0] * 3, *[1] * 6, *[0] * 3]
    assert [len(copies) for *_, copies, _ in states] == [*[0] * 4, *[1] * 6, *[0] * 2]

    def replayed():
        return recorded_messages(path, session.info)

    assert states_of(tiny.session(plan_of(again), inputs=replayed)) == states
    fork = replace(fork_of((path, None)), is_changed=False)
    assert (
        states_of(tiny.session(plan_of(None), inputs=lambda: fork.proven(tiny.inputs()))) == states
    )


def plan_of(record_to):
    return SessionPlan(methods=("own",), record_to=record_to)


def recording(tmp_path, tiny, **changes):
    """An empty recording that says of itself what a rehearsal's would, but for `changes`."""
    info = tiny.session(SessionPlan(methods=("own",))).info
    path = tmp_path / "recording.mcap"
    with Recorder(path, replace(info, **{"scenario": TEXT, **changes})):
        pass
    return path


@pytest.mark.parametrize(
    ("changes", "at_s", "said"),
    [
        ({"mode": "paced"}, 0.5, "recorded in real time"),
        ({"seed": None}, 0.5, "of a real camera"),
        ({"scenario": ""}, 0.5, "no seed or scenario"),
        ({"scenario": "room = 3"}, 0.5, "cannot read its scenario: tiny-push.toml: room = 3"),
        ({}, 1.2, "--at 1.2, wanted seconds from 0 to 1.1, its last frame"),
        ({}, -0.1, "wanted seconds from 0 to 1.1"),
        ({}, float("nan"), "--at nan, wanted seconds"),
        (
            {"changes": (ScenarioChange(10**9, TEXT.replace("1.2", "3"), "long"),)},
            4.0,
            "wanted seconds from 0 to 2.9",
        ),
    ],
)
def test_what_cannot_be_forked_is_one_line(tmp_path, tiny, changes, at_s, said):
    path = recording(tmp_path, tiny, **changes)
    with pytest.raises(ValueError, match=r"recording\.mcap") as refused:
        open_fork(path, at_s=at_s)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_recording_that_was_cut_off_is_refused(tmp_path, tiny):
    path = recording(tmp_path, tiny)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(ValueError, match="only a whole recording of a rehearsal can be forked"):
        open_fork(path, at_s=0.5)


def test_another_version_of_the_scene_is_refused(recorded):
    with pytest.raises(ValueError, match="another version of scene 'tiny'"):
        fork_of(recorded).check_scene("0123456789abcdef")


def test_a_fork_of_a_fork_keeps_what_came_before_and_replaces_what_came_later(tmp_path, tiny):
    changes = tuple(ScenarioChange(round(t * 1e9), TEXT, f"from-{t:g}") for t in (0.2, 0.6))
    path = recording(tmp_path, tiny, changes=changes)
    unchanged = open_fork(path, at_s=0.4)
    assert unchanged.changes == changes
    assert not unchanged.is_changed
    scenario = tmp_path / "new.toml"
    scenario.write_text(TEXT)
    fork = open_fork(path, at_s=0.4, scenario=str(scenario))
    assert fork.is_changed
    assert fork.changes == (changes[0], ScenarioChange(400_000_000, TEXT, "new"))
    assert [switch.t_ns for switch in fork.then] == [200_000_000, 400_000_000]
    assert fork.origin.recording == "recording.mcap"
    assert len(fork.origin.sha256) == 64
