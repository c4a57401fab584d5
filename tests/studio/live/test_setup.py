"""Files of devices: what they say is what a session gets, and every mistake is named."""

from __future__ import annotations

import pytest

from devices.camera.address import AddressKind
from devices.camera.lenses.layout import Arrangement, LensLayout
from studio.live.setup import (
    LiveSetup,
    Place,
    SetupError,
    parse_layout,
    read_setup,
    setup_text,
)


def written(tmp_path, text):
    path = tmp_path / "devices.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_whole_file(tmp_path):
    setup = read_setup(
        written(
            tmp_path,
            """
            [camera]
            address = "rtmp://:1935/live/room"
            layout = "side_by_side 90 270"
            lens_size_px = 960
            lenses = "x4.json"
            lens_distance_m = 0.028
            place = "scan"
            calibration = "off"
            """,
        )
    )
    assert setup.camera.kind is AddressKind.RTMP_LISTEN
    assert setup.layout == LensLayout(Arrangement.SIDE_BY_SIDE, (1, 3))
    assert setup.lens_size_px == 960
    assert setup.camera_file == tmp_path / "x4.json"
    assert setup.lens_distance_m == 0.028
    assert setup.place is Place.SCAN
    assert not setup.calibrates


def test_only_an_address_is_needed(tmp_path):
    setup = read_setup(written(tmp_path, '[camera]\naddress = "insta360://192.168.42.1"'))
    assert setup == LiveSetup(setup.camera)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("[camera]", "camera.address is missing"),
        ('[camera]\naddress = "ftp://x"', "ftp"),
        ('[camera]\naddress = "rtmp://:1"\nlayuot = "auto"', "camera.layuot"),
        ('[camera]\naddress = "rtmp://:1"\nlayout = "sideways"', "camera.layout = 'sideways'"),
        ('[camera]\naddress = "rtmp://:1"\nlayout = "stacked 45 0"', "stacked 45 0"),
        ('[camera]\naddress = "rtmp://:1"\nlens_size_px = 63', "camera.lens_size_px = 63"),
        ('[camera]\naddress = "rtmp://:1"\nplace = "there"', "camera.place = 'there'"),
        ("[camera", "no TOML"),
    ],
)
def test_mistakes_are_named_with_the_file(tmp_path, text, named):
    path = written(tmp_path, text)
    with pytest.raises(SetupError) as caught:
        read_setup(path)
    assert named in str(caught.value)
    if "ftp" not in text:
        assert str(path) in str(caught.value)


def test_layouts_in_words():
    assert parse_layout("auto") is None
    assert parse_layout("stacked") == LensLayout(Arrangement.STACKED, (0, 0))
    assert parse_layout("equirectangular -90") == LensLayout(Arrangement.EQUIRECTANGULAR, (3,))
    for wrong in ("", "stacked 0", "side_by_side 0 0 0", "one_lens x"):
        with pytest.raises(ValueError, match="wanted auto"):
            parse_layout(wrong)


@pytest.mark.parametrize(
    "text",
    [
        'address = "rtmp://:1935/live/room"',
        'address = "rtsp+udp://me:pass%22word@10.0.0.2/x"\nlayout = "stacked 90 270"',
        'address = "v4l2:/dev/video0?size=2880x1440"\nplace = "scan"\ncalibration = "off"',
        'address = "udp://:5000"\nlens_size_px = 960\nlens_distance_m = 0.028\nlenses = "x.json"',
    ],
)
def test_what_is_written_is_read_again(tmp_path, text):
    setup = read_setup(written(tmp_path, f"[camera]\n{text}\n"))
    assert read_setup(written(tmp_path, setup_text(setup))) == setup
