import io
import json
import shutil
import subprocess
from dataclasses import replace

import av
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.wire.fuzz import OFFSET_V1, OFFSET_V2, OFFSET_V3
from devices.footage import FilmedBy, read_footage
from devices.insta360.files.metadata import (
    FIRMWARE,
    SERIAL,
    Metadata,
    WindowCrop,
    new_metadata,
    read_metadata,
    write_metadata,
)
from devices.insta360.files.offsets import read_offsets
from devices.insta360.files.samples import (
    Exposures,
    GyroSamples,
    read_exposures,
    read_gyro,
    write_exposures,
    write_gyro,
)
from devices.insta360.files.trailer import (
    BINARY,
    EXPOSURE,
    GYRO,
    MAGIC,
    METADATA,
    PROTOBUF,
    THUMBNAIL,
    Record,
    Trailer,
    TrailerError,
    media_size,
    read_trailer,
    read_trailer_of,
    trailer_bytes,
    write_trailer,
)
from devices.insta360.protobuf import bytes_field, message, varint_field
from scenes.cameras import Fisheye, Rig
from scenes.formats.storage.atomic import WriteError
from scenes.pose import Pose

T_NS = np.arange(20, dtype=np.int64) * 1_000_000 + 7_000_000
ACCEL = np.random.default_rng(1).uniform(-40, 40, (20, 3))
GYRO_RAD_S = np.random.default_rng(2).uniform(-20, 20, (20, 3))
METADATA_ALL = new_metadata(
    serial="IXSE42",
    camera_type="Insta360 X4",
    firmware="v1.4.6_build1",
    offset=OFFSET_V1,
    offset_v2=OFFSET_V2,
    offset_v3=OFFSET_V3,
    gyro_ranges=(16, 2000),
    first_frame_us=7_000,
    rolling_shutter_s=0.0162,
)


