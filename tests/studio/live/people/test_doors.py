"""Doors of a session: opened, opened anew, closed, over."""

import socket
import urllib.request

import pytest

from devices.clock import WallClock
from devices.hub.roles import Role
from scenes.state import SceneState
from studio.live.people.doors import Doors
from studio.live.people.hosting import Hosting


@pytest.fixture
def doors(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path))
    said = []
    made = Doors(tiny.scene, clock=WallClock(), say=said.append)
    made.said = said
    yield made
    made.end()


def test_nobody_comes_through_closed_doors(doors):
    assert doors.hub is None
    assert doors.hosting is None
    doors.publish(SceneState())
    assert doors.take().avatars == ()


def test_they_open_close_and_open_again(doors):
    hub = doors.open(Hosting())
    assert doors.hub is hub
    assert hub.url.startswith("http://127.0.0.1:")
    assert doors.open(Hosting()) is hub, "open already"
    with urllib.request.urlopen(hub.url, timeout=5) as page:
        assert page.status == 200
    assert hub.invite(Role.REMOTE).url.startswith(hub.url)
    doors.publish(SceneState())
    doors.close()
    assert doors.hub is None
    with pytest.raises(OSError, match=r"refused|reset"):
        urllib.request.urlopen(hub.url, timeout=5)
    assert doors.open(Hosting()) is not hub


def test_a_session_that_is_over_stays_closed(doors):
    doors.open(Hosting())
    doors.end()
    with pytest.raises(ValueError, match="session is over"):
        doors.open(Hosting())


def test_they_open_again_at_the_same_port(doors):
    port = doors.open(Hosting()).port
    doors.close()
    assert doors.open(Hosting()).port == port
    wider = doors.open(Hosting(is_open=True))
    assert wider.port == port
    assert wider.url.startswith("https://")
    assert wider.url.endswith(f":{port}/")


def test_a_port_that_somebody_has_taken_is_given_up_and_that_is_said(doors):
    port = doors.open(Hosting()).port
    doors.close()
    with socket.create_server(("127.0.0.1", port)):
        assert doors.open(Hosting()).port != port
        with pytest.raises(OSError, match=r"."):
            doors.open(Hosting(port=port))
    assert any(f"port {port} is taken" in line for line in doors.said)
