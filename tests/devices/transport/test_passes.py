"""Passes: made, read, written down; damaged ones are refused."""

import base64

import pytest

from devices.hub.entry.certificates import CertificateError
from devices.transport.keys import KeyNameError, MemberRole
from devices.transport.passes import (
    MEMBERS_FILE,
    ROOT_PUBLIC_FILE,
    Admitted,
    PassError,
    admit,
    keep_building,
    members,
    read_pass,
)

NORTH = Admitted(MemberRole.SITE, "north")


@pytest.fixture
def building(tmp_path):
    folder = tmp_path / "building"
    keep_building(folder, names=("127.0.0.1",))
    return folder


def test_a_pass_says_whose_it_is(building):
    path = admit(building, NORTH)
    given = read_pass(path)
    assert given.admitted == NORTH
    assert base64.b64decode(given.root_base64) == (building / ROOT_PUBLIC_FILE).read_bytes()
    assert path.stat().st_mode & 0o777 == 0o600
    assert "PRIVATE" not in repr(given)
    assert given.key_base64 not in repr(given)


def test_members_are_written_down_once_and_can_be_taken_out(building):
    assert members(building) == ()
    admit(building, NORTH)
    admit(building, Admitted(MemberRole.ROOM, "hall-3"))
    admit(building, NORTH)
    assert [each.common_name for each in members(building)] == ["site:north", "room:hall-3"]
    (building / MEMBERS_FILE).write_text("# nobody but\nroom hall-3\n")
    assert [each.name for each in members(building)] == ["hall-3"]


def test_a_building_that_is_there_stays(building):
    before = admit(building, NORTH).read_bytes()
    keep_building(building, names=("127.0.0.1",))
    assert read_pass(building / "passes" / "site-north.pass").admitted == NORTH
    assert (building / "passes" / "site-north.pass").read_bytes() == before


@pytest.mark.parametrize("line", ["site", "site Nörth", "king north", "site north extra"])
def test_a_bad_line_is_named(building, line):
    (building / MEMBERS_FILE).write_text(f"site south\n{line}\n")
    with pytest.raises(PassError, match="line 2"):
        members(building)


def test_names_and_folders_are_checked(building, tmp_path):
    with pytest.raises(KeyNameError):
        admit(building, Admitted(MemberRole.SITE, "../north"))
    with pytest.raises(CertificateError, match="make one first"):
        admit(tmp_path, NORTH)


@pytest.mark.parametrize("damage", ["nothing", "no key", "junk in the certificate", "large"])
def test_what_is_no_pass_is_refused(building, damage):
    path = admit(building, NORTH)
    data = path.read_bytes()
    at = data.index(b"-----BEGIN CERT")
    path.write_bytes(
        {
            "nothing": b"",
            "no key": data[at:],
            "junk in the certificate": data.replace(data[at + 60 : at + 80], b"A" * 20),
            "large": data * 400,
        }[damage]
    )
    with pytest.raises((PassError, CertificateError)):
        read_pass(path)
