import asyncio
import json

import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.server import Hub
from sim.headset.connection import HubAddress, HubRefusedError, pair
from sim.headset.crowd import CrowdPlan, run_crowd
from sim.headset.room_download import RoomDownload
from tests.sim.headset.conftest import PATIENCE_S

MANIFEST = {
    "first_part": "first",
    "room_part": "room",
    "objects": [{"part": "object-0", "shadow_part": None}],
}


@pytest.fixture
def room():
    """A hub with the files of a room."""
    files = {f"{name}.spz": b"s" * size for name, size in (("first", 1000), ("object-0", 50))}
    files["manifest.json"] = json.dumps(MANIFEST).encode()
    assets = {
        f"/assets/room/{name}": Asset(data, "application/octet-stream", is_private=True)
        for name, data in files.items()
    }
    assets["/"] = Asset(b"<title>room</title>", "text/html")
    hub = Hub(HubSettings(), assets, clock=WallClock())
    hub.start()
    yield hub, assets
    hub.close()


def test_a_room_is_fetched_with_a_token_in_two_parts(room):
    hub, assets = room
    assets["/assets/room/room.spz"] = Asset(b"r" * 70_000, "x/y", is_private=True)

    async def play():
        address = HubAddress(hub.url)
        async with address.opened() as http:
            download = RoomDownload(http, address)
            with pytest.raises(HubRefusedError, match="HTTP 401"):
                await download.fetch_first("no token")
            token = await pair(http, address, code=hub.invite().code, name="Ann")
            assert await download.fetch_first(token)
            first = download.received_bytes
            await download.fetch_rest(token)
            return first, download.received_bytes

    first, whole = asyncio.run(asyncio.wait_for(play(), PATIENCE_S))
    assert first == 1000 + len(json.dumps(MANIFEST))
    assert whole == first + 50 + 70_000


def test_a_file_that_is_missing_is_a_failure(room):
    hub, _ = room

    async def codes():
        yield hub.invite().code

    plan = CrowdPlan(HubAddress(hub.url), 1, 1.0)
    tally = asyncio.run(run_crowd(plan, codes(), over=asyncio.Event()))
    assert tally.failures == ["Ann 1: room.spz: the hub does not have it"]
    assert len(tally.joins_s) == 1
    assert tally.wholes_s == []
