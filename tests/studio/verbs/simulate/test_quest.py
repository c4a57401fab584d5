"""The verb lets people join a hub, and says what it measured."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.server import Hub
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState, reduce_state
from scenes.workers.child_process import ChildProcess, module_command, module_environment
from scenes.workers.task import Task
from studio.cli import main


@pytest.fixture
def room():
    """A hub whose room changes 30 times a second."""
    clock = WallClock()
    hub = Hub(HubSettings(), {"/": Asset(b"<title>room</title>", "text/html")}, clock=clock)
    hub.start()

    def publish(task):
        state, number = SceneState(), 0
        while not task.pause(1 / 30):
            number += 1
            pose, t_ns = Pose.from_yaw(0.01 * number), clock.now_ns()
            track = TrackedObject(
                "chair-1", t_ns, pose, np.eye(4), 1.0, TrackState.TRACKED, 0.9, number
            )
            state = reduce_state(state, track, t_ns)
            hub.publish(state)

    task = Task("states", publish).start()
    yield hub
    task.cancel()
    task.join(120)
    hub.close()


def test_figures_of_two_people_as_rows(room, capsys):
    codes = [word for _ in range(2) for word in ("--code", room.invite().code)]
    words = ["simulate", "quest", room.url, *codes, "--clients", "2", "--seconds", "2", "--json"]
    assert main(words) == 0
    *events, ended = map(json.loads, capsys.readouterr().out.splitlines())
    assert [event["count"] for event in events] == [1, 2]
    assert ended["event"] == "ended"
    rows = {row["name"]: row["value"] for row in ended["rows"]}
    assert rows["quest.sent"] > 100
    assert 0 < rows["quest.hand_ms.p50"] <= rows["quest.hand_ms.p95"]
    assert 0 < rows["quest.state_ms.p95"] < 200
    assert rows["quest.join_s"] < 3
    assert "quest.return_s" not in rows  # nothing broke: not measured is not 0


def test_codes_of_standard_input_and_an_end_by_a_signal(room):
    import subprocess

    lines = []
    words = ("simulate", "quest", room.url, "--code", "-", "--json", "--hz", "20")
    child = ChildProcess(
        module_command("studio.cli", *words),
        stdin=subprocess.PIPE,
        on_line=lines.append,
        environment=module_environment(),
    )
    try:
        child.say(room.invite().code)
        for _ in range(200):
            if lines or not child.is_running:
                break
            child.wait(0.1)
        assert json.loads(lines[0]) == {"event": "joined", "count": 1}
        child.cancel()
        assert child.join(120)
        assert child.code == 0
        assert json.loads(lines[-1])["event"] == "ended"
    finally:
        child.end()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("URL",), "--code is missing"),
        (("URL", "--code", "1"), "the code is wrong"),
        (("room", "--code", "1"), "wanted http"),
        (("http://127.0.0.1:9/", "--code", "1"), "not reached"),
        (("URL", "--code", "1", "--clients", "0"), "1 to 256"),
        (("URL", "--code", "1", "--faults", "rain"), "kind 'rain'"),
        (("URL", "--code", "1", "--trust", "nowhere.pem"), "nowhere.pem: no root certificate"),
    ],
)
def test_mistakes_are_one_line(room, words, said, capsys, no_traceback):
    words = [room.url if word == "URL" else word for word in words]
    assert main(["simulate", "quest", *words]) == 3
    err = capsys.readouterr().err
    assert said in err
    assert len(err.strip().splitlines()) == 1


def test_somebody_who_waits_for_a_code_ends_at_once(room):
    import subprocess

    child = ChildProcess(
        module_command("studio.cli", "simulate", "quest", room.url, "--code", "-"),
        stdin=subprocess.PIPE,
        last_words=5,
        environment=module_environment(),
    )
    try:
        deadline = time.monotonic() + 120
        while "waiting for codes" not in " ".join(child.last_words()):
            assert time.monotonic() < deadline
            child.wait(0.05)
        child.cancel()
        assert child.join(120)
        assert "0 for 1 people" in " ".join(child.last_words())
    finally:
        child.end()
