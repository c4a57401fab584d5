"""Codes become people, tokens let them in, and only as often as they should."""

from random import Random

import pytest

from devices.hub.attendance import Attendance
from devices.hub.entry.admission import MAX_ARRIVING, Admission, Refused
from devices.hub.entry.pairing import PairingCodes, PairingRefused
from devices.hub.entry.tokens import TOKEN_NS, Tokens
from devices.hub.outbox import Outbox, Sent
from devices.hub.roles import Role


@pytest.fixture
def door():
    codes = PairingCodes(Random(0).randrange)
    return Admission(Attendance(), codes, Tokens(Random(1).randbytes), max_people=2)


def pair(door, now_ns=0, role=Role.REMOTE):
    code, _ = door.codes.make(role, now_ns)
    guest = door.pair(code, name="Anna", address="10.0.0.1", now_ns=now_ns)
    return guest, door.new_token(guest, now_ns)


def connect(guest):
    guest.outbox, guest.has_joined = Outbox(1, Sent()), True


def why(door, token, now_ns=0):
    with pytest.raises(Refused) as caught:
        door.admit(token, now_ns)
    assert token not in str(caught.value)
    return str(caught.value)


def test_a_token_lets_its_person_in(door):
    guest, token = pair(door, role=Role.LOCAL)
    assert door.admit(token, 0) is guest
    assert guest.person.role is Role.LOCAL


def test_a_token_is_replaced_once_a_newer_one_is_used(door):
    guest, first = pair(door)
    door.admit(first, 0)
    second = door.new_token(guest, 0)
    assert door.admit(first, 0) is guest, "the newer one may have been lost on its way"
    door.admit(second, 0)
    assert "replaced" in why(door, first)


def test_a_removed_person_stays_out(door):
    guest, token = pair(door)
    door.attendance.remove(guest.person.person_id)
    assert "removed" in why(door, token)


def test_an_expired_token_is_refused(door):
    _guest, token = pair(door)
    assert "expired" in why(door, token, TOKEN_NS)


def test_a_full_room_uses_no_code_up_and_lets_people_back(door):
    guests = [pair(door) for _ in range(3)]
    for _guest, token in guests[:2]:
        connect(door.admit(token, 0))
    assert "full" in why(door, guests[2][1])
    code, _ = door.codes.make(Role.REMOTE, 0)
    with pytest.raises(Refused, match="full"):
        door.pair(code, name="Cleo", address="a", now_ns=0)
    back = guests[0][0]
    assert door.admit(door.new_token(back, 0), 0) is back
    back.outbox, back.away_since_ns = None, 0
    assert door.pair(code, name="Cleo", address="a", now_ns=31 * 10**9)


def test_only_so_many_arrive_at_once(door):
    for _ in range(MAX_ARRIVING):
        pair(door)
    with pytest.raises(Refused):
        pair(door)


def test_a_wrong_code_is_nobody(door):
    with pytest.raises(PairingRefused):
        door.pair("x", name="Anna", address="a", now_ns=0)
    assert door.attendance.arriving() == 0


def test_reading_a_token_uses_nothing_up(door):
    guest, first = pair(door)
    second = door.new_token(guest, 0)
    assert door.read(second, 0)[0] is guest
    assert door.read(first, 0)[0] is guest
