"""Hostile visitors of a session's ports: what breaks is counted, and friendly people are served."""

import socket
import threading

import pytest

from devices.camera.address import parse_address
from devices.camera.rtmp.listener import RtmpListener
from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.roles import Role
from devices.hub.server import Hub
from scenes.workers.task import Task
from studio.live.hololens.simulated.attacking import (
    Defects,
    attack_session,
    is_camera_greeted,
    is_page_served,
)


@pytest.fixture
def hub():
    hub = Hub(HubSettings(), {"/": Asset(b"<p>", "text/html")}, clock=WallClock())
    hub.start()
    yield hub
    hub.close()


@pytest.fixture
def camera_port():
    """The port of a session that waits for a camera, and takes what comes there."""
    listener = RtmpListener(parse_address("rtmp://127.0.0.1:0/live/room"), WallClock())
    stop = threading.Event()
    task = Task("camera", lambda _task: [None for _ in listener.units(stop)]).start()
    yield listener.port
    stop.set()
    task.join(120)
    listener.close()


def attacked(hub, camera_port, visits):
    """Messages of an attack from its beginning to its end."""
    said, code = [], hub.invite(Role.SPECTATOR).code

    def attack(task):
        ways = {"hub_url": hub.url, "code": code, "camera_port": camera_port}
        attack_session(task, **ways, visits=visits, say=said.append)

    Task("attack", attack).start().outcome()
    return said


def test_both_ports_are_visited_and_serve_friendly_people_afterwards(hub, camera_port):
    with Defects() as defects:
        said = attacked(hub, camera_port, 30)
    assert [each["streams"] for each in said] == [75, 90]
    assert (said[-1]["unserved"], defects.count) == (0, 0)
    refused = hub.counts().refused
    assert refused["message"] > 0, "the spectator got in, and what they sent was read"
    assert refused["op"] > 0, "a spectator may do nothing"
    assert not hub.take().lines
    assert is_page_served(("127.0.0.1", hub.port))


def test_a_port_that_nobody_serves_any_more_is_counted(hub):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    assert attacked(hub, port, 1)[-1]["unserved"] == 1
    assert not is_camera_greeted(("127.0.0.1", port))


def test_errors_of_threads_and_of_the_hub_are_counted(monkeypatch):
    said, lines = [], []
    monkeypatch.setattr(threading, "excepthook", said.append)

    def fail(_task):
        raise ZeroDivisionError

    with Defects(lines.append) as defects:
        Task("expected", fail, expected=ZeroDivisionError).start().join()
        assert defects.count == 0
        Task("broken", fail).start().join()
        defects.hear("people: defect in the hub: KeyError")
        defects.hear("people: the hub listens")
    assert defects.count == 2
    assert lines == ["people: defect in the hub: KeyError"], "somebody at the session reads it"
    assert [args.exc_type for args in said] == [ZeroDivisionError], "others hear of it as before"
