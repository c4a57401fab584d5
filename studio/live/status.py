"""State of a live session, one immutable answer for whoever shows it; its events; its result."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from devices.camera.lenses.search import FoundLayout
from devices.camera.received import CameraStatus
from devices.clock import Clock
from devices.clock_mapping import ClockEstimate
from devices.insta360.condition import CameraCondition
from devices.messages import Event
from studio.live.changes import Change
from studio.live.hololens.worn import WornStatus
from studio.live.placing import PlacedCamera
from studio.session.latency import Latencies, StageTime
from studio.session.session import SessionResult


class LiveState(StrEnum):
    """Stages of a live session.

    `CONNECTING` until the first picture; `CONFIRMING` while a person is asked how the picture holds
    the lenses; `PLACING` while camera and lenses are found; `REFUSED` where they were not, until
    somebody tries again; `FINDING` while objects are looked for; `READY` to go live; `LIVE`;
    `ENDED`.
    """

    CONNECTING = "connecting"
    CONFIRMING = "confirming"
    PLACING = "placing"
    REFUSED = "refused"
    FINDING = "finding"
    READY = "ready"
    LIVE = "live"
    ENDED = "ended"


MAX_EVENTS = 10_000
"""Events that the report lists; the oldest go first."""

TRACKS = frozenset({LiveState.FINDING, LiveState.READY, LiveState.LIVE})
"""States in which pictures are tracked and recorded."""


@dataclass(frozen=True, slots=True, eq=False)
class LiveStatus:
    """A live session at one moment.

    Attributes:
        state: in one word.
        text: what is being done, or what to do, in a sentence.
        camera: of the camera's receiver.
        listening_at: for a camera that pushes: the address to enter there; else empty.
        layout: of the camera's picture, once there is one; its first is used unless another one was
            chosen.
        placed: lenses and pose; None before they are found.
        stages: durations of the last pictures by stage; `whole` is from a picture's capture to its
            poses where the camera's stream has times, else from its last byte.
        frames: pictures that were tracked.
        dropped: pictures that came while the tracker was busy, after the first tracked one.
        objects: how many objects are in each state of tracking.
        lost: why each lost object is lost, by its id.
        live_s: seconds since it went live; None before.
        recording_failure: why nothing is recorded any more; empty while all is well.
        is_camera_lost: whether the camera stands nowhere near its old place or its view is blocked;
            objects keep their poses, and it is looked for.
        camera_clock: the camera's clock on the session's; None before enough was seen of it, or
            where the stream has no times.
        condition: battery, card and clock of a camera that says them; else None.
        headset: the local user's; None without one.
    """

    state: LiveState
    text: str
    camera: CameraStatus
    listening_at: str = ""
    layout: FoundLayout | None = None
    placed: PlacedCamera | None = None
    stages: tuple[StageTime, ...] = ()
    frames: int = 0
    dropped: int = 0
    objects: Mapping[str, int] | None = None
    lost: Mapping[str, str] = field(default_factory=dict[str, str])
    live_s: float | None = None
    recording_failure: str = ""
    is_camera_lost: bool = False
    camera_clock: ClockEstimate | None = None
    condition: CameraCondition | None = None
    headset: WornStatus | None = None


class Journal:
    """State and events of a live session; any thread writes and reads.

    Args:
        clock: session time.

    Attributes:
        state: how far the session is.
        text: what is being done, or what to do, in a sentence.
    """

    def __init__(self, clock: Clock) -> None:
        self.state, self.text = LiveState.CONNECTING, "waiting for the camera's first picture"
        self._clock = clock
        self._lock = threading.Lock()
        self._waiting: deque[Event] = deque(maxlen=MAX_EVENTS)
        self._events: deque[Event] = deque(maxlen=MAX_EVENTS)

    def say(self, state: LiveState, text: str) -> None:
        """Go over to a state, with a sentence about it."""
        self.state, self.text = state, text

    def note(self, kind: str, text: str) -> None:
        """Take an event of the session, to be recorded with the next picture."""
        self._waiting.append(Event(self._clock.now_ns(), "session", kind, text))

    def take_notes(self) -> tuple[Event, ...]:
        """Remove and return the events that wait for a picture, oldest first."""
        taken: list[Event] = []
        while self._waiting:
            taken.append(self._waiting.popleft())
        return tuple(taken)

    def add(self, events: Iterable[Event]) -> None:
        """Take events that came with a picture."""
        with self._lock:
            self._events.extend(events)

    def events(self) -> tuple[Event, ...]:
        """Return the events so far, oldest first."""
        with self._lock:
            return tuple(self._events)


@dataclass(frozen=True, slots=True, eq=False)
class LiveResult:
    """How a live session went.

    Attributes:
        session: pictures and durations; None where the camera was never ready.
        camera: the receiver's last word.
        placed: lenses and pose.
        duration_s: from the first tracked picture to the end.
        live_s: of these, seconds live.
        events: what happened, oldest first.
        changes: what people changed, oldest first.
        latencies: durations of all stages from a picture's last byte to its poses.
        recording: where it is recorded; None if it is not.
        recording_failure: why the recording is not whole; empty if it is.
        dropped: pictures that came while the tracker was busy, after the first tracked one.
    """

    session: SessionResult | None
    camera: CameraStatus
    placed: PlacedCamera | None
    duration_s: float
    live_s: float
    events: tuple[Event, ...]
    changes: tuple[Change, ...]
    latencies: Latencies
    recording: Path | None
    recording_failure: str
    dropped: int = 0
