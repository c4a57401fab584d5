"""Doors of a session: opened, opened anew, closed, over."""

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
