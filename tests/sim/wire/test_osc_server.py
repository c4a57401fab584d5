import socket

import pytest

from devices.clock import ManualClock
from devices.insta360.commands import CameraInfo
from devices.insta360.osc import OscClient
from sim.wire.osc_camera import MAX_FILES, OscCamera
from sim.wire.osc_server import MAX_CONNECTIONS, OscServer

INFO = CameraInfo("IXSE42", "Insta360 X4", "v1.4.6", 0.83)


@pytest.fixture
def camera():
    server = OscServer(OscCamera(ManualClock(), INFO))
    yield server
    server.close()


@pytest.fixture
def client(camera):
    return OscClient(*camera.address, clock=ManualClock())


@pytest.mark.parametrize(
    ("head", "status"),
    [
        ("", 411),
        ("Content-Length: -5\r\n", 411),
        ("Content-Length: many\r\n", 411),
        ("Content-Length: 70000\r\n", 413),
        ("Content-Length: 3\r\n", 400),
    ],
)
def test_the_simulated_camera_bounds_requests(camera, head, status):
    with socket.create_connection(camera.address, 5) as connection:
        said = f"POST /osc/state HTTP/1.1\r\nX-XSRF-Protected: 1\r\n{head}\r\n[1]"
        connection.sendall(said.encode())
        connection.shutdown(socket.SHUT_WR)
        assert connection.makefile("rb").readline().split()[1] == str(status).encode()


def test_the_simulated_camera_bounds_connections(camera, client):
    held = [socket.create_connection(camera.address, 5) for _each in range(MAX_CONNECTIONS + 4)]
    for connection in held:
        connection.close()
    assert client.info().serial == "IXSE42"


def test_it_listens_on_loopback_unless_told_otherwise(camera):
    assert camera.address[0] == "127.0.0.1"


def test_the_port_is_free_again_after_closing(camera):
    address = camera.address
    camera.close()
    again = OscServer(OscCamera(ManualClock(), INFO), port=address[1])
    assert again.address == address
    again.close()


def test_the_card_holds_so_many_files_and_the_newest():
    clock = ManualClock()
    camera = OscCamera(clock, INFO, picture_s=0.0)
    for _picture in range(MAX_FILES + 3):
        _status, asked = camera.answer("/osc/commands/execute", {"name": "camera.takePicture"}, "")
        camera.answer("/osc/commands/status", {"id": asked["id"]}, "")
    wanted = {"name": "camera.listFiles", "parameters": {"fileType": "all", "entryCount": 999}}
    results = camera.answer("/osc/commands/execute", wanted, "")[1]["results"]
    assert len(results["entries"]) == MAX_FILES
    assert results["entries"][0]["name"].endswith(f"_{MAX_FILES + 3}.insp")
