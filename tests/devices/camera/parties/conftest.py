"""Other people's programs; a test without one says what to install."""

import shutil

import pytest

from tests.devices.camera.parties.programs import H264, PATTERN, gstreamer_lacks, rtsp_server


@pytest.fixture
def ffmpeg():
    """Debian's ffmpeg with a moving test pattern: `ffmpeg("640x320", 30, *output)` is a command."""
    program = shutil.which("ffmpeg")
    if program is None:
        pytest.skip("no ffmpeg: apt-get install ffmpeg")

    def command(size, fps, *output):
        pattern = f"testsrc2=size={size}:rate={fps}"
        quiet = (program, "-nostdin", "-hide_banner", "-loglevel", "error")
        return (*quiet, *PATTERN, pattern, *H264, "-g", str(fps), *output)

    return command


@pytest.fixture
def gstreamer():
    """GStreamer's RTSP server, or a skip."""
    if lacks := gstreamer_lacks():
        pytest.skip(lacks)
    return rtsp_server
