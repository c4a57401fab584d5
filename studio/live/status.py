"""How a live session is doing, as one immutable answer for windows, terminals and reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from devices.camera.lenses.search import FoundLayout
from devices.camera.received import CameraStatus
from devices.clock_mapping import ClockEstimate
from devices.insta360.condition import CameraCondition
from studio.live.placing import PlacedCamera
from studio.session.latency import StageTime


class LiveState(StrEnum):
    """Where a live session is on its way.

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
