"""Checks of the local user's headset before going live, each with what to do."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from devices.hololens.values import StreamName, StreamState, StreamStatus
from studio.live.hololens.worn import WornHeadset
from studio.session.preflight import Check, Probe

FIRST_S = 4.0
"""Seconds that a headset may take to send its first data: it starts its camera first."""

POLL_S = 0.05
"""Seconds between two looks at the headset."""

MIN_VIDEO_HZ, MIN_BODY_HZ = 10.0, 20.0
"""Rates below which codes are missed while the wearer turns, and hands are seen to jump."""

LOW_PERCENT = 20.0
"""Battery at which a session of half an hour may not be finished."""

Sleep = Callable[[float], None]

START = "start the hl2ss program on the headset, allow its camera and eye tracking there"
"""Remedy where nothing comes."""


def headset_checks(worn: WornHeadset, *, sleep: Sleep = time.sleep) -> Mapping[str, Probe]:
    """Return the checks of a headset, by name."""
    return {
        "headset": lambda: _connected(worn, sleep),
        "headset video": lambda: _rate(worn, StreamName.VIDEO, least_hz=MIN_VIDEO_HZ, sleep=sleep),
        "headset hands": lambda: _rate(worn, StreamName.BODY, least_hz=MIN_BODY_HZ, sleep=sleep),
        "headset origin": lambda: _origin(worn, sleep),
        **({"headset battery": lambda: _battery(worn)} if _battery_of(worn) is not None else {}),
    }


def _connected(worn: WornHeadset, sleep: Sleep) -> Check:
    name, host = "headset", worn.plan.headset.host
    _wait(lambda: _is_sending(worn, StreamName.CLOCK), sleep)
    status = worn.headset.status()
    clock = status.streams.get(StreamName.CLOCK)
    if clock is None or clock.state is not StreamState.LIVE:
        why = f"{host}: {clock.reason or 'no answer'}" if clock is not None else host
        fix = f"{START}; is {host} its address, and is it in the same network?"
        return Check(name, "WARN", why, fix)
    version = "" if status.version is None else ".".join(map(str, status.version))
    offset = status.clock
    known = "" if offset is None else f", clock to ±{offset.offset_sigma_ns / 1e6:.1f} ms"
    return Check(name, "PASS", f"{host}: program {version or 'of unknown version'}{known}")


def _rate(worn: WornHeadset, stream: StreamName, *, least_hz: float, sleep: Sleep) -> Check:
    name = {StreamName.VIDEO: "headset video", StreamName.BODY: "headset hands"}[stream]
    _wait(lambda: _is_sending(worn, stream), sleep)
    status = _stream(worn, stream)
    if status is None or status.state is not StreamState.LIVE:
        reason = "nothing sent yet" if status is None else status.reason or str(status.state)
        fix = START if stream is StreamName.VIDEO else f"{START}; answer its consent dialog"
        return Check(name, "WARN", reason, fix)
    delay = "" if status.delay_ms is None else f", {status.delay_ms:.0f} ms old"
    found = f"{status.rate_hz:.0f} a second{delay}"
    if 0.0 < status.rate_hz < least_hz:
        return Check(name, "WARN", found, "move nearer to the access point, or use 5 GHz Wi-Fi")
    return Check(name, "PASS", found)


def _origin(worn: WornHeadset, sleep: Sleep) -> Check:
    name = "headset origin"
    _wait(lambda: worn.anchoring.status().is_known, sleep)
    status = worn.anchoring.status()
    if not worn.anchoring.has_codes:
        fix = "film the room with printed codes (docs/capture), or nothing is drawn in its place"
        return Check(name, "FAIL", "the room has no printed codes", fix)
    if not status.is_known or status.sigma_mm is None or status.sigma_deg is None:
        return Check(name, "WARN", "no code seen yet", "look at one of the room's codes from 2 m")
    found = f"to ±{status.sigma_mm:.0f} mm, {status.sigma_deg:.2f}°"
    if status.moved:
        codes = ", ".join(status.moved)
        return Check(name, "WARN", f"{found}; moved: {codes}", "hang it where it was in the scan")
    if not worn.anchoring.is_good:
        return Check(name, "WARN", found, "look at a second code, or go nearer to the first")
    return Check(name, "PASS", found)


def _battery_of(worn: WornHeadset) -> float | None:
    return worn.headset.status().battery_percent


def _battery(worn: WornHeadset) -> Check:
    percent = _battery_of(worn) or 0.0
    found = f"{percent:.0f} %"
    if percent <= LOW_PERCENT:
        return Check("headset battery", "WARN", found, "charge it, or wear it with a power bank")
    return Check("headset battery", "PASS", found)


def _stream(worn: WornHeadset, stream: StreamName) -> StreamStatus | None:
    return worn.headset.status().streams.get(stream)


def _is_sending(worn: WornHeadset, stream: StreamName) -> bool:
    status = _stream(worn, stream)
    return status is not None and status.state is StreamState.LIVE


def _wait(is_there: Callable[[], bool], sleep: Sleep) -> None:
    waited_s = 0.0
    while not is_there() and waited_s < FIRST_S:
        sleep(POLL_S)
        waited_s += POLL_S
