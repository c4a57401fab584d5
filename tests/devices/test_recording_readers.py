"""A recording is read by other people's readers: Foxglove's library and Rerun's program."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest
from mcap.reader import make_reader

from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.lenses.lens_pictures import assumed_rig
from devices.messages import Event
from devices.recording import Recorder
from devices.recording_codec import FrameStamp
from devices.session_info import LiveStream, SessionInfo
from devices.video import H264Encoder
from scenes.pose import Pose

PICTURES = 12
RERUN = shutil.which("rerun", path=str(Path(sys.executable).parent)) or shutil.which("rerun")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A live session's recording: every packet, a stamp for every third picture, an event."""
    layout = LensLayout(Arrangement.SIDE_BY_SIDE, (0, 0))
    rig = assumed_rig(layout, 64)
    info = SessionInfo(
        "tiny", "", None, "", "", "live", ("own",), {}, rig, 30.0, stream=LiveStream(layout, 64)
    )
    path = tmp_path_factory.mktemp("readers") / "live.mcap"
    encoder = H264Encoder(128, 64, 30.0, 400_000)
    with Recorder(path, info) as recorder:
        for k in range(PICTURES):
            t_ns = (k + 1) * 33_000_000
            picture = np.full((64, 128, 3), 15 * k, np.uint8)
            recorder.write(encoder.encode(picture, k, t_ns)[0])
            if k % 3 == 0:
                recorder.write(FrameStamp("camera-360", k, t_ns, t_ns, Pose.identity()))
        recorder.write(Event(t_ns, "session", "live", "the session is live"))
    return path


def test_foxglove_s_reader_finds_pictures_that_decode(recording):
    decoder = av.CodecContext.create("h264", "r")
    levels = []
    with recording.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for schema, channel, message in reader.iter_messages(topics=["/camera-360/video"]):
            assert schema.name == "foxglove.CompressedVideo"
            assert channel.message_encoding == "json"
            fields = json.loads(message.data)
            assert fields["format"] == "h264"
            stamp = fields["timestamp"]
            assert stamp["sec"] * 10**9 + stamp["nsec"] == message.log_time
            for frame in decoder.decode(av.Packet(base64.b64decode(fields["data"]))):
                levels.append(float(frame.to_ndarray(format="gray").mean()))
        statistics = reader.get_summary().statistics
    levels += [float(f.to_ndarray(format="gray").mean()) for f in decoder.decode(None)]
    assert len(levels) == PICTURES
    assert levels == sorted(levels)
    assert statistics.message_count == PICTURES + PICTURES // 3 + 1


@pytest.mark.skipif(RERUN is None, reason="no rerun program: pip install rerun-sdk")
def test_rerun_s_program_checks_and_converts_it(recording, tmp_path):
    said = subprocess.run(
        [RERUN, "mcap", "check", str(recording)],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    ).stdout
    lines = [line.split() for line in said.splitlines() if "/camera-360" in line or "/ev" in line]
    assert {(line[0], line[3]) for line in lines} == {
        ("ok", "/camera-360/video"),
        ("ok", "/camera-360/frame"),
        ("ok", "/events"),
    }
    converted = tmp_path / "live.rrd"
    subprocess.run(
        [RERUN, "mcap", "convert", str(recording), "-o", str(converted)],
        capture_output=True,
        timeout=120,
        check=True,
    )
    assert converted.stat().st_size > recording.stat().st_size // 4