def whole_trailer():
    samples = GyroSamples(T_NS, ACCEL, GYRO_RAD_S)
    exposures = Exposures(T_NS, np.linspace(0.001, 0.02, 20))
    return Trailer(
        (
            Record(0x1B, BINARY, b"nobody knows"),
            Record(THUMBNAIL, BINARY, b"\xff\xd8\xff\xd9"),
            Record(EXPOSURE, BINARY, write_exposures(exposures, METADATA_ALL)),
            Record(GYRO, BINARY, write_gyro(samples, METADATA_ALL)),
            Record(METADATA, PROTOBUF, write_metadata(METADATA_ALL)),
        )
    )


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    """A short MP4 as any program writes it."""
    path = tmp_path_factory.mktemp("video") / "plain.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 128, 64, "yuv420p"
        for seq in range(5):
            picture = np.full((64, 128, 3), 40 * seq, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return path


def test_a_written_file_is_the_video_and_then_the_trailer(video, tmp_path):
    target = tmp_path / "VID_00_001.insv"
    size = write_trailer(video, target, whole_trailer())
    written = target.read_bytes()
    assert size == len(written)
    assert written == video.read_bytes() + trailer_bytes(whole_trailer())
    assert written.endswith(MAGIC)
    assert read_trailer(target) == whole_trailer()
    with av.open(str(target)) as container:
        assert sum(1 for _frame in container.decode(video=0)) == 5


def test_a_trailer_is_exchanged_and_the_video_stays(video, tmp_path):
    target = tmp_path / "a.insv"
    write_trailer(video, target, whole_trailer())
    changed = whole_trailer().with_record(THUMBNAIL, BINARY, b"another")
    write_trailer(target, target, changed)
    assert target.read_bytes() == video.read_bytes() + trailer_bytes(changed)
    with target.open("rb") as file:
        assert media_size(file) == video.stat().st_size


@pytest.mark.skipif(
    shutil.which("exiftool") is None, reason="exiftool is not installed (libimage-exiftool-perl)"
)
def test_exiftool_reads_what_we_wrote(video, tmp_path):
    """In a box of its own, as newer firmware does; a bare one looks like a broken box to it."""
    target = tmp_path / "VID_00_001.insv"
    write_trailer(video, target, replace(whole_trailer(), boxed=True))
    done = subprocess.run(
        ["exiftool", "-json", "-ee", "-G3", "-n", str(target)],
        capture_output=True,
        text=True,
        check=True,
    )
    (said,) = json.loads(done.stdout)
    assert not [key for key in said if key.endswith((":Warning", ":Error"))]
    plain = {key.split(":")[-1]: value for key, value in said.items() if key.startswith("Main:")}
    assert plain["SerialNumber"] == "IXSE42"
    assert plain["Model"] == "Insta360 X4"
    assert plain["Firmware"] == "v1.4.6_build1"
    assert plain["Parameters"].split() == OFFSET_V1.split("_")
    samples = [key for key in said if key.endswith(":AngularVelocity")]
    assert len(samples) == len(T_NS)
    exposures = [value for key, value in said.items() if key.endswith(":ExposureTime")]
    assert exposures == pytest.approx(np.linspace(0.001, 0.02, 20))
    times = sorted({float(v) for k, v in said.items() if k.endswith(":TimeCode")})
    assert times == pytest.approx(T_NS / 1_000_000, abs=1e-6)


def test_a_picture_takes_a_trailer_too(tmp_path):
    """.insp is a JPEG; the trailer is bare."""
    target = tmp_path / "IMG_00_001.insp"
    (tmp_path / "plain.jpg").write_bytes(
        cv2.imencode(".jpg", np.full((64, 128, 3), 90, np.uint8))[1]
    )
    write_trailer(tmp_path / "plain.jpg", target, whole_trailer())
    assert read_trailer(target) == whole_trailer()
    picture = cv2.imread(str(target))
    assert picture is not None
    assert picture.shape == (64, 128, 3)


def test_the_reader_of_footage_takes_it_for_a_video(video, tmp_path):
    target = tmp_path / "a.insv"
    write_trailer(video, target, whole_trailer())
    lens = Fisheye.from_fov(64, np.radians(200))
    camera = FilmedBy(Rig((lens, lens), (Pose.identity(),) * 2), Pose.identity())
    frames = list(read_footage(target, camera))
    assert [frame.images[1].shape for frame in frames] == [(64, 64, 3)] * 5


def test_metadata_are_read_by_name():
    data = read_metadata(write_metadata(METADATA_ALL))
    assert (data.serial, data.camera_type, data.firmware) == (
        "IXSE42",
        "Insta360 X4",
        "v1.4.6_build1",
    )
    assert data.offset == OFFSET_V3
    assert len(read_offsets(data.offset).lenses) == 2
    assert (data.raw_gyro, data.gyro_ranges, data.first_frame_ns) == (True, (16, 2000), 7_000_000)
    assert data.rolling_shutter_s == pytest.approx(0.0162)
    assert data.window_crop is None
    crop = message(*(varint_field(n, 100 * n) for n in range(1, 7)))
    cropped = data.with_fields(bytes_field(27, crop))
    assert cropped.window_crop == WindowCrop(100, 200, 300, 400, 500, 600)


def test_a_changed_field_leaves_all_others_to_the_byte():
    odd = bytes.fromhex("f8bf01 8100") + write_metadata(METADATA_ALL) + b"\xfa\xff\x03\x02ok"
    changed = read_metadata(odd).with_fields(bytes_field(SERIAL, "NEW"))
    assert write_metadata(changed) == odd.replace(b"\x0a\x06IXSE42", b"\x0a\x03NEW")
    assert changed.with_fields(bytes_field(FIRMWARE, "x")).firmware == "x"


def test_metadata_without_fields_say_nothing():
    none = Metadata()
    assert (none.serial, none.offset, none.raw_gyro, none.first_frame_ns) == ("", "", False, None)
    assert (none.gyro_ranges, none.rolling_shutter_s, none.window_crop) == (None, None, None)


def test_raw_samples_come_back_within_a_step():
    written = write_gyro(GyroSamples(T_NS, ACCEL, GYRO_RAD_S), METADATA_ALL)
    assert len(written) == 20 * len(T_NS)
    read = read_gyro(written, METADATA_ALL)
    assert np.array_equal(read.t_ns, T_NS)
    assert np.abs(read.accel_m_s2 - ACCEL).max() <= 0.5001 * 16 * 9.80665 / 32768
    assert np.abs(read.gyro_rad_s - GYRO_RAD_S).max() <= 0.5001 * np.radians(2000) / 32768


def test_one_g_at_rest_is_standard_gravity():
    """u64 µs, then six whole numbers around 32768, of a full scale of 16 g and 2000 °/s."""
    raw = (5).to_bytes(8, "little") + np.array(
        [32768, 32768, 34816, 32768, 49152, 32768], "<u2"
    ).tobytes()
    read = read_gyro(raw, METADATA_ALL)
    assert read.t_ns.tolist() == [5_000]
    assert read.accel_m_s2[0].tolist() == pytest.approx([0, 0, 9.80665])
    assert read.gyro_rad_s[0].tolist() == pytest.approx([0, np.radians(1000), 0])


def test_samples_of_older_cameras_are_exact_numbers_and_milliseconds():
    old = Metadata()
    written = write_gyro(GyroSamples(T_NS, ACCEL, GYRO_RAD_S), old)
    assert len(written) == 56 * len(T_NS)
    read = read_gyro(written, old)
    assert np.array_equal(read.t_ns, T_NS)
    assert np.allclose(read.accel_m_s2, ACCEL, rtol=1e-15, atol=0)
    assert np.array_equal(read.gyro_rad_s, GYRO_RAD_S)
    exposures = read_exposures(write_exposures(Exposures(T_NS, ACCEL[:, 0]), old), old)
    assert np.array_equal(exposures.t_ns, T_NS)
    assert np.array_equal(exposures.exposure_s, ACCEL[:, 0])


@pytest.mark.parametrize(
    ("data", "metadata", "says"),
    [
        (bytes(19), METADATA_ALL, "gyro record of 19 bytes, wanted a multiple of 20"),
        (bytes(20), Metadata(), "gyro record of 20 bytes, wanted a multiple of 56"),
        (bytes(20), new_metadata(serial="", camera_type="", firmware=""), "lacks their ranges"),
        (b"\xff" * 20, METADATA_ALL, "with a time of 18446744073709551615"),
    ],
)
def test_samples_that_cannot_be_say_why(data, metadata, says):
    with pytest.raises(TrailerError, match=says):
        read_gyro(data, metadata)


records = st.lists(
    st.builds(
        Record,
        st.integers(1, 255),
        st.integers(0, 2),
        st.binary(max_size=60),
        st.binary(max_size=9),
    ),
    max_size=6,
    unique_by=lambda record: record.record_id,
).map(tuple)


@given(records, st.integers(0, 9), st.binary(max_size=20), st.booleans())
def test_trailers_of_both_layouts_come_back_to_the_byte(kept, version, media, boxed):
    plain = Trailer(tuple(replace(r, before=b"") for r in kept), version, boxed=boxed)
    slots = (-1, *(record.record_id for record in kept), -1)
    indexed = Trailer(kept, version, slots, b"gap", boxed, bytes(range(32)))
    for trailer in (plain, indexed):
        file = io.BytesIO(b"mp4 " + media + trailer_bytes(trailer))
        assert read_trailer_of(file) == trailer
        assert media_size(file) == 4 + len(media)


def test_a_new_record_takes_its_place_in_the_index():
    trailer = Trailer((Record(1, 1, b"m"),), slots=(-1, 1, -1))
    once = trailer.with_record(2, 0, b"thumbnail").with_record(9, 0, b"more")
    assert once.slots == (-1, 1, 2, 9)
    assert read_trailer_of(io.BytesIO(trailer_bytes(once))) == once
    assert once.data(9) == b"more"
    assert once.data(8) is None


def test_files_without_a_trailer_have_none(video, tmp_path):
    assert read_trailer(video) is None
    (tmp_path / "empty").write_bytes(b"")
    assert read_trailer(tmp_path / "empty") is None


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        (
            lambda b: b[:-40] + (10**9).to_bytes(4, "little") + b[-36:],
            "trailer of 1000000000 bytes",
        ),
        (lambda b: b[:-40] + (71).to_bytes(4, "little") + b[-36:], "trailer of 71 bytes"),
        (lambda b: b[:-76] + b"\xff\xff\xff\x7f" + b[-72:], "wants 2147483647 bytes"),
        (lambda b: b[:-76] + b"\0\0\0\0" + b[-72:], "wants"),
        (lambda b: b[:4] + b[6:], "trailer of"),
    ],
)
def test_a_damaged_trailer_names_the_file_and_what_is_wrong(tmp_path, changed, says):
    path = tmp_path / "broken.insv"
    path.write_bytes(changed(trailer_bytes(whole_trailer())))
    with pytest.raises(TrailerError, match=f"broken.insv: .*{says}.*copy it from the camera again"):
        read_trailer(path)


def test_an_index_that_lies_is_refused():
    trailer = Trailer((Record(1, 1, b"mmmm"), Record(2, 0, b"tttt")), slots=(1, 2))
    whole = trailer_bytes(trailer)
    first = whole.index(b"tttt") + 4
    for offset, says in ((2, "wanted within 4"), (900, "wanted within 4")):
        bad = whole[: first + 16] + offset.to_bytes(4, "little") + whole[first + 20 :]
        with pytest.raises(TrailerError, match=says):
            read_trailer_of(io.BytesIO(bad))
    twice = whole[: first + 10] + whole[first : first + 10] + whole[first + 20 :]
    with pytest.raises(TrailerError, match="two of one id"):
        read_trailer_of(io.BytesIO(twice))


def test_what_has_no_room_is_not_written(tmp_path, video):
    with pytest.raises(TrailerError, match="index of"):
        trailer_bytes(Trailer((Record(1, 1, b""),), slots=(2,)))
    with pytest.raises(TrailerError, match="no room"):
        trailer_bytes(Trailer((Record(300, 1, b""),)))
    with pytest.raises(WriteError, match="make the folder"):
        write_trailer(video, tmp_path / "no folder" / "a.insv", Trailer())
    assert list(tmp_path.iterdir()) == []
