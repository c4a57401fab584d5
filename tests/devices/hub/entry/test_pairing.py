"""Codes: one use, two minutes, and guessing stops soon."""

from random import Random

import pytest

from devices.hub.entry.pairing import (
    CODE_NS,
    MAX_ADDRESSES,
    MAX_CODES,
    MAX_WRONG,
    MAX_WRONG_IN_ALL,
    WINDOW_NS,
    PairingCodes,
    PairingRefused,
)
from devices.hub.roles import Role


@pytest.fixture
def codes():
    return PairingCodes(Random(0).randrange)


def redeem(codes, code, now_ns=0, address="10.0.0.1"):
    return codes.redeem(code, address=address, now_ns=now_ns)


def wrong_of(code):
    return f"{(int(code) + 1) % 10**6:06d}"


def status(codes, code, now_ns=0, address="10.0.0.1"):
    with pytest.raises(PairingRefused) as caught:
        redeem(codes, code, now_ns, address)
    assert not code or code not in str(caught.value)
    return caught.value.status


def test_a_code_is_six_digits_and_good_once(codes):
    code, expires_ns = codes.make(Role.LOCAL, 5)
    assert len(code) == 6
    assert code.isdigit()
    assert expires_ns == 5 + CODE_NS
    assert redeem(codes, code) is Role.LOCAL
    assert status(codes, code) == 403


def test_a_code_ends_after_two_minutes(codes):
    code, expires_ns = codes.make(Role.REMOTE, 0)
    assert status(codes, code, expires_ns) == 403
    code, expires_ns = codes.make(Role.REMOTE, 0)
    assert redeem(codes, code, expires_ns - 1) is Role.REMOTE


def test_a_revoked_code_is_worth_nothing(codes):
    code, _ = codes.make(Role.REMOTE, 0)
    codes.revoke(code)
    codes.revoke("not there")
    assert status(codes, code) == 403


def test_guessing_from_one_address_is_refused_even_if_right(codes):
    code, _ = codes.make(Role.REMOTE, 0)
    for _ in range(MAX_WRONG):
        assert status(codes, wrong_of(code)) == 403
    assert status(codes, code) == 429
    assert redeem(codes, code, address="10.0.0.2") is Role.REMOTE


def test_the_refusal_ends_after_a_minute(codes):
    for _ in range(MAX_WRONG):
        status(codes, "x")
    code, _ = codes.make(Role.REMOTE, WINDOW_NS)
    assert status(codes, code, WINDOW_NS - 1) == 429
    assert redeem(codes, code, WINDOW_NS) is Role.REMOTE


def test_guessing_from_many_addresses_is_refused(codes):
    code, _ = codes.make(Role.REMOTE, 0)
    for number in range(MAX_WRONG_IN_ALL):
        assert status(codes, wrong_of(code), address=f"10.0.1.{number}") == 403
    assert status(codes, code, address="10.0.2.1") == 429


def test_a_slow_typist_is_not_refused(codes):
    for number in range(20):
        assert status(codes, "000", number * WINDOW_NS // 4) == 403


@pytest.mark.parametrize("code", ["", "12345", "1234567", "１２３４５６", "\ud800", "a" * 10_000])
def test_any_text_may_be_tried(codes, code):
    codes.make(Role.REMOTE, 0)
    assert status(codes, code) == 403


def test_what_is_remembered_has_a_limit(codes):
    for number in range(MAX_CODES + 5):
        codes.make(Role.REMOTE, number)
    assert len(codes._codes) == MAX_CODES
    for number in range(3 * MAX_ADDRESSES):
        status(codes, "x", 10 * number * WINDOW_NS, f"address {number}")
    assert len(codes._by_address) == MAX_ADDRESSES


def test_the_first_code_goes_where_there_are_too_many(codes):
    made = [codes.make(Role.REMOTE, 0)[0] for _ in range(MAX_CODES + 1)]
    assert status(codes, made[0]) == 403
    assert redeem(codes, made[1]) is Role.REMOTE


def test_the_same_code_is_not_given_twice():
    numbers = iter([1, 1, 1, 2])
    codes = PairingCodes(lambda _n: next(numbers))
    assert [codes.make(Role.REMOTE, 0)[0] for _ in range(2)] == ["000001", "000002"]
