"""`nexus sites …`: a router with its members, rooms listed, a site in a room, end to end."""

import importlib.util
import json
import re
import socket
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from devices.clock import WallClock
from devices.transport.keys import MemberRole
from devices.transport.passes import Admitted, admit, keep_building, read_pass
from scenes.opening import open_scene
from scenes.package.package import save_package
from scenes.state import SceneState
from scenes.workers.child_process import ChildProcess, module_command, module_environment
from studio.cli import main
from studio.live.sites.sharing import HERE, Sharing, shared
from tests.studio.live.sites.test_both_sides import tracked

needs_zenoh = pytest.mark.skipif(
    importlib.util.find_spec("zenoh") is None, reason="eclipse-zenoh is not installed"
)
PATIENCE_S = 60.0


class Verb:
    """A verb in a process of its own, and what it has said."""

    def __init__(self, stack, *words):
        self.lines = []
        command = module_command("studio.cli", *words)
        self.process = ChildProcess(
            ["sh", "-c", 'exec "$@" 2>&1', "sh", *command],
            stdin=subprocess.DEVNULL,
            on_line=self.lines.append,
            environment=module_environment(),
        )
        stack.callback(self.process.end)

    def says(self, pattern):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            for line in list(self.lines):
                if found := re.search(pattern, line):
                    return found
            assert self.process.is_running or not self.lines, self.lines
            time.sleep(0.02)
        raise AssertionError(f"it has not said {pattern!r}, but {self.lines}")


def test_passes_are_made_and_the_configuration_is_written(tmp_path, capsys):
    folder = ["--folder", str(tmp_path)]
    assert main(["sites", "admit", "room", "hall-3", *folder]) == 0
    assert main(["sites", "admit", "site", "north", *folder]) == 0
    out = capsys.readouterr().out.splitlines()
    assert read_pass(tmp_path / "passes" / "room-hall-3.pass").admitted.name == "hall-3"
    assert "start the router again" in out[1]
    assert main(["sites", "router", "--write-only", *folder]) == 0
    text = (tmp_path / "router.json5").read_text()
    assert '"room:hall-3"' in text
    assert '"default_permission": "deny"' in text
    assert main(["sites", "admit", "site", "North!", *folder]) == 3
    assert "small letters" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["sites", "join", "127.0.0.1"], "which room"),
        (["sites", "join", "10.9.9.9/lab"], "--pass FILE"),
        (["sites", "list", "host:x"], "HOST"),
        (["sites", "router", "--plain", "--listen", "0.0.0.0"], "this computer alone"),
        (["live", "--headless", "--pass", "x"], "go with --share"),
    ],
)
def test_what_makes_no_sense_is_refused(words, said, capsys):
    assert main(words) == 3
    assert said in capsys.readouterr().err


def test_a_site_in_the_same_process_needs_no_router(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path))
    said = []
    with shared(
        Sharing(HERE),
        tiny.scene,
        scene_name="tiny",
        inner=None,
        hub=lambda: None,
        clock=WallClock(),
        say=said.append,
    ) as room:
        assert room.name == "tiny"
        end = time.monotonic() + 120
        while "the room is reached" not in said:
            assert time.monotonic() < end, said
            time.sleep(0.02)
    assert any("people join at http://127.0.0.1" in line for line in said)


@needs_zenoh
def test_two_machines_and_a_router_end_to_end(tiny, tmp_path, monkeypatch):
    from studio.live.people.entering import Entrance

    monkeypatch.setenv("NEXUS_HOME", str(tmp_path / "home"))
    folder, package = tmp_path / "building", tmp_path / "tiny.gnx"
    save_package(tiny.scene, package)
    scene = open_scene(str(package))
    keep_building(folder, names=("127.0.0.1",))
    passes = {
        role: str(admit(folder, Admitted(MemberRole(role), name)))
        for role, name in (("room", "hall-3"), ("site", "north"), ("watcher", "lobby"))
    }
    with ExitStack() as stack:
        port = free_port()
        listen = ("--listen", f"127.0.0.1:{port}", "--folder", str(folder))
        router = Verb(stack, "sites", "router", *listen)
        router.says("router at")
        room = stack.enter_context(
            shared(
                Sharing(f"127.0.0.1:{port}", "", Path(passes["room"])),
                scene,
                scene_name="tiny",
                inner=None,
                hub=lambda: None,
                clock=WallClock(),
                say=lambda _line: None,
            )
        )
        listed = Verb(stack, "sites", "list", f"127.0.0.1:{port}", "--pass", passes["watcher"])
        listed.says("hall-3  tiny")
        site = Verb(
            stack,
            *("sites", "join", f"127.0.0.1:{port}/hall-3", str(package)),
            *("--pass", passes["site"], "--seconds", "40"),
        )
        found = site.says(r"people join at (\S+) .* with code (\d{6})")
        quest = Verb(
            stack,
            *("simulate", "quest", found[1], "--code", found[2]),
            *("--seconds", "8", "--json"),
        )
        entrance = Entrance(room)
        seen_lines, seen_avatars, step = set(), set(), 0
        while not any('"ended"' in line for line in quest.lines):
            step += 1
            entrance.publish(state_of(step))
            arrived = room.take()
            seen_lines |= {line.annotation_id for line in arrived.lines}
            seen_avatars |= {avatar.user_id for avatar in arrived.avatars}
            time.sleep(1 / 30)
            assert step < 30 * PATIENCE_S, quest.lines
        rows = {
            row["name"]: row["value"]
            for line in quest.lines
            if '"ended"' in line
            for row in json.loads(line)["rows"]
        }
        assert rows["quest.states"] > 20, "objects move there"
        assert seen_avatars == {"north.p1"}
        assert all(line.startswith("north.p1/") for line in seen_lines)
        assert seen_lines


def state_of(step):
    moving = tracked("chair", 0.01 * step, t_ns=step)
    return SceneState(version=step, t_ns=step * 33_000_000, objects={"chair": moving})


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return probe.getsockname()[1]


def test_the_verbs_are_in_the_table():
    done = subprocess.run(
        [sys.executable, "-m", "studio.cli", "sites", "-h"],
        capture_output=True,
        text=True,
        check=True,
        env=module_environment(),
    )
    assert done.stdout.splitlines() == [
        "nexus sites router",
        "nexus sites admit",
        "nexus sites list",
        "nexus sites join",
    ]
