"""Checks before going live: the camera's stream and its light, the headset, the machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from devices.camera.received import CameraState, Received
from devices.hub.attendance import PageHeadset
from devices.insta360.condition import LOW_BATTERIES
from studio.live.hololens.checks import headset_checks
from studio.live.live import LiveSession
from studio.live.people.headsets import headset_probes
from studio.session.preflight import Check, Probe, checks_for

FIRST_PICTURE_S = 3.0
"""Seconds that a camera may take to its first picture, as operators are promised."""

STEADY_S = 1.0
"""Seconds over which pictures are counted."""

MIN_FPS = 5.0
"""Pictures a second below which an object carried at walking pace, 1.2 m/s, moves by more than its
own width between two pictures."""

DARK, BRIGHT = 0.12, 0.85
"""Share of the brightness range in which the median pixel of a picture should lie: darker, noise
covers edges; brighter, surfaces are white all over."""

BLACK = 0.04
"""Share of the brightness range up to which a pixel counts as outside the lens circles."""

JUDGED_PIXELS = 200_000
"""Pixels of a picture that are judged, evenly over it: the median is exact to a thousandth."""

CLIPPED_SHARE = 0.25
"""Share of a picture's pixels at either end of the range from which details are missing."""

POLL_S = 0.05

Sleep = Callable[[float], None]


def live_checks(
    session: LiveSession,
    *,
    recordings: Path,
    sleep: Sleep = time.sleep,
    simulated: Callable[[], str] | None = None,
    headsets: Sequence[PageHeadset] = (),
) -> Mapping[str, Probe]:
    """The checks of a live session, by name.

    Args:
        session: its camera is being received already.
        recordings: folder that the recording goes into.
        sleep: waits, seconds.
        simulated: says how far a simulated camera is that is made ready by itself; None for a real
            one, which somebody must start.
        headsets: of people who have joined by the page.
    """
    machine = dict(checks_for(recordings=recordings))
    machine.pop("camera")
    machine.pop("display")
    return {
        "camera": lambda: _camera(session, sleep, simulated),
        "stream": lambda: _stream(session, sleep, is_simulated=simulated is not None),
        "light": lambda: _light(session, sleep),
        **({"battery": lambda: _battery(session)} if session.status().condition else {}),
        **({} if session.worn is None else headset_checks(session.worn, sleep=sleep)),
        **headset_probes(headsets),
        **machine,
    }


def _camera(session: LiveSession, sleep: Sleep, simulated: Callable[[], str] | None) -> Check:
    picture = _first_picture(session, sleep)
    status = session.status()
    if picture is not None:
        size = f"{status.camera.size_px[0]}×{status.camera.size_px[1]} px"
        return Check("camera", "PASS", f"{status.camera.codec}, {size}")
    if simulated is not None:
        fix = "wait: it begins by itself; its pictures are kept for the next time"
        return Check("camera", "WARN", f"the simulated camera is made ready: {simulated()}", fix)
    if status.listening_at and status.camera.state is not CameraState.FAILED:
        fix = f"enter {status.listening_at} in the camera's app and start streaming there"
        return Check("camera", "WARN", f"nothing sent yet ({status.camera.reason})", fix)
    fix = "switch it on, and check address and network; docs/devices says how for each camera"
    return Check("camera", "FAIL", status.camera.reason, fix)


def _stream(session: LiveSession, sleep: Sleep, *, is_simulated: bool) -> Check:
    if _first_picture(session, sleep) is None:
        return Check("stream", "WARN", "no picture to judge", "see the camera's line")
    before = session.status().camera
    sleep(STEADY_S)
    after = session.status().camera
    fps = (after.pictures - before.pictures) / STEADY_S
    damaged = after.damaged - before.damaged
    found = f"{fps:.0f} pictures a second, {after.damaged} damaged"
    if is_simulated and (fps < MIN_FPS or damaged):
        return Check("stream", "WARN", found, "close other programs: this computer plays it, too")
    if fps < MIN_FPS:
        fix = "move the camera or its phone nearer to the access point, or lower its bitrate"
        return Check("stream", "WARN", found, fix)
    if damaged:
        return Check("stream", "WARN", found, "use a cable, or another Wi-Fi channel")
    return Check("stream", "PASS", found)


def _light(session: LiveSession, sleep: Sleep) -> Check:
    picture = _first_picture(session, sleep)
    if picture is None:
        return Check("light", "WARN", "no picture to judge", "see the camera's line")
    shown = picture.pictures[0]
    black, span = (0.0, 255.0) if shown.is_full_range else (16.0, 219.0)
    luma = (shown.y.ravel()[:: max(1, shown.y.size // JUDGED_PIXELS)] - black) / span
    # Outside the lens circles a picture is black: only what is inside is judged.
    inside = luma[luma > BLACK]
    if inside.size < 100:
        return Check("light", "FAIL", "the picture is black", "take the lens cap off; light on")
    middle = float(np.median(inside))
    clipped = float(np.mean(inside > 0.98))
    found = f"median brightness {middle:.0%}, {clipped:.0%} of it white"
    if middle < DARK:
        return Check("light", "WARN", found, "switch the lights on that were on in the scan")
    if middle > BRIGHT or clipped > CLIPPED_SHARE:
        return Check("light", "WARN", found, "lower the camera's exposure, or close the blinds")
    return Check("light", "PASS", found)


def _battery(session: LiveSession) -> Check:
    condition = session.status().condition
    if condition is None or condition.battery is None:
        return Check("battery", "WARN", "the camera does not say it", "look at the camera")
    if condition.battery <= max(LOW_BATTERIES):
        return Check("battery", "WARN", condition.text, "plug the camera in")
    return Check("battery", "PASS", condition.text)


def _first_picture(session: LiveSession, sleep: Sleep) -> Received | None:
    """The camera's newest picture; None if none came in time."""
    waited_s = 0.0
    while session.picture is None and waited_s < FIRST_PICTURE_S:
        if session.status().camera.state in (CameraState.FAILED, CameraState.ENDED):
            break
        sleep(POLL_S)
        waited_s += POLL_S
    return session.picture
