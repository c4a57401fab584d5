"""Other people's programs that send to the studio, and what receives them."""

import contextlib
import functools
import http.server
import socket
import subprocess
import threading
import time
from pathlib import Path

from devices.camera.address import parse_address
from devices.camera.receiver import CameraReceiver
from devices.clock import WallClock

SERVER = Path(__file__).with_name("rtsp_server.py")
SYSTEM_PYTHON = "/usr/bin/python3"
GST_PACKAGES = (
    "python3-gi gir1.2-gst-rtsp-server-1.0 gstreamer1.0-plugins-base "
    "gstreamer1.0-plugins-good gstreamer1.0-plugins-ugly"
)
PATTERN = ("-re", "-f", "lavfi", "-i")
H264 = ("-c:v", "libx264", "-preset", "ultrafast", "-tune", "zerolatency", "-threads", "1")


def wait_for(truth, seconds=120.0):
    end = time.monotonic() + seconds
    while not truth():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


def free_port(kind=socket.SOCK_STREAM):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@functools.cache
def gstreamer_lacks():
    """Why GStreamer's RTSP server cannot run here; empty if it can."""
    wanted = (
        "import gi; gi.require_version('Gst', '1.0'); gi.require_version('GstRtspServer', '1.0')\n"
        "from gi.repository import Gst, GstRtspServer\n"
        "Gst.init(None)\n"
        "assert all(map(Gst.ElementFactory.find, ('x264enc', 'rtph264pay', 'videotestsrc')))"
    )
    if not Path(SYSTEM_PYTHON).exists():
        return f"no {SYSTEM_PYTHON}"
    done = subprocess.run([SYSTEM_PYTHON, "-c", wanted], capture_output=True, check=False)
    return (
        "" if done.returncode == 0 else f"GStreamer's RTSP server: apt-get install {GST_PACKAGES}"
    )


@contextlib.contextmanager
def running(*command):
    """A program that is ended with the block."""
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@contextlib.contextmanager
def rtsp_server(width, height, fps, port=0):
    """GStreamer's server; yields its port."""
    process = subprocess.Popen(
        [SYSTEM_PYTHON, str(SERVER), str(width), str(height), str(fps), str(port)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield int(process.stdout.readline())
    finally:
        process.kill()
        process.communicate()


@contextlib.contextmanager
def http_server(folder):
    """Serves a folder on loopback; yields the port."""
    handler = functools.partial(_Quiet, directory=str(folder))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server.server_address[1]
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_words):
        pass


@contextlib.contextmanager
def receiving(text):
    """A receiver of an address."""
    receiver = CameraReceiver(parse_address(text), WallClock())
    try:
        yield receiver
    finally:
        receiver.close()
