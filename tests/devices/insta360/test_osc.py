import http.client
import json
import socket
import threading

import pytest

from devices.clock import ManualClock
from devices.insta360.errors import (
    CameraProtocolError,
    CameraRefusedError,
    CameraTimeoutError,
    CameraUnreachableError,
)
from devices.insta360.osc import OscClient
from devices.insta360.osc_replies import MAX_BODY_BYTES
from sim.wire.osc_camera import OscCamera
from sim.wire.osc_server import OscFaults, OscServer
from tests.devices.insta360.conftest import INFO


@pytest.fixture
def clock():
    """Sleeping moves it: polling takes no time."""
    return ManualClock()


@pytest.fixture
def camera(clock):
    server = OscServer(OscCamera(clock, INFO, picture=b"\xff\xd8picture", picture_s=3.5))
    yield server
    server.close()


@pytest.fixture
def client(camera, clock):
    return OscClient(*camera.address, clock=clock)


@pytest.fixture
def saying():
    """An HTTP server that says given bytes to whoever connects, and stays connected."""
    listener = socket.create_server(("127.0.0.1", 0))
    kept = []

    def serve(said):
        def run():
            connection, _from = listener.accept()
            kept.append(connection)
            connection.settimeout(5)
            try:
                connection.recv(65536)
                connection.sendall(said)
            except OSError:
                return

        threading.Thread(target=run, daemon=True).start()
        return OscClient(*listener.getsockname()[:2], clock=ManualClock(), request_s=1.5)

    yield serve
    listener.close()
    for connection in kept:
        connection.close()


def test_what_it_says_of_itself(client):
    info = client.info()
    assert (info.model, info.serial, info.firmware) == ("Insta360 X4", "IXSE42", "v1.4.6")
    assert "/osc/commands/execute" in info.api
    assert info.api_levels == (2,)
    state = client.state()
    assert (state.battery, state.card) == (0.83, "pass")
    assert state.storage.endswith("/DCIM/Camera01/")


def test_a_picture_is_taken_waited_for_listed_and_fetched(client, camera, clock):
    (url,) = client.take_picture()
    assert clock.now_ns() == 4_000_000_000, "asked once a second, done after 3.5"
    (file,) = client.files("image")
    assert (file.url, file.size_bytes) == (url, 9)
    connection = http.client.HTTPConnection(*camera.address, timeout=5)
    connection.request("GET", url.split(str(camera.address[1]))[1])
    assert connection.getresponse().read() == b"\xff\xd8picture"
    connection.close()


def test_a_recording_starts_and_stops(client):
    client.set_options({"captureMode": "video"})
    assert client.options(["captureMode", "iso"]) == {"captureMode": "video", "iso": 100}
    client.start_capture()
    (url,) = client.stop_capture()
    assert url.endswith(".insv")
    assert [file.name for file in client.files("video")] == [url.rsplit("/", 1)[1]]
    assert client.files("image") == ()


def test_the_camera_s_clock_is_an_option(client, clock):
    clock.sleep_until(42_000_000)
    assert client.options(["_sysTimestamp"]) == {"_sysTimestamp": 42_000}


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda c: c.start_capture(), "camera.startCapture: disabledCommand not in video mode"),
        (lambda c: c.stop_capture(), "disabledCommand not recording"),
        (lambda c: c.options(["nothing"]), "invalidParameterName nothing is not supported"),
        (lambda c: c.set_options({"_sysTimestamp": 1}), "unsupported option _sysTimestamp"),
        (lambda c: c.set_options({"captureMode": "x"}), "invalidParameterValue captureMode"),
        (lambda c: c.execute("camera.getLivePreview"), "unknownCommand camera.getLivePreview"),
        (lambda c: c.files(most=0), "invalidParameterValue fileType or entryCount"),
    ],
)
def test_a_refusal_has_the_camera_s_words(client, camera, ask, words):
    with pytest.raises(CameraRefusedError, match=f"http://127.0.0.1:{camera.address[1]}.*{words}"):
        ask(client)


def test_a_picture_without_a_card_or_in_video_mode_is_refused(camera, client):
    client.set_options({"captureMode": "video"})
    with pytest.raises(CameraRefusedError, match="not working in image mode"):
        client.take_picture()
    client.set_options({"captureMode": "image"})
    camera._camera.has_card = False
    assert client.state().card == "noCard"
    with pytest.raises(CameraRefusedError, match="no card"):
        client.take_picture()


