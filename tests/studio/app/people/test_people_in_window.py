"""The panel in the window with a real live session, a real hub and a browser's requests."""

from __future__ import annotations

import asyncio
import json
import os
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from aiohttp import ClientSession

from scenes.frames import look_at
from scenes.state import Avatar, SceneState
from studio.app.model.runs.guests import Guests
from studio.console.display import why_no_window
from studio.live.people.hosting import Hosting
from tests.studio.app.live.conftest import opened  # noqa: F401 - a fixture

PICTURES = os.environ.get("NEXUS_TEST_PICTURES")
"""Folder for pictures of the window, to be looked at."""

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


async def join(url, code, name, *, until):
    """Come in as a browser does; stays until the window's loop says so."""
    async with ClientSession() as session:
        async with session.post(f"{url}pair", json={"code": code, "name": name}) as answer:
            assert answer.status == 200, await answer.text()
            token = (await answer.json())["token"]
        async with session.ws_connect(f"{url}people") as socket:
            await socket.send_str(json.dumps({"kind": "hello", "token": token, "name": name}))
            welcome = json.loads((await socket.receive(timeout=60)).data)
            assert welcome["kind"] == "welcome"
            await until(socket)


def test_two_clicks_to_a_code_that_lets_somebody_in(opened, qapp, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path / "nexus"))
    opened.go_live()
    bench, guests = opened.bench, opened.bench.shared(Guests)
    bench.do("dock.people")  # the first click: the panel's tab
    panel = opened.window.content("people")
    opened.until(lambda: panel.let_in.isEnabled() and panel.let_in.isVisible())
    panel.let_in.click()  # the second
    opened.until(lambda: panel.invitation.isVisible() and guests.invitation is not None)
    code, url = guests.invitation.code, opened.live.job.hub.url
    with urllib.request.urlopen(url, timeout=60) as page:
        assert page.status == 200

    async def seen(_socket):
        deadline = asyncio.get_running_loop().time() + 120
        while "p1" not in panel.rows or guests.invitation is not None:
            qapp.processEvents()
            await asyncio.sleep(0.02)
            assert asyncio.get_running_loop().time() < deadline

    asyncio.run(join(url, code, "Ana", until=seen))
    assert panel.rows["p1"].name.text() == "Ana"
    assert guests.invitation is None, "the code was for one person"
    bench.do("people.remove", person="Ana")
    assert guests.people() == ()
    opened.live.end()
    opened.until(lambda: not opened.live.is_running)
    opened.until(lambda: not panel.invitation.isVisible())


def test_the_view_follows_somebody_until_it_is_moved(opened):  # noqa: F811
    bench, view = opened.bench, opened.window.view.active
    head = look_at(np.array([0.5, 0.2, 1.5]), np.array([2.0, 0.2, 1.0]))
    people = {"p1": Avatar("p1", "remote", head)}
    bench.show_state(SceneState(t_ns=1, avatars=people))
    opened.until(lambda: view.painted is not None)
    bench.perform("view.follow", person="p1")

    def stands_there():
        pose = view.painted.view.world_from_camera
        return np.allclose(pose.matrix(), head.matrix())

    opened.until(stands_there)
    assert view.painted.view.seen_by == "p1"
    view.set_viewer(view.viewer)
    opened.until(lambda: not stands_there())
    assert view.followed == ""


SAID = {
    "kind": "device",
    "model": "Quest 3",
    "immersion": "vr",
    "worn": True,
    "hz": 72,
    "battery": 12,
    "charging": False,
}


async def _everything(socket):
    """Take messages, whatever they say, and with them answer the hub's pings."""
    async for _ in socket:
        pass
    yield


def test_a_headset_that_has_joined_is_in_the_session_panel_and_its_checks(
    opened,  # noqa: F811
    qapp,
    tmp_path,
    monkeypatch,
):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path / "nexus"))
    opened.go_live()
    hub = opened.live.job.doors.open(Hosting())
    dock = opened.dock

    def lines():
        items = [dock.checks.topLevelItem(row) for row in range(dock.checks.topLevelItemCount())]
        return {item.text(1): (item.text(0), item.text(2)) for item in items}

    async def until(happened, seconds=120):
        deadline = asyncio.get_running_loop().time() + seconds
        while not happened():
            qapp.processEvents()
            await asyncio.sleep(0.02)
            assert asyncio.get_running_loop().time() < deadline, lines()

    async def keep(name):
        """Bring a tab to the front and write what is seen."""
        dock.show_tab(name)
        qapp.processEvents()
        if PICTURES:
            opened.window.grab().save(str(Path(PICTURES) / f"quest-{name.lower()}.png"))

    async def seen(socket):
        answering = asyncio.ensure_future(anext(_everything(socket)))
        await socket.send_str(json.dumps(SAID))
        await until(lambda: "p1" in dock.quest.blocks)
        block = dock.quest.blocks["p1"]
        assert block.title.text() == "Ana"
        assert block.values["Battery"].text().endswith("12 %")
        await keep("Quest")
        await until(dock.check_button.isEnabled)
        opened.bench.do("live.check_again")
        await until(lambda: "Ana (p1) battery" in lines())
        verdict, found = lines()["Ana (p1) battery"]
        assert "WARN" in verdict
        assert "charge it" in found
        await keep("Checks")
        answering.cancel()

    code = hub.invite().code
    asyncio.run(join(hub.url, code, "Ana", until=seen))
    opened.live.end()
    opened.until(lambda: not opened.live.is_running)
    opened.until(lambda: dock.quest.blocks == {})
