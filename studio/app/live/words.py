"""How a live session is doing, in a shape, a word and a sentence, and what to do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from devices.camera.received import CameraState
from devices.insta360.condition import LOW_BATTERIES
from devices.messages import Event
from studio.live.status import TRACKS, LiveState, LiveStatus
from studio.session.trackers.camera_events import SOURCE, event_kind
from tracking.output import CameraMoment

MOVED_SHOWN_S = 20.0
"""Seconds for which a camera that was found again by itself is mentioned: time to look at the twin
and to see whether objects stand where they should."""

MOVED = frozenset({(SOURCE, event_kind(CameraMoment.BUMPED)), ("session", "camera-refused")})
"""Source and kind of events after which somebody should look whether objects are where they are."""

LOST = frozenset({(SOURCE, event_kind(CameraMoment.NOT_FOUND)), ("session", "camera-refused")})
"""Of events that say why nobody knows where the camera is."""

PLACED = ("session", "camera-placed")
"""Of the event that says that the camera was found by a search."""


@dataclass(frozen=True, slots=True)
class Light:
    """A state as people see it.

    Attributes:
        kind: of the theme's colours and shapes.
        word: the state.
    """

    kind: str
    word: str


OBJECTS = {"occluded": "hidden", "static": "at rest", "tracked": "followed"}
"""States of tracking as people read them; others stay."""

IDLE = Light("calm", "not connected")

LIGHTS = {
    LiveState.CONNECTING: Light("unknown", "connecting"),
    LiveState.CONFIRMING: Light("warning", "confirming"),
    LiveState.PLACING: Light("unknown", "placing"),
    LiveState.REFUSED: Light("bad", "refused"),
    LiveState.FINDING: Light("unknown", "finding objects"),
    LiveState.READY: Light("good", "ready"),
    LiveState.LIVE: Light("good", "live"),
    LiveState.ENDED: Light("calm", "ended"),
}
"""By state, while the camera's pictures come."""


class Help(StrEnum):
    """Actions of a banner's button."""

    NONE = ""
    FIND = "Find the camera again"


@dataclass(frozen=True, slots=True)
class Banner:
    """Something that somebody must know or do.

    Attributes:
        kind: of the theme's colours and shapes.
        text: what is so, and what to do.
        help: what a button offers.
    """

    kind: str
    text: str
    help: Help = Help.NONE


def light_of(status: LiveStatus) -> Light:
    """The state of a session; a camera whose pictures stop comes first."""
    if status.state is not LiveState.ENDED:
        if status.camera.state is CameraState.FAILED:
            return Light("bad", "failed")
        if status.camera.state is CameraState.HELD and status.state is not LiveState.CONNECTING:
            return Light("warning", "held")
        if status.is_camera_lost:
            return Light("bad", "camera lost")
    return LIGHTS[status.state]


def banner_of(status: LiveStatus, events: Sequence[Event], *, now_ns: int) -> Banner | None:
    """The most important fault; None if there is none.

    Args:
        status: of the session.
        events: of the session, oldest first.
        now_ns: session time.
    """
    if status.state is LiveState.ENDED:
        return None
    if status.camera.state is CameraState.FAILED:
        return Banner("bad", f"No camera: {status.camera.reason}. End, and correct the address.")
    if status.recording_failure:
        return Banner("bad", f"Nothing is recorded any more: {status.recording_failure}")
    if status.state not in TRACKS:
        return None
    if status.camera.state is CameraState.HELD:
        reason = status.camera.reason
        return Banner(
            "warning",
            f"No picture comes ({reason}): objects stay where they were. It connects again by "
            "itself; look after the camera's power, its app and the Wi-Fi.",
        )
    battery = None if status.condition is None else status.condition.battery
    if battery is not None and battery <= min(LOW_BATTERIES) and not status.is_camera_lost:
        return Banner("warning", f"The camera's battery is at {battery:.0%}: plug it in.")
    return _banner_of_place(status, events, now_ns)


def _banner_of_place(status: LiveStatus, events: Sequence[Event], now_ns: int) -> Banner | None:
    """Banner of the camera's place."""
    newest = list(reversed(events))
    if status.is_camera_lost:
        lost = (event.text for event in newest if (event.source, event.kind) in LOST)
        text = _sentence(next(lost, "it is not known where the camera is"))
        return Banner("bad", text, Help.FIND)
    for event in newest:
        if now_ns - event.t_ns > MOVED_SHOWN_S * 1e9 or (event.source, event.kind) == PLACED:
            return None
        if (event.source, event.kind) in MOVED:
            text = f"{_sentence(event.text)} If objects stand beside their places:"
            return Banner("warning", text, Help.FIND)
    return None


def objects_words(status: LiveStatus, name: Callable[[str], str]) -> str:
    """How many objects are in which state, and of those that are lost why.

    Args:
        status: of the session.
        name: what the object of an id is called.
    """
    found = status.objects or {}
    if not found:
        return "no objects in this room"
    counts = ", ".join(
        f"{count} {OBJECTS.get(state, state)}" for state, count in sorted(found.items())
    )
    lost = "; ".join(f"{name(object_id)} is lost: {why}" for object_id, why in status.lost.items())
    return f"objects: {counts}. {lost}".rstrip(". ")


def _sentence(text: str) -> str:
    return f"{begun_with_a_capital(text).rstrip('.')}."


def begun_with_a_capital(text: str) -> str:
    """A sentence as it begins; addresses stay as they are."""
    first = text.partition(" ")[0].rstrip(":,;")
    return f"{text[:1].upper()}{text[1:]}" if first.isalpha() else text


def age_words(age_ns: int | None) -> str:
    """How long ago something was."""
    return "–" if age_ns is None else f"{age_ns / 1e9:.1f} s ago"


def elapsed_words(seconds: float) -> str:
    """A duration as a clock shows it."""
    whole = int(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def size_words(size_bytes: int) -> str:
    """Size of a file."""
    return f"{size_bytes / 1e6:.1f} MB"
