"""Files with a track a lens, pairs of files, and what cannot be opened."""

import errno

import av
import numpy as np
import pytest

from devices.camera.address import parse_address
from devices.camera.container_units import DEVICE_ADVICE, ContainerUnits
from devices.camera.received import CameraState
from devices.camera.receiver import CameraReceiver
from devices.camera.units import SourceError
from devices.clock import WallClock
from devices.insta360.files.metadata import new_metadata, write_metadata
from devices.insta360.files.trailer import METADATA, PROTOBUF, Record, Trailer, write_trailer
from tests.pushed_camera import draw_number, read_number

SIZE = (160, 160)
PICTURES = 12


def write_video(path, tracks, first=0):
    """H.264 with `tracks` picture tracks; each track's picture has its number and its track's."""
    with av.open(str(path), "w", format="mp4") as container:
        streams = []
        for _ in range(tracks):
            stream = container.add_stream("libx264", rate=30)
            stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
            stream.options = {"tune": "zerolatency", "crf": "20"}
            streams.append(stream)
        for number in range(PICTURES):
            for track, stream in enumerate(streams):
                picture = np.full((SIZE[1], SIZE[0], 3), 90, np.uint8)
                draw_number(picture, number + 1000 * (first + track))
                frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                container.mux(stream.encode(frame))
        for stream in streams:
            container.mux(stream.encode())


def write_insv(folder, name, tracks, first=0):
    video = folder / "plain.mp4"
    write_video(video, tracks, first)
    metadata = new_metadata(serial="IXSE42", camera_type="Insta360 X4", firmware="v1.4.6")
    record = Record(METADATA, PROTOBUF, write_metadata(metadata))
    write_trailer(video, folder / name, Trailer((record,), boxed=True))
    video.unlink()
    return folder / name


def received_numbers(path):
    receiver = CameraReceiver(parse_address(str(path)), WallClock())
    seen = []
    while (picture := receiver.latest.take(10.0)) is not None:
        seen.append(tuple(read_number(lens.y) for lens in picture.pictures))
    status = receiver.status()
    receiver.close()
    assert status.state is CameraState.ENDED, status.reason
    assert status.damaged == 0
    assert status.pictures == PICTURES
    return seen


def test_two_tracks_of_an_insv_are_one_picture_a_lens(tmp_path):
    seen = received_numbers(write_insv(tmp_path, "VID_20260101_000000_00_001.insv", 2))
    assert all(pair == (pair[0], pair[0] + 1000) for pair in seen)
    assert seen[-1] == (PICTURES - 1, PICTURES - 1 + 1000)


def test_two_files_of_a_pair_are_one_picture_a_lens(tmp_path):
    front = write_insv(tmp_path, "VID_20260101_000000_00_001.insv", 1)
    write_insv(tmp_path, "VID_20260101_000000_10_001.insv", 1, first=1)
    seen = received_numbers(front)
    assert all(pair == (pair[0], pair[0] + 1000) for pair in seen)
    assert seen[-1] == (PICTURES - 1, PICTURES - 1 + 1000)


def test_a_file_of_a_pair_alone_is_one_lens(tmp_path):
    units = ContainerUnits(parse_address(str(write_insv(tmp_path, "VID_1_00_001.insv", 1))))
    assert units.tracks == 1
    assert sum(1 for _unit in units) == PICTURES
    units.close()


def test_a_file_that_is_none_says_so(tmp_path):
    broken = tmp_path / "a.mp4"
    broken.write_bytes(bytes(1000))
    for path in (broken, tmp_path / "missing.mp4"):
        with pytest.raises(SourceError, match="cannot be opened") as raised:
            ContainerUnits(parse_address(str(path)))
        assert raised.value.is_final


@pytest.mark.parametrize(
    ("code", "match", "is_final"),
    [
        (errno.EBUSY, "another program uses the camera: close it", False),
        (errno.ENODEV, "plug it in again", False),
        (errno.EACCES, "group video", True),
        (errno.EINVAL, "v4l2-ctl --list-formats-ext", True),
        (errno.EIO, "v4l2-ctl --list-devices", False),
    ],
)
def test_a_device_that_does_not_open_says_what_to_do(monkeypatch, code, match, is_final):
    asked = {}

    def refuse(name, **options):
        asked.update(options, name=name)
        raise av.error.OSError(code, "the driver's words", name)

    monkeypatch.setattr(av, "open", refuse)
    with pytest.raises(SourceError, match=match) as raised:
        ContainerUnits(parse_address("v4l2:/dev/video0?size=2880x1440&fps=30&format=mjpeg"))
    assert raised.value.is_final == is_final
    assert asked["name"] == "/dev/video0"
    assert asked["format"] == "video4linux2"
    wanted = {"video_size": "2880x1440", "framerate": "30", "input_format": "mjpeg"}
    assert wanted.items() <= asked["options"].items()


def test_every_advice_says_what_to_do():
    assert all(":" in advice for advice in DEVICE_ADVICE.values())
