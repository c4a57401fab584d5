"""Posts of a page to a file of its hub: by somebody in the session, short, from this origin."""

from __future__ import annotations

import json
import urllib.error
import urllib.request

import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.server import Hub
from devices.hub.site import MAX_POST_BYTES


@pytest.fixture
def posted():
    """A hub with a file that takes what is posted; what it got is in `got`."""
    got = []

    def takes(person, data):
        got.append((person, data))
        return "" if data.startswith(b"{") else "wanted an object"

    assets = {
        "/answers": Asset(b"", "application/json", is_private=True, takes=takes),
        "/": Asset(b"page", "text/html"),
    }
    hub = Hub(HubSettings(), assets, clock=WallClock())
    hub.start()
    hub.got = got
    yield hub
    hub.close()


def post(hub, path, data, **headers):
    request = urllib.request.Request(
        hub.url.rstrip("/") + path, data=data, headers=headers, method="POST"
    )
    try:
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.status, json.loads(answer.read())
    except urllib.error.HTTPError as error:
        return error.code, json.loads(error.read())


def token_of(hub):
    body = json.dumps({"code": hub.invite().code, "name": "Ann"}).encode()
    return post(hub, "/pair", body)[1]["token"]


def test_somebody_in_the_session_posts(posted):
    token = token_of(posted)
    bearer = {"Authorization": f"Bearer {token}"}
    assert post(posted, "/answers", b'{"a": 1}', **bearer) == (200, {})
    assert posted.got == [("p1", b'{"a": 1}')]
    assert post(posted, "/answers", b"[]", **bearer) == (422, {"why": "wanted an object"})


def test_nobody_else_does(posted):
    token = token_of(posted)
    bearer = {"Authorization": f"Bearer {token}"}
    assert post(posted, "/answers", b"{}")[0] == 401
    assert post(posted, "/answers", b"{}", Authorization="Bearer made.up")[0] == 401
    assert post(posted, "/answers", b"{}", Origin="http://evil.example", **bearer)[0] == 403
    assert post(posted, "/answers", b"x" * (MAX_POST_BYTES + 1), **bearer)[0] == 400
    assert post(posted, "/", b"{}", **bearer)[0] == 405  # nothing may be posted there
    assert posted.got == []