def test_a_picture_that_takes_too_long(client):
    with pytest.raises(CameraTimeoutError, match=r"takePicture is not done after 2 s \(57 %\)"):
        client.take_picture(limit_s=2.0)


def test_without_the_header_the_camera_refuses(camera):
    connection = http.client.HTTPConnection(*camera.address, timeout=5)
    connection.request("POST", "/osc/state", body=b"{}")
    assert connection.getresponse().status == 403
    connection.close()


@pytest.mark.parametrize(
    ("faults", "error", "words"),
    [
        (OscFaults(garbage=True), CameraProtocolError, r"no HTTP reply \(BadStatusLine"),
        (OscFaults(half_open=True), CameraTimeoutError, "no whole reply within 1 s"),
        (OscFaults(delay_s=9.0), CameraTimeoutError, "no whole reply within 1 s"),
    ],
)
def test_faults_of_the_camera_end_in_an_error(camera, clock, faults, error, words):
    camera.faults = faults
    client = OscClient(*camera.address, clock=clock, request_s=1.0)
    with pytest.raises(error, match=words):
        client.info()
    camera.faults = OscFaults()
    assert OscClient(*camera.address, clock=clock).info().serial == "IXSE42"


def reply(body, head=""):
    return f"HTTP/1.1 200 OK\r\nContent-Length: {len(body)}\r\n{head}\r\n".encode() + body


@pytest.mark.parametrize(
    ("said", "error", "words"),
    [
        (reply(b"<html>"), CameraProtocolError, "6 bytes that are no JSON"),
        (reply(b"[" * 99_999), CameraProtocolError, "99999 bytes that are no JSON"),
        (reply(b"[1]"), CameraProtocolError, "JSON of list, wanted an object"),
        (reply(b"{}"), CameraProtocolError, "no Open Spherical Camera"),
        (reply(b'{"model": NaN}'), CameraProtocolError, "NaN is no number"),
        (b"SSH-2.0-OpenSSH\r\n" * 3, CameraProtocolError, "no HTTP reply"),
        (b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", CameraProtocolError, "status 404"),
        (b"HTTP/1.1 200 OK\r\nContent-Length: 999\r\n\r\n{}", CameraTimeoutError, "no whole reply"),
        (b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 200, CameraProtocolError, "more than 100 headers"),
        (b"HTTP/1.1 200 OK\r\nX", CameraTimeoutError, "no whole reply within 1.5 s"),
    ],
)
def test_what_is_no_camera_is_said(saying, said, error, words):
    with pytest.raises(error, match=words):
        saying(said).info()


def test_a_reply_without_end_is_cut(saying):
    endless = b"HTTP/1.1 200 OK\r\n\r\n" + b" " * (MAX_BODY_BYTES + 2)
    with pytest.raises(CameraProtocolError, match="more than 4194304 bytes"):
        saying(endless).state()


def test_nothing_listens(clock):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = listener.getsockname()[:2]
    with pytest.raises(CameraUnreachableError, match="refused; is the camera on"):
        OscClient(*address, clock=clock).info()


def test_what_a_camera_leaves_out_or_says_wrongly_is_empty(saying):
    odd = {
        "name": "camera.listFiles",
        "state": "done",
        "results": {
            "entries": [
                7,
                {"size": 3},
                {"name": "a", "size": "many", "width": -4, "fileUrl": 9},
                {"name": "b", "size": 10**400},
            ]
        },
    }
    first, second = saying(reply(json.dumps(odd).encode())).files()
    assert (first.name, first.url, first.size_bytes, first.width_px) == ("a", "", 0, 0)
    assert (second.name, second.size_bytes) == ("b", 0)


def test_words_of_a_camera_cannot_break_a_message(saying):
    error = {"state": "error", "error": {"code": "x\x1b[2J\n", "message": "y" * 999}}
    with pytest.raises(CameraRefusedError) as raised:
        saying(reply(json.dumps(error).encode())).start_capture()
    assert str(raised.value).isprintable()
    assert len(str(raised.value)) < 400
