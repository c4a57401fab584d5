"""The process that reads a camera may hang, crash or lie: the studio sees an error, and goes on."""

import gc
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from devices.camera.address import parse_address
from devices.camera.received import CameraState
from devices.camera.receiver import CameraReceiver
from devices.camera.sources.pull_source import PATIENCE, Patience, PullSource
from devices.camera.units import Idle, SourceError, Unit
from devices.clock import WallClock

ROOT = Path(__file__).resolve().parents[4]
ADDRESS = parse_address("rtsp://user:secret@127.0.0.1:1/x")
QUICK = Patience(open_s=0.5, read_s=0.3)
OPENS = Patience(open_s=120.0, read_s=0.3)
"""For a program that opens its stream, or ends: starting it may take a busy machine seconds."""


LINE = "import os,socket,sys,time,struct,signal;line=socket.socket(fileno=0);line.recv(4096);"
OPENED = "line.sendall(struct.pack('<BI',1,0));"
UNIT = (
    "line.sendall(struct.pack('<BIII',2,14,0,0)+b'h264\\n\\n');"
    "line.sendall(struct.pack('<BIBBq',3,11,1,0,5)+b'x');"
)


def source(program, patience=QUICK):
    return PullSource(
        ADDRESS,
        WallClock(),
        command=(sys.executable, "-S", "-c", LINE + program),
        patience=patience,
    )


def children():
    listed = Path(f"/proc/self/task/{threading.get_native_id()}/children")
    return listed.read_text(encoding="ascii").split()


def open_files():
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.fixture(autouse=True)
def nothing_is_left():
    gc.collect()  # files of earlier tests would otherwise be closed meanwhile, and counted
    files, processes = open_files(), children()
    yield
    assert open_files() == files
    assert children() == processes


@pytest.mark.parametrize(
    ("program", "match", "patience"),
    [
        ("time.sleep(60)", r"no stream within 0.5 s; is the camera on", QUICK),
        (OPENED + "time.sleep(60)", r"no picture within 0.3 s", OPENS),
        (OPENED + UNIT + "time.sleep(60)", r"no picture within 0.3 s", OPENS),
        ("os.kill(os.getpid(), signal.SIGSEGV)", r"ended by signal 11; the stream is", OPENS),
        ("sys.exit(3)", r"ended with status 3", OPENS),
        ("line.sendall(b'garbage' * 9)", r"message 103: not known|at most", OPENS),
        ("line.sendall(struct.pack('<BI',3,1<<31))", r"of 2147483648 bytes, at most", OPENS),
        ("line.close();time.sleep(60)", r"fell silent", OPENS),
    ],
)
def test_whatever_it_does_is_an_error_without_the_password(program, match, patience):
    with pytest.raises(SourceError, match=match) as raised:
        list(source(program, patience).units(threading.Event()))
    assert "secret" not in str(raised.value)
    assert "127.0.0.1:1/x" in str(raised.value)
    assert not raised.value.is_final


def test_units_arrive_with_what_they_are():
    units = source(OPENED + UNIT + "time.sleep(60)", OPENS).units(threading.Event())
    unit = next(unit for unit in units if isinstance(unit, Unit))
    units.close()
    assert (unit.format.codec, unit.data, unit.keyframe, unit.pts_ns) == ("h264", b"x", True, 5)


@pytest.mark.parametrize("program", ["time.sleep(60)", OPENED + UNIT + "time.sleep(60)"])
def test_a_stop_ends_it_soon_and_idle_is_said_meanwhile(program):
    stop = threading.Event()
    units = source(program, Patience(60, 60)).units(stop)
    assert any(isinstance(next(units), Idle) for _ in range(3))
    began = time.monotonic()
    stop.set()
    list(units)
    assert time.monotonic() - began < 2.0


def test_a_failure_is_said_while_it_is_tried_again():
    failing = source("time.sleep(60)", Patience(0.2, 0.2))
    with pytest.raises(SourceError):
        list(failing.units(threading.Event()))
    again = failing.units(threading.Event())
    idle = next(again)
    again.close()
    assert "no stream within 0.2 s" in idle.text
    assert idle.text.endswith("trying again")


def test_every_kind_that_is_pulled_has_a_patience():
    for text in ("rtsp://h/x", "udp://:5000", "https://h/x.m3u8", "v4l2:/dev/video0"):
        assert parse_address(text).kind in PATIENCE


@pytest.mark.skipif(sys.platform != "linux", reason="V4L2 is Linux's")
@pytest.mark.parametrize(
    ("device", "state", "match"),
    [
        ("/dev/null", CameraState.FAILED, "this is no camera"),
        ("/dev/video99", CameraState.WAITING, "no such device: plug the camera in"),
    ],
)
def test_what_is_no_camera_says_what_to_do(device, state, match):
    receiver = CameraReceiver(parse_address(f"v4l2:{device}"), WallClock())
    end = time.monotonic() + 120
    while match not in receiver.status().reason and time.monotonic() < end:
        time.sleep(0.02)
    status = receiver.status()
    receiver.close()
    assert match in status.reason
    assert status.state is state


def test_the_process_ends_with_a_studio_that_is_killed():
    """It waits for a UDP stream that never comes, inside FFmpeg."""
    studio = subprocess.Popen(
        [
            sys.executable,
            "-c",
            f"import sys,threading; sys.path.insert(0,{str(ROOT)!r})\n"
            "from devices.camera.address import parse_address\n"
            "from devices.camera.sources.pull_source import PullSource\n"
            "from devices.clock import WallClock\n"
            "units=PullSource(parse_address(sys.argv[1]),WallClock()).units(threading.Event())\n"
            "[next(units) for _ in range(8)]\n"
            "print(open('/proc/self/task/%d/children'%threading.get_native_id()).read(),flush=1)\n"
            "list(units)",
            f"udp://127.0.0.1:{free_udp_port()}",
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    reader = int(studio.stdout.readline())
    assert Path(f"/proc/{reader}").exists()
    studio.kill()
    studio.wait()
    studio.stdout.close()
    end = time.monotonic() + 120
    while is_running(reader) and time.monotonic() < end:
        time.sleep(0.02)
    assert not is_running(reader)


def free_udp_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def is_running(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
