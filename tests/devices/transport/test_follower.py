"""A follower: what it does not take, and when it asks again."""

import pytest

from devices.clock import ManualClock
from devices.transport import follower as module
from devices.transport.followed import AWAY_NS, MAX_WAITING
from devices.transport.keys import Member, MemberRole, site
from devices.transport.local import Exchange, LocalTransport
from devices.transport.source import Source
from devices.transport.wire import Entry, pack_entry, pack_value
from tests.devices.transport.conftest import Reader

SITES = Member("lab", MemberRole.SITE, "*")


@pytest.fixture
def ways():
    exchange = Exchange()
    clock = ManualClock(10**9)
    reader = Reader(LocalTransport(exchange), members=SITES, clock=clock)
    return LocalTransport(exchange), reader, clock


def test_what_is_not_for_it_is_refused(ways):
    transport, reader, _clock = ways
    base = "gn/lab/site/north"
    transport.put(f"{base}/now/objects", pack_value(1, 1, data=bytes(10_001)))
    transport.put(f"{base}/now/unknown", pack_value(1, 1, data=b"x"))
    transport.put(f"{base}/log/other", pack_entry(1, Entry(1, "a", b"")))
    transport.put(f"{base}/now/objects", b"junk")
    transport.put(f"{base}/beat", b"junk")
    reader.take()
    assert reader.values == {}
    assert reader.follower.refused == 5


def test_too_many_members_are_not_kept(ways):
    transport, reader, _clock = ways
    reader.follower._max_members = 2
    for name in ("a", "b", "c"):
        transport.put(f"gn/lab/site/{name}/now/objects", pack_value(1, 1, data=b"x"))
    assert len(reader.follower.take()) == 2
    assert reader.follower.refused == 1


def test_older_values_do_not_replace_newer_ones(ways):
    transport, reader, _clock = ways
    for number in (3, 2):
        transport.put("gn/lab/site/n/now/objects", pack_value(1, number, data=b"%d" % number))
    reader.take()
    assert reader.values == {"objects": b"3"}


def test_who_is_silent_is_away_and_later_forgotten(ways):
    transport, reader, clock = ways
    source = Source(transport, site("lab", "north"), logs=("drawn",), epoch=1)
    source.beat(clock.now_ns(), {})
    reader.take()
    assert reader.is_away is False
    clock.sleep_until(clock.now_ns() + AWAY_NS)
    reader.take()
    assert reader.is_away is True
    clock.sleep_until(clock.now_ns() + module.FORGET_NS)
    reader.take()
    source.beat(clock.now_ns(), {})
    reader.take()
    assert reader.starts == 2, "as somebody new"


def test_who_takes_too_seldom_asks_for_the_log_again(ways):
    transport, reader, clock = ways
    source = Source(transport, site("lab", "north"), logs=("drawn",), epoch=1)
    source.beat(clock.now_ns(), {})
    reader.take()
    reader.take()
    assert reader.wholes == 1
    for number in range(MAX_WAITING + 10):
        source.append("drawn", f"line {number % 5}", data=b"%d" % number)
    reader.take()
    reader.take()
    assert reader.wholes == 2
    assert reader.items["line 0"] == b"8200"


def test_a_start_with_a_clock_set_back_is_believed_when_the_former_one_is_silent(ways):
    transport, reader, clock = ways
    transport.put("gn/lab/site/n/now/objects", pack_value(9, 1, data=b"nine"))
    transport.put("gn/lab/site/n/now/objects", pack_value(8, 1, data=b"eight"))
    reader.take()
    assert reader.values == {"objects": b"nine"}
    clock.sleep_until(clock.now_ns() + AWAY_NS)
    transport.put("gn/lab/site/n/now/objects", pack_value(8, 2, data=b"eight"))
    reader.take()
    assert reader.values == {"objects": b"eight"}


def test_it_hears_nothing_after_its_end(ways):
    transport, reader, _clock = ways
    reader.follower.close()
    transport.put("gn/lab/site/n/now/objects", pack_value(1, 1, data=b"x"))
    assert reader.follower.take() == ()
