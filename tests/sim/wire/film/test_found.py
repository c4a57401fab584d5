from fractions import Fraction

import av
import numpy as np
import pytest

from devices.messages import EncodedFrame
from devices.recording import Recorder
from devices.recording_codec import RecordedTruth
from devices.session_info import SessionInfo
from devices.video import H264Decoder, H264Encoder
from scenes.pose import Pose
from sim.camera.camera360 import default_rig
from sim.wire.film.film_file import read_film
from sim.wire.film.found import film_recording, film_video
from tests.pushed_camera import numbered_pictures, read_number

SIZE = (320, 160)


def packets(count=12):
    encoder = H264Encoder(*SIZE, 10, 1_000_000, keyframe_interval=5)
    for k, picture in enumerate(numbered_pictures(SIZE, 10, count=count)):
        yield encoder.encode(picture.rgb, k, picture.t_ns)[0]


def written(path, *, truth):
    info = SessionInfo("lab", "", 1, "", "", "exact", ("none",), {}, default_rig(160), 10)
    with Recorder(path, info) as recorder:
        for packet in packets():
            recorder.write(packet)
            if truth(packet.seq):
                pose = Pose(np.eye(3), np.array([packet.seq, 0.0, 0.0]))
                recorder.write(
                    RecordedTruth(
                        packet.seq,
                        packet.t_ns,
                        {"chair": pose},
                        {"chair": 1.0},
                        frozenset(),
                        pose,
                    )
                )
    return path


def numbers(film):
    decoder = H264Decoder()
    for number in range(len(film)):
        unit = film.unit(number)
        rgb = decoder.decode(EncodedFrame("film", number, unit.t_ns, unit.data, unit.keyframe))
        yield read_number(rgb[..., 1])


def test_a_recording_is_sent_as_it_was_recorded_with_its_truth(tmp_path):
    recording = written(tmp_path / "session.mcap", truth=lambda _seq: True)
    folder = tmp_path / "film"
    folder.mkdir()
    film_recording(folder, recording)
    film = read_film(folder)
    assert [film.unit(k).data for k in range(12)] == [packet.data for packet in packets()]
    assert (film.form.width_px, film.form.height_px, film.duration_ns) == (320, 160, 1_200_000_000)
    assert film.truth_of(7).world_from_object["chair"].translation[0] == 7


def test_truth_that_is_not_there_for_every_picture_is_none(tmp_path):
    recording = written(tmp_path / "session.mcap", truth=lambda seq: seq != 4)
    film_recording(tmp_path, recording)
    assert read_film(tmp_path).truth == ()


def video(path, codec, options=None):
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=10, options=options or {})
        stream.width, stream.height = SIZE
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        stream.time_base = Fraction(1, 10)
        for k, picture in enumerate(numbered_pictures(SIZE, 10, count=12)):
            frame = av.VideoFrame.from_ndarray(picture.rgb, format="rgb24")
            frame.pts = k
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


@pytest.mark.parametrize(
    ("codec", "options"),
    [("libx264", {"bf": "0"}), ("libx264", {"bf": "2"}), ("mjpeg", {})],
    ids=["as it is", "with B-frames", "another codec"],
)
def test_any_video_becomes_a_film(codec, options, tmp_path):
    film_video(tmp_path, video(tmp_path / "room.mp4", codec, options))
    film = read_film(tmp_path)
    assert list(numbers(film)) == list(range(12))
    assert film.form.layout == "unknown"
    assert film.form.fps == pytest.approx(10)
    assert film.time_ns(12) == pytest.approx(1.2e9)


def test_a_file_that_is_no_video_is_refused(tmp_path):
    bad = tmp_path / "bad.mp4"
    bad.write_bytes(b"nothing")
    with pytest.raises(ValueError, match=r"bad\.mp4"):
        film_video(tmp_path, bad)
