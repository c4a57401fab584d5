"""Both transports; members on them, which a test lets live until something has happened."""

import importlib.util
import time

import pytest

from devices.clock import WallClock
from devices.transport.follower import Follower
from devices.transport.keys import Member, MemberRole
from devices.transport.source import Source
from tests.devices.transport.networks import LocalNetwork, ZenohNetwork

PATIENCE_S = 60.0
HAS_ZENOH = importlib.util.find_spec("zenoh") is not None
needs_zenoh = pytest.mark.skipif(not HAS_ZENOH, reason="eclipse-zenoh is not installed")


@pytest.fixture(params=["local", pytest.param("zenoh", marks=needs_zenoh)])
def network(request, tmp_path):
    made = LocalNetwork() if request.param == "local" else ZenohNetwork(tmp_path / "building")
    yield made
    made.close()


@pytest.fixture
def zenoh_network(tmp_path):
    if not HAS_ZENOH:
        pytest.skip("eclipse-zenoh is not installed")
    made = ZenohNetwork(tmp_path / "building")
    yield made
    made.close()


class Reader:
    """Everything that a follower gave, put together."""

    def __init__(self, transport, *, members=None, clock=None):
        self.follower = Follower(
            transport,
            members or Member("hall-3", MemberRole.ROOM, "hall-3"),
            limits={"objects": 10_000, "picture": 100_000},
            logs=("drawn",),
            clock=clock or WallClock(),
        )
        self.values = {}
        self.items = {}
        self.numbers = []
        self.is_away = None
        self.starts = 0
        self.wholes = 0

    def take(self):
        for news in self.follower.take():
            if news.is_new:
                self.values, self.items, self.numbers = {}, {}, []
                self.starts += 1
            self.is_away = news.is_away
            for channel, data in news.values.items():
                if data is None:
                    self.values.pop(channel, None)
                else:
                    self.values[channel] = data
            for log in news.logs.values():
                if log.is_whole:
                    self.items, self.numbers = {}, []
                    self.wholes += 1
                for entry in log.entries:
                    self.numbers.append(entry.number)
                    self.items[entry.item] = entry.data
                    if not entry.data:
                        del self.items[entry.item]


class Life:
    """A source that beats and readers that look, until something has happened."""

    def __init__(self, transport, member=None, epoch=1, clock=None):
        self.clock = clock or WallClock()
        self.source = Source(
            transport,
            member or Member("hall-3", MemberRole.ROOM, "hall-3"),
            logs=("drawn",),
            epoch=epoch,
        )
        self.readers = []

    def read(self, transport, **options):
        self.readers.append(Reader(transport, clock=self.clock, **options))
        return self.readers[-1]

    def step(self):
        self.source.beat(self.clock.now_ns(), {"scene": "lab"})
        for reader in self.readers:
            reader.take()

    def until(self, happened, *, within_s=PATIENCE_S):
        begin = time.monotonic()
        while not happened():
            assert time.monotonic() - begin < within_s, "it did not happen in time"
            self.step()
            time.sleep(0.01)
        return time.monotonic() - begin

    def pass_time(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.step()
            time.sleep(0.02)


@pytest.fixture
def live():
    return Life
