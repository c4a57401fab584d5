"""Headsets by the page as checks: every one that is not good says what to do."""

from dataclasses import replace

import pytest

from devices.hub.attendance import PageHeadset
from devices.hub.protocol.messages import DeviceSaid, Immersion
from devices.hub.roles import Person, Role
from studio.live.people.headsets import (
    ASPECTS,
    LOW_PERCENT,
    MAX_ROUND_TRIP_MS,
    MIN_RATE_HZ,
    SILENT_S,
    checks_of,
    headset_probes,
)

ADA = Person("p1", 1, "Ada", Role.REMOTE, latency_ms=12.0)
SAID = DeviceSaid("Quest 3", Immersion.VR, True, 72.0, 80.0, False)
GOOD = PageHeadset(ADA, SAID, 1.0, 0.02)


def not_good(headset):
    return {check.name: check for check in checks_of(headset) if check.verdict != "PASS"}


def test_a_headset_that_is_worn_is_good():
    checks = checks_of(GOOD)
    assert tuple(check.name for check in checks) == ASPECTS
    assert not_good(GOOD) == {}
    words = [check.what for check in checks]
    assert words == ["Quest 3, in VR", "0.0 s ago", "12 ms there and back", "72 a second", "80 %"]


def said(**fields):
    return replace(GOOD, said=replace(SAID, **fields))


@pytest.mark.parametrize(
    ("headset", "name", "fix"),
    [
        (said(immersion=Immersion.NONE, is_worn=False), "State", "Enter VR"),
        (
            replace(
                said(immersion=Immersion.NONE, is_worn=False),
                person=replace(ADA, role=Role.LOCAL),
            ),
            "State",
            "Enter AR",
        ),
        (said(is_worn=False), "State", "put it on"),
        (replace(GOOD, said_age_s=SILENT_S), "State", "put it on"),
        (replace(GOOD, person=replace(ADA, is_connected=False)), "State", "Wi-Fi"),
        (replace(GOOD, body_age_s=None), "Age", "look around"),
        (replace(said(immersion=Immersion.AR), body_age_s=None), "Age", "mark the codes"),
        (replace(GOOD, body_age_s=1.5), "Age", "wake"),
        (
            replace(GOOD, person=replace(ADA, latency_ms=MAX_ROUND_TRIP_MS + 1)),
            "Delay",
            "access point",
        ),
        (said(rate_hz=MIN_RATE_HZ - 1), "Pictures", "close other tabs"),
        (said(battery_percent=LOW_PERCENT), "Battery", "charge it"),
    ],
)
def test_all_that_is_not_good_says_what_to_do(headset, name, fix):
    found = not_good(headset)
    assert list(found) == [name]
    assert fix in found[name].fix


def test_what_a_browser_does_not_say_is_no_fault():
    assert not_good(said(battery_percent=None, rate_hz=None)) == {}
    assert not_good(said(battery_percent=5.0, is_charging=True)) == {}
    still = replace(said(immersion=Immersion.NONE), body_age_s=1.5)
    assert "Age" not in not_good(still), "who stands still on the page sends a body a second"
    assert not_good(replace(GOOD, person=replace(ADA, latency_ms=None))) == {}


def test_checks_before_going_live_are_by_person():
    other = replace(said(battery_percent=3.0), person=replace(ADA, person_id="p2"))
    probes = headset_probes([GOOD, other])
    assert len(probes) == 2 * len(ASPECTS), "two of one name are two headsets"
    bad = [probe() for probe in probes.values() if probe().verdict != "PASS"]
    assert [(check.name, check.what) for check in bad] == [("Ada (p2) battery", "3 %")]
    assert all(name == probe().name for name, probe in probes.items())
