import asyncio

import aiohttp
import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.server import Hub
from sim.headset.connection import HubAddress, HubRefusedError, connect, fetch_page, pair
from tests.sim.headset.conftest import PATIENCE_S


def test_addresses_are_those_of_a_page():
    address = HubAddress("https://192.168.1.5:8443/#code=123456")
    assert address.at("/pair") == "https://192.168.1.5:8443/pair"
    assert address.at("/people", is_socket=True) == "wss://192.168.1.5:8443/people"
    for bad in ("ws://x:1/", "room", "http://", "ftp://x/"):
        with pytest.raises(ValueError, match="wanted http"):
            HubAddress(bad)


def test_somebody_pairs_and_is_welcomed(hub):
    async def play():
        address = HubAddress(hub.url)
        async with address.opened() as http:
            assert await fetch_page(http, address) > 10
            token = await pair(http, address, code=hub.hub.invite().code, name="Ann")
            one = await connect(http, address, token=token, name="Ann")
            assert (one.welcome["name"], one.welcome["role"]) == ("Ann", "remote")
            assert "line" in one.welcome["rights"]
            hub.publish()
            while (said := await one.receive()) is not None:
                if isinstance(said, dict) and said["kind"] == "state":
                    break
            assert "chair-1" in said["objects"]
            await one.close()
            assert one.is_closed

    asyncio.run(asyncio.wait_for(play(), PATIENCE_S))


def test_a_hub_with_a_certificate_is_trusted_by_its_root_alone(tmp_path):
    settings = HubSettings(certificate_folder=tmp_path / "certificates")
    hub = Hub(settings, {"/": Asset(b"<title>room</title>", "text/html")}, clock=WallClock())
    hub.start()
    try:
        root = tmp_path / "root.pem"
        root.write_bytes(hub.root_pem)

        async def play(address):
            async with address.opened() as http:
                token = await pair(http, address, code=hub.invite().code, name="Ann")
                one = await connect(http, address, token=token, name="Ann")
                await one.close()
                return one.welcome["you"]

        assert asyncio.run(play(HubAddress(hub.url, root))) == "p1"
        with pytest.raises(aiohttp.ClientConnectorCertificateError):
            asyncio.run(play(HubAddress(hub.url)))
    finally:
        hub.close()
    with pytest.raises(ValueError, match=r"no\.pem: no root certificate"):
        HubAddress("https://127.0.0.1/", tmp_path / "no.pem").opened()


def test_a_hub_s_no_is_said_with_its_reason(hub):
    async def play():
        address = HubAddress(hub.url)
        async with address.opened() as http:
            with pytest.raises(HubRefusedError, match="code is wrong") as refused:
                await pair(http, address, code="no", name="Ann")
            assert refused.value.status == 403
            with pytest.raises(HubRefusedError, match="token"):
                await connect(http, address, token="no", name="Ann")

    asyncio.run(asyncio.wait_for(play(), PATIENCE_S))
