"""Headsets of people who have joined by the page, as checks: each finding with what to do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from devices.hub.attendance import PageHeadset
from devices.hub.protocol.messages import Immersion
from devices.hub.roles import Role
from studio.session.preflight import Check, Probe

SILENT_S = 6.0
"""Age of what a page has said from which it is asleep: three of its messages, seconds."""

OLD_S = 1.0
"""Age of a wearer's newest head and hands from which the others see them stand still, seconds."""

MIN_RATE_HZ = 45.0
"""Pictures a second below which a wearer is likely to feel sick: half of a Quest's 90."""

MAX_ROUND_TRIP_MS = 150.0
"""Round trip above which pointing is seen too late: the bar of a point's whole way."""

LOW_PERCENT = 20.0
"""Battery at which a session of half an hour may not be finished."""

WAYS = {Immersion.NONE: "on its page", Immersion.VR: "in VR", Immersion.AR: "in AR"}
"""Places of the wearer, in words."""

UNSEEN = {
    Immersion.NONE: "press Enter VR on its page",
    Immersion.VR: "put it on, and look around until it knows the room",
    Immersion.AR: "lay the room on the real one: mark the codes that its page names",
}
"""Remedies where nobody has seen head or hands yet."""

ASPECTS = ("State", "Age", "Delay", "Pictures", "Battery")
"""Names of a headset's checks, in their order."""


def checks_of(headset: PageHeadset) -> tuple[Check, ...]:
    """Return how a headset is doing, a check for each of `ASPECTS`."""
    return (_state(headset), _age(headset), _delay(headset), _pictures(headset), _battery(headset))


def headset_probes(headsets: Sequence[PageHeadset]) -> Mapping[str, Probe]:
    """Return checks before going live of headsets that are there, by name."""
    found: dict[str, Probe] = {}
    for headset in headsets:
        person = headset.person
        for check in checks_of(headset):
            name = f"{person.name} ({person.person_id}) {check.name.lower()}"
            line = Check(name, check.verdict, check.what, check.fix)
            found[name] = partial(_as_found, line)
    return found


def _as_found(check: Check) -> Check:
    return check


def _state(headset: PageHeadset) -> Check:
    said, person = headset.said, headset.person
    where = f"{said.model or 'headset'}, {WAYS[said.immersion]}"
    if not person.is_connected:
        fix = "it comes back by itself within half a minute; is its Wi-Fi there?"
        return Check("State", "WARN", "connection lost", fix)
    if headset.said_age_s >= SILENT_S:
        what = f"{where}, asleep for {headset.said_age_s:.0f} s"
        return Check("State", "WARN", what, "put it on: its page rests while nobody wears it")
    if said.immersion is Immersion.NONE:
        button = "Enter AR" if person.role is Role.LOCAL else "Enter VR"
        return Check("State", "WARN", where, f"press {button} on its page")
    if not said.is_worn:
        fix = "put it on, close its menu, and look around until it knows the room"
        return Check("State", "WARN", f"{where}, not worn", fix)
    return Check("State", "PASS", where)


def _age(headset: PageHeadset) -> Check:
    age_s = headset.body_age_s
    if age_s is None:
        return Check("Age", "WARN", "no head or hands yet", UNSEEN[headset.said.immersion])
    what = f"{age_s:.1f} s ago"
    # On its page somebody who stands still sends a body a second.
    if age_s > (OLD_S if headset.said.immersion is not Immersion.NONE else SILENT_S):
        return Check("Age", "WARN", what, "wake the headset; is it where its Wi-Fi reaches?")
    return Check("Age", "PASS", what)


def _delay(headset: PageHeadset) -> Check:
    trip_ms = headset.person.latency_ms
    if trip_ms is None:
        return Check("Delay", "PASS", "not measured yet")
    what = f"{trip_ms:.0f} ms there and back"
    if trip_ms > MAX_ROUND_TRIP_MS:
        fix = "move nearer to the access point, or use 5 GHz Wi-Fi"
        return Check("Delay", "WARN", what, fix)
    return Check("Delay", "PASS", what)


def _pictures(headset: PageHeadset) -> Check:
    rate_hz = headset.said.rate_hz
    if rate_hz is None:
        return Check("Pictures", "PASS", "not counted yet")
    what = f"{rate_hz:.0f} a second"
    if rate_hz < MIN_RATE_HZ:
        fix = "close other tabs and programs on the headset, and let it cool down"
        return Check("Pictures", "WARN", what, fix)
    return Check("Pictures", "PASS", what)


def _battery(headset: PageHeadset) -> Check:
    percent, is_charging = headset.said.battery_percent, headset.said.is_charging
    if percent is None:
        return Check("Battery", "PASS", "not said by its browser")
    what = f"{percent:.0f} %{', charging' if is_charging else ''}"
    if percent <= LOW_PERCENT and not is_charging:
        return Check("Battery", "WARN", what, "charge it, or wear it with a power bank")
    return Check("Battery", "PASS", what)
