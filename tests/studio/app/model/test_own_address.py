"""What a person enters in a camera's app leads to this computer."""

from __future__ import annotations

from studio.app.model.own_address import own_address, reachable


def test_a_listener_on_all_interfaces_gets_an_address():
    text = reachable("rtmp://THIS-COMPUTER:1935/live/room")
    assert text == f"rtmp://{own_address()}:1935/live/room"
    assert own_address()
    assert reachable("rtmp://127.0.0.1:5/live/x") == "rtmp://127.0.0.1:5/live/x"
    waits = reachable("waiting for a camera to push to rtmp://THIS-COMPUTER:1935/a")
    assert "THIS-COMPUTER" not in waits


def test_a_computer_without_a_network_is_named(monkeypatch):
    import socket

    def refused(*_):
        raise OSError("Network is unreachable")

    monkeypatch.setattr(socket.socket, "connect", refused)
    assert own_address() == socket.gethostname()
