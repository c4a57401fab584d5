import pytest

from devices.camera.address import AddressError, AddressKind, parse_address


@pytest.mark.parametrize(
    ("text", "kind", "host", "port", "path"),
    [
        ("rtmp://:1935/live/room", AddressKind.RTMP_LISTEN, "", 1935, "live/room"),
        ("rtmp://:0", AddressKind.RTMP_LISTEN, "", 0, ""),
        ("rtmp://127.0.0.1/live", AddressKind.RTMP_LISTEN, "127.0.0.1", 1935, "live"),
        ("rtsp://cam.local/stream", AddressKind.RTSP, "cam.local", 554, "/stream"),
        ("rtsp+udp://cam:8554/a", AddressKind.RTSP, "cam", 8554, "/a"),
        ("udp://:5000", AddressKind.UDP, "", 5000, ""),
        ("https://host/a/b.m3u8?x=1", AddressKind.HLS, "host", 0, "/a/b.m3u8"),
        ("v4l2:/dev/video0", AddressKind.V4L2, "", 0, "/dev/video0"),
        ("walk.MP4", AddressKind.FILE, "", 0, "walk.MP4"),
        ("VID_00_1.insv", AddressKind.FILE, "", 0, "VID_00_1.insv"),
        ("file:///tmp/a.mov", AddressKind.FILE, "", 0, "/tmp/a.mov"),
        ("insta360://192.168.42.1", AddressKind.INSTA360, "192.168.42.1", 6666, ""),
    ],
)
def test_every_kind_of_address_is_parsed(text, kind, host, port, path):
    address = parse_address(text)
    assert (address.kind, address.host, address.port, address.path) == (kind, host, port, path)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "room.jpg",
        "ftp://host/a.mp4",
        "udp://host",
        "rtsp:///x",
        "http://host/index.html",
        "v4l2:video0",
        "rtmp://host:99999/a",
        "rtsp://a\nb/c",
        "insta360://192.168.42.1?http=99999",
        "insta360://192.168.42.1?port=80",
    ],
)
def test_what_names_no_camera_is_refused_with_what_it_could_be(text):
    with pytest.raises(AddressError, match=r"camera address"):
        parse_address(text)


def test_rtsp_over_udp_is_asked_for_by_the_scheme():
    address = parse_address("rtsp+udp://cam/a")
    assert address.udp_transport
    assert address.text == "rtsp://cam/a"


def test_an_insta360_answers_over_http_beside_its_pictures():
    assert parse_address("insta360://192.168.42.1").http_port == 80
    assert parse_address("insta360://192.168.42.1:6667?http=8080").http_port == 8080
    assert parse_address("rtsp://cam/a").http_port == 0


def test_a_password_is_not_shown():
    address = parse_address("rtsp://me:secret@cam/a@b")
    assert address.shown == "rtsp://cam/a@b"
    assert "secret" in address.text
