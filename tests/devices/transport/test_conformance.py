"""Held of every transport: late joiners, splits, a killed router, slow readers, logs in order."""

import time

import pytest

from devices.transport.keys import Member, MemberRole

BACK_S = 2.0
"""Everybody is back so long after the network is, seconds: the promise."""


def test_who_comes_late_gets_the_newest_values_and_all_items(network, live):
    life = live(network.open("room", "hall-3"))
    life.source.set("objects", b"1")
    life.source.set("objects", b"2")
    life.source.set("picture-0", b"jpeg")
    for number in range(5):
        life.source.append("drawn", f"line {number % 3}", data=b"%d" % number)
    life.source.append("drawn", "line 0", data=b"")
    life.pass_time(0.6)
    late = life.read(network.open("site", "north"))
    life.until(lambda: len(late.values) == 2 and late.wholes)
    assert late.values == {"objects": b"2", "picture-0": b"jpeg"}
    assert late.items == {"line 1": b"4", "line 2": b"2"}
    life.source.append("drawn", "line 7", data=b"new")
    life.until(lambda: "line 7" in late.items)
    assert late.wholes == 1


def test_a_log_comes_without_gap_or_twice(network, live):
    life = live(network.open("room", "hall-3"))
    reader = life.read(network.open("site", "north"))
    life.until(lambda: reader.wholes)
    for number in range(300):
        life.source.append("drawn", f"line {number}", data=b"x" * 50)
        if number % 10 == 0:
            life.step()
    life.until(lambda: len(reader.numbers) >= 300)
    assert reader.numbers == list(range(1, 301))
    assert reader.wholes == 1


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [10.0])
def test_a_split_of_ten_seconds_leaves_nothing_stale(network, live, seconds):
    hold_split(network, live, seconds)


def test_a_split_leaves_nothing_stale(network, live):
    hold_split(network, live, 3.0)


def hold_split(network, live, seconds):
    life = live(network.open("room", "hall-3"))
    reader = life.read(network.open("site", "north"))
    life.source.set("objects", b"before")
    life.source.set("picture-0", b"gone soon")
    life.source.append("drawn", "old", data=b"1")
    life.until(lambda: len(reader.values) == 2 and "old" in reader.items)
    network.split()
    life.pass_time(0.2)
    life.source.set("objects", b"after")
    life.source.drop("picture-0")
    life.source.append("drawn", "old", data=b"")
    for number in range(20):
        life.source.append("drawn", f"new {number}", data=b"2")
    life.pass_time(seconds)
    assert reader.is_away
    assert reader.values["objects"] == b"before"
    network.heal()
    took = life.until(
        lambda: (
            reader.values == {"objects": b"after"}
            and len(reader.items) == 20
            and not reader.is_away
        )
    )
    assert took <= BACK_S
    assert reader.numbers == list(range(1, 23)), "neither a gap nor twice"
    assert reader.starts == 1


def test_a_router_that_is_killed_and_comes_back_leaves_nothing_stale(network, live):
    life = live(network.open("room", "hall-3"))
    readers = [life.read(network.open("site", name)) for name in ("north", "south")]
    life.source.set("objects", b"before")
    life.source.append("drawn", "old", data=b"1")
    life.until(lambda: all(r.values and r.items for r in readers))
    network.kill_router()
    life.source.set("objects", b"after")
    life.source.append("drawn", "old", data=b"")
    life.source.append("drawn", "new", data=b"2")
    life.pass_time(2.5)
    assert all(reader.is_away for reader in readers)
    network.start_router()
    took = life.until(
        lambda: all(
            r.values == {"objects": b"after"} and r.items == {"new": b"2"} and not r.is_away
            for r in readers
        )
    )
    assert took <= BACK_S


def test_a_room_that_starts_again_is_not_mixed_with_its_former_self(network, live):
    transport = network.open("room", "hall-3")
    first = live(transport, epoch=10)
    reader = first.read(network.open("site", "north"))
    first.source.set("objects", b"first")
    first.source.append("drawn", "old", data=b"1")
    first.until(lambda: reader.values and reader.items)
    first.source.close()
    second = live(transport, epoch=11, clock=first.clock)
    second.readers.append(reader)
    second.source.set("picture-0", b"second")
    second.until(lambda: reader.starts == 2 and reader.values == {"picture-0": b"second"})
    second.until(lambda: reader.wholes == 2)
    assert reader.items == {}
    first.source.set("objects", b"a ghost")
    second.pass_time(0.2)
    assert reader.values == {"picture-0": b"second"}


def test_a_slow_reader_gets_the_freshest(network, live):
    life = live(network.open("room", "hall-3"))
    slow = life.read(network.open("site", "north"))
    life.until(lambda: slow.wholes)
    life.readers.clear()
    for number in range(12_000):
        life.source.set("objects", b"%d" % number)
        if number % 2 == 0:
            life.source.append("drawn", f"line {number % 8}", data=b"%d" % number)
        if number % 100 == 0:
            life.step()
            time.sleep(0.002)
    life.readers.append(slow)
    life.until(lambda: slow.values.get("objects") == b"11999" and len(slow.items) == 4)
    life.until(lambda: slow.items["line 6"] == b"11998")
    assert slow.numbers == sorted(set(slow.numbers))


def test_many_sites_are_heard_by_one_room(network, live):
    lives = [
        live(network.open("site", name), Member("hall-3", MemberRole.SITE, name))
        for name in ("north", "south")
    ]
    room = network.open("room", "hall-3")
    reader = lives[0].read(room, members=Member("hall-3", MemberRole.SITE, "*"))
    lives[0].source.set("objects", b"n")
    lives[1].source.set("picture-1", b"s")

    heard = {}

    def both():
        lives[1].step()
        for news in reader.follower.take():
            heard.setdefault(news.member.name, {}).update(news.values)
        return heard == {"north": {"objects": b"n"}, "south": {"picture-1": b"s"}}

    lives[0].readers.clear()
    lives[0].until(both)
