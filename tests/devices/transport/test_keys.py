"""Names and keys: what may be one, and whose a key is."""

import pytest

from devices.transport.keys import (
    KeyNameError,
    Member,
    MemberRole,
    check_name,
    matches,
    name_of,
    read_key,
    room,
    site,
)


def test_a_key_says_whose_it_is():
    member = site("hall-3", "north")
    assert member.base == "gn/hall-3/site/north"
    assert read_key(f"{member.base}/now/people") == (member, "now", "people")
    assert read_key(f"{room('lab').base}/beat") == (room("lab"), "beat", "")


@pytest.mark.parametrize(
    "key",
    [
        "gn/hall/site/north",
        "gn/hall/king/north/beat",
        "gn/hall/watcher/north/beat",
        "other/hall/site/north/beat",
        "gn/hall/site/north/now/people/more",
        "gn/Hall/site/north/beat",
        "gn/hall/site/*/beat",
        f"gn/{'h' * 300}/site/north/beat",
        "",
    ],
)
def test_what_is_nobodys_key(key):
    assert read_key(key) is None


@pytest.mark.parametrize("name", ["", "Hall", "a/b", "*", "-a", "a" * 41, "ä", "a b"])
def test_what_is_no_name(name):
    with pytest.raises(KeyNameError):
        check_name(name)


def test_any_text_gives_a_name():
    assert name_of("Room C.gnx") == "room-c-gnx"
    assert name_of("…") == "room"
    assert check_name(name_of("x" * 99))


@pytest.mark.parametrize(
    ("pattern", "key", "is_held"),
    [
        ("gn/*/room/*/beat", "gn/a/room/b/beat", True),
        ("gn/*/room/*/beat", "gn/a/room/b/now/x", False),
        ("gn/a/**", "gn/a/room/b/now/x", True),
        ("gn/a/**", "gn/b/room", False),
        ("gn/a/b", "gn/a", False),
    ],
)
def test_patterns(pattern, key, is_held):
    assert matches(pattern, key) is is_held


def test_a_pattern_stands_for_members():
    sites = Member("hall-3", MemberRole.SITE, "*")
    assert sites.is_pattern
    assert sites.holds(site("hall-3", "north"))
    assert not sites.holds(site("hall-4", "north"))
    assert not sites.holds(room("hall-3"))
