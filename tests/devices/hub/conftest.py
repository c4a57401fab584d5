"""A session without sockets, and a hub with them; clients that speak to it on loopback."""

import asyncio
import json
from contextlib import asynccontextmanager
from random import Random

import aiohttp
import numpy as np
import pytest

from devices.clock import WallClock
from devices.hub.contract import Asset, HubSettings
from devices.hub.entry.pairing import PairingCodes
from devices.hub.entry.tokens import Tokens
from devices.hub.protocol.messages import Hello
from devices.hub.protocol.wire import Body, encode_body
from devices.hub.roles import Role
from devices.hub.server import Hub
from devices.hub.session import Session, Visit
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState

PATIENCE_S = 60.0


class Room:
    """A session whose time a test sets, with what was said of it."""

    def __init__(self, max_people=32):
        self.said = []
        self.now_ns = 0
        self.session = Session(
            max_people=max_people,
            codes=PairingCodes(Random(0).randrange),
            tokens=Tokens(Random(1).randbytes),
            say=self.said.append,
            now_ns=0,
        )

    def pair(self, name="Anna", role=Role.REMOTE):
        code, _ = self.session.codes.make(role, self.now_ns)
        return self.session.pair(code, name=name, address="10.0.0.1", now_ns=self.now_ns)

    def enter(self, token, **hello):
        visit = self.session.enter(
            Hello(token, hello.get("name"), hello.get("log_seq")),
            address="10.0.0.1",
            now_ns=self.now_ns,
        )
        return visit.guest, visit.outbox

    def join(self, name="Anna", role=Role.REMOTE):
        guest, outbox = self.enter(self.pair(name, role))
        return guest, outbox, self.drain(outbox)[0]

    def drain(self, outbox):
        """Messages that are due now."""
        found = []
        session = self.session
        while (it := outbox.take(session.states, session.bodies, now_ns=self.now_ns)) is not None:
            found.append(json.loads(it) if isinstance(it, str) else it)
        return found

    def hear(self, guest, outbox, **fields):
        return self.session.hear(Visit(guest, outbox), json.dumps(fields), now_ns=self.now_ns)


@pytest.fixture
def room():
    return Room()


@pytest.fixture
def make_room():
    return Room


def tracked(name, x, seq=1):
    pose = Pose.from_yaw(0.0, (x, 0, 0))
    return TrackedObject(name, seq, pose, np.eye(4), 1.0, TrackState.TRACKED, 0.9, seq)


@pytest.fixture
def state_at():
    """A state with one object, "cup", at x metres."""
    return lambda x, seq=1: SceneState(seq, seq, {"cup": tracked("cup", x, seq)})


@pytest.fixture
def body_at():
    """A body with a head at x metres."""
    return lambda x, seq=1: encode_body(
        Body(seq, seq, Pose.from_quaternion((1, 0, 0, 0), (x, 1.6, 0)))
    )


class Client:
    """Somebody in the session: what they were sent waits in `texts` and `bundles`."""

    def __init__(self, socket, welcome):
        self.socket, self.welcome = socket, welcome
        self.texts, self.bundles = [], []

    @property
    def person_id(self):
        return self.welcome["you"]

    async def send(self, **fields):
        await self.socket.send_json(fields)

    async def next(self, kind):
        """The next text of a kind, or bundle; what comes before it is kept, too."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                message = await self.socket.receive()
                if message.type is aiohttp.WSMsgType.BINARY:
                    self.bundles.append(message.data)
                    if kind == "bodies":
                        return message.data
                elif message.type is aiohttp.WSMsgType.TEXT:
                    self.texts.append(json.loads(message.data))
                    if self.texts[-1]["kind"] == kind:
                        return self.texts[-1]
                else:
                    assert kind == "end", f"closed while waiting for {kind}: {self.texts[-3:]}"
                    return message


class House:
    """A hub on loopback and what was said of it."""

    def __init__(self, assets=None, **settings):
        self.said = []
        self.assets = assets or {"/": Asset(b"<p>the page</p>", "text/html; charset=utf-8")}
        self.hub = Hub(
            HubSettings(**settings), self.assets, clock=WallClock(), say=self.said.append
        )
        self.hub.start()
        self.url = self.hub.url

    def run(self, talk):
        """Runs `talk` of people with a session of HTTP."""

        async def within():
            async with self.http() as http:
                return await talk(http)

        return asyncio.run(asyncio.wait_for(within(), 15))

    @asynccontextmanager
    async def http(self):
        async with aiohttp.ClientSession(self.url) as session:
            yield session

    async def pair(self, http, name="Anna", role=Role.REMOTE):
        code = self.hub.invite(role).code
        async with http.post("/pair", json={"code": code, "name": name}) as reply:
            assert reply.status == 200
            return (await reply.json())["token"]

    async def enter(self, http, token, **hello):
        """Somebody with a token; the first answer is in `welcome`, whatever it is."""
        socket = await http.ws_connect("/people", autoping=True)
        await socket.send_json({"kind": "hello", "token": token, **hello})
        return Client(socket, await socket.receive_json(timeout=PATIENCE_S))

    async def join(self, http, name="Anna", role=Role.REMOTE):
        return await self.enter(http, await self.pair(http, name, role), name=name)


@pytest.fixture
def open_house():
    """Makes hubs that end with the test."""
    houses = []

    def make(assets=None, **settings):
        houses.append(House(assets, **settings))
        return houses[-1]

    yield make
    for house in houses:
        house.hub.close()


@pytest.fixture
def house(open_house):
    return open_house()
