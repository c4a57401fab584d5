"""The simulated camera as a process of its own, received by the studio's own receiver."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import av
import pytest

from devices.camera.address import parse_address
from devices.camera.receiver import CameraReceiver
from devices.clock import WallClock
from sim.wire.streaming.truth_file import read_truth
from studio.cli import main
from tests.pushed_camera import numbered_pictures

SCRIPT = """
import signal, sys
# Whoever runs the tests in the background has SIGINT ignored, which children inherit.
signal.signal(signal.SIGINT, signal.default_int_handler)
from studio.cli import main
sys.exit(main())
"""
SMALL = ("--size", "320x160", "--fps", "20", "--bitrate", "1", "--film-seconds", "1.5")


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("home")


@pytest.fixture
def receiver():
    made = CameraReceiver(parse_address("rtmp://127.0.0.1:0/live/room"), WallClock())
    until = time.monotonic() + 120
    while not made.listening_at and time.monotonic() < until:
        time.sleep(0.01)
    yield made
    made.close()


@contextmanager
def camera(home, *words):
    """The camera as a child; gives its events as they come, and ends it as a parent does."""
    child = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, "simulate", "camera", *words, *SMALL, "--json"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "NEXUS_HOME": str(home)},
    )
    try:
        yield child, map(json.loads, child.stdout)
    finally:
        if child.poll() is None:
            child.send_signal(signal.SIGTERM)
        child.stdout.close()
        assert child.wait(30) == 0


def named(events, name):
    """The next event of a name."""
    return next(event for event in events if event["event"] == name)


def pictures(receiver, count):
    taken = []
    until = time.monotonic() + 120
    while len(taken) < count and time.monotonic() < until:
        received = receiver.latest.take(0.2)
        if received is not None:
            taken.append(received)
    return taken


def test_a_child_streams_and_its_truth_fits_what_arrives(home, receiver, tmp_path):
    truth = tmp_path / "truth.jsonl"
    words = ("lab", "--push", receiver.listening_at, "--truth", str(truth))
    with camera(home, *words) as (child, events):
        started = named(events, "started")
        assert started["push"] == [receiver.listening_at]
        assert (started["size"], started["has_truth"]) == ([320, 160], True)
        named(events, "connected")
        received = pictures(receiver, 30)
        child.send_signal(signal.SIGTERM)
        ended = named(events, "ended")
        assert ended["reason"] == "cancelled"
        assert ended["outputs"]["rtmp"]["sent"] >= 30
        assert child.wait(30) == 0
    assert len(received) == 30
    rows = {row.time.stamp_ns // 1_000_000: row for row in read_truth(truth)}
    for each in received:
        row = rows[each.pts_ns // 1_000_000]
        assert row.world_from_object.keys() >= {"chair-1", "book-1"}
        assert row.world_from_rig is not None
        assert row.sent_ns["rtmp"] >= row.time.wall_ns - 20_000_000


def test_it_ends_by_itself_and_says_which_faults_there_were(home, receiver):
    words = ("--push", receiver.listening_at, "--seconds", "1.5", "--fault", "loss:at=0.5,for=0.5")
    with camera(home, "lab", *words) as (child, events):
        begun, ended = named(events, "fault_begins"), named(events, "fault_ends")
        assert (begun["kind"], begun["at_s"]) == ("loss", 0.5)
        assert ended["t_ns"] - begun["t_ns"] == pytest.approx(5e8, abs=6e7)
        assert named(events, "ended")["reason"] == "played"
        assert child.wait(30) == 0


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("lab", "--fault", "flood"), "flood"),
        (("lab", "--size", "300x200"), "2:1"),
        (("lab", "--push", "rtmp://example.org/live/room"), "--network"),
        (("lab", "--push", "http://127.0.0.1/"), "rtmp://"),
        (("none.mcap",), "none.mcap"),
    ],
)
def test_bad_input_is_refused_in_one_line(words, why, capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path))
    assert main(["simulate", "camera", *words]) == 3
    assert why in capsys.readouterr().err
    assert not list(tmp_path.glob("films/*"))


def test_a_video_is_served_once_over_rtsp(home, tmp_path):
    video = numbered_video(tmp_path / "room.mp4", seconds=3)
    with camera(home, str(video), "--rtsp", "0") as (child, events):
        started = named(events, "started")
        assert (started["layout"], started["has_truth"]) == ("unknown", False)
        with av.open(started["rtsp"], options={"rtsp_transport": "tcp"}, timeout=5) as stream:
            frames = stream.decode(video=0)
            assert [next(frames).width for _ in range(10)] == [320] * 10
        assert named(events, "ended")["reason"] == "played"
        assert child.wait(30) == 0


def test_nothing_can_be_drawn_into_a_finished_video(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path))
    video = numbered_video(tmp_path / "room.mp4", seconds=1)
    assert main(["simulate", "camera", str(video), "--fault", "bump:at=1"]) == 3
    assert "bump" in capsys.readouterr().err


def test_an_insta360_and_its_http_interface_are_said_with_their_ports(home):
    with camera(home, "lab", "--insta360", "0", "--osc", "0") as (child, events):
        started = named(events, "started")
        url = f"http://127.0.0.1:{started['osc_port']}/osc/info"
        asked = urllib.request.Request(url, headers={"X-XSRF-Protected": "1"})
        with urllib.request.urlopen(asked, timeout=5) as answer:
            assert json.loads(answer.read())["model"] == "Insta360 X4"
        assert started["insta360"] == (
            f"insta360://127.0.0.1:{started['insta360_port']}?http={started['osc_port']}"
        )
        child.send_signal(signal.SIGINT)
        assert named(events, "ended")["reason"] == "cancelled"
        assert child.wait(30) == 0


ORPHAN = """
import subprocess, sys
child = subprocess.Popen([sys.executable, *sys.argv[1:]], stdout=subprocess.PIPE, text=True)
while '"started"' not in child.stdout.readline():
    pass
print(child.pid, flush=True)
sys.stdin.read()
"""


@pytest.mark.skipif(not Path("/proc").exists(), reason="reads /proc, which only Linux has")
def test_a_child_whose_parent_is_killed_ends_by_itself(home):
    words = ["-c", SCRIPT, "simulate", "camera", "lab", "--rtsp", "0", *SMALL, "--json"]
    parent = subprocess.Popen(
        [sys.executable, "-c", ORPHAN, *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "NEXUS_HOME": str(home)},
    )
    pid = int(parent.stdout.readline())
    assert Path(f"/proc/{pid}").exists()
    parent.kill()
    parent.wait(10)
    parent.stdin.close()
    parent.stdout.close()
    until = time.monotonic() + 120
    while time.monotonic() < until and not is_over(pid):
        time.sleep(0.1)
    assert is_over(pid)


def is_over(pid):
    """Whether a process has ended, waited for or not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return True
    return state == "Z"


def numbered_video(path, *, seconds):
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=20, options={"bf": "0", "g": "10"})
        stream.width, stream.height, stream.pix_fmt = 320, 160, "yuv420p"
        stream.time_base = Fraction(1, 20)
        for k, picture in enumerate(numbered_pictures((320, 160), 20, count=20 * seconds)):
            frame = av.VideoFrame.from_ndarray(picture.rgb, format="rgb24")
            frame.pts = k
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path
