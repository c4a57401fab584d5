"""Values of a HoloLens: pictures, head and hands, surfaces, status, in the studio's axes and time.

"World" here is the headset's own: its origin is where the headset's program began, and moves where
the headset finds itself again. Its axes are the studio's: right-handed, z up, metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum

import numpy as np
from numpy.typing import NDArray

from devices.camera.stream_decoder import StreamPicture
from devices.clock_mapping import ClockEstimate
from scenes.cameras import Pinhole
from scenes.pose import Pose

Floats = NDArray[np.float64]

JOINTS = 26
"""Joints of a hand, as in OpenXR."""


class Joint(IntEnum):
    """Joints of a hand, in the order of the arrays of `HandJoints`."""

    PALM = 0
    WRIST = 1
    THUMB_METACARPAL = 2
    THUMB_PROXIMAL = 3
    THUMB_DISTAL = 4
    THUMB_TIP = 5
    INDEX_METACARPAL = 6
    INDEX_PROXIMAL = 7
    INDEX_INTERMEDIATE = 8
    INDEX_DISTAL = 9
    INDEX_TIP = 10
    MIDDLE_METACARPAL = 11
    MIDDLE_PROXIMAL = 12
    MIDDLE_INTERMEDIATE = 13
    MIDDLE_DISTAL = 14
    MIDDLE_TIP = 15
    RING_METACARPAL = 16
    RING_PROXIMAL = 17
    RING_INTERMEDIATE = 18
    RING_DISTAL = 19
    RING_TIP = 20
    LITTLE_METACARPAL = 21
    LITTLE_PROXIMAL = 22
    LITTLE_INTERMEDIATE = 23
    LITTLE_DISTAL = 24
    LITTLE_TIP = 25


@dataclass(frozen=True, slots=True, eq=False)
class PersonalVideoFrame:
    """One picture of the camera in the headset's forehead.

    Attributes:
        seq: counts encoded pictures of this headset from 0; gaps are drops.
        t_ns: when it was taken, session time; by arrival until the headset's clock is known.
        arrived_ns: when its last byte arrived, session time.
        picture: its planes; `picture.y` is the grey picture, without a conversion.
        camera: its intrinsics, which change with the focus.
        world_from_camera: where it was taken from, OpenCV axes; None where the headset was lost.
    """

    seq: int
    t_ns: int
    arrived_ns: int
    picture: StreamPicture
    camera: Pinhole
    world_from_camera: Pose | None

    @property
    def image(self) -> NDArray[np.uint8]:
        """(H, W, 3) uint8 RGB, converted anew at every call."""
        return self.picture.rgb()


@dataclass(frozen=True, slots=True, eq=False)
class Ray:
    """Half a line in the headset's world.

    Attributes:
        origin_m: (3,).
        direction: (3,), of length 1.
    """

    origin_m: Floats
    direction: Floats


@dataclass(frozen=True, slots=True, eq=False)
class HandJoints:
    """Joints of one hand, in the order of `Joint`.

    Attributes:
        positions_m: (26, 3) in the headset's world.
        rotations: (26, 3, 3) world from joint; a joint's axes are OpenXR's: -z to the fingertips,
            y out of the back of the hand.
        radii_m: (26,) from the joint to the skin.
        is_exact: (26,) bool, False where the headset guesses.
    """

    positions_m: Floats
    rotations: Floats
    radii_m: Floats
    is_exact: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class HeadAndHands:
    """Place and gaze of the wearer; None for what the headset does not see.

    Attributes:
        seq: counts samples from 0.
        t_ns: when it was measured, session time.
        arrived_ns: when it arrived.
        world_from_head: OpenCV axes: x right, y down, z to where the face looks.
        gaze: where the eyes look.
        left: hand.
        right: hand.
    """

    seq: int
    t_ns: int
    arrived_ns: int
    world_from_head: Pose | None
    gaze: Ray | None
    left: HandJoints | None
    right: HandJoints | None


@dataclass(frozen=True, slots=True, eq=False)
class SpatialSurface:
    """One surface of the room as the headset has meshed it.

    Attributes:
        id: of the headset, 32 hexadecimal digits; the same through all versions.
        version: grows with every change: the headset's own time of the update, 100 ns.
        t_ns: when this version was received, session time.
        vertices_m: (V, 3) in the surface's own axes.
        triangles: (T, 3) int32, counter-clockwise seen from the free side.
        world_from_surface: where it is; changes as the headset learns.
    """

    id: str
    version: int
    t_ns: int
    vertices_m: Floats
    triangles: NDArray[np.int32]
    world_from_surface: Pose

    @property
    def vertices_in_world_m(self) -> Floats:
        """(V, 3) in the headset's world."""
        return self.world_from_surface @ self.vertices_m


@dataclass(frozen=True, slots=True)
class SurfaceGone:
    """A surface that the headset no longer observes.

    Attributes:
        id: as in `SpatialSurface`.
        t_ns: when that was seen, session time.
    """

    id: str
    t_ns: int


SurfaceChange = SpatialSurface | SurfaceGone


class StreamName(StrEnum):
    """Ports of a headset that the studio uses, by name."""

    VIDEO = "video"
    BODY = "body"
    SURFACES = "surfaces"
    DISPLAY = "display"
    CLOCK = "clock"


class StreamState(StrEnum):
    """How one of the headset's ports is doing.

    `OFF` not asked for, `CONNECTING` until the first answer, `LIVE` while data come, `HELD` when
    they stopped, `WAITING` between attempts to connect, `CLOSED` after the end.
    """

    OFF = "off"
    CONNECTING = "connecting"
    LIVE = "live"
    HELD = "held"
    WAITING = "waiting"
    CLOSED = "closed"


@dataclass(frozen=True, slots=True)
class StreamStatus:
    """How one port is doing at one moment.

    Attributes:
        state: in one word.
        reason: why, in a sentence, with what to do where something can be done.
        last_age_ns: since the last packet; None before the first.
        rate_hz: packets a second lately.
        received: packets so far.
        received_bytes: bytes so far.
        dropped: packets that a newer one replaced before anybody took them.
        damaged: packets that could not be read or decoded.
        connections: how often it was connected.
        delay_ms: from the headset's stamp to arrival, median of the last ones; None before the
            headset's clock is known.
    """

    state: StreamState
    reason: str
    last_age_ns: int | None = None
    rate_hz: float = 0.0
    received: int = 0
    received_bytes: int = 0
    dropped: int = 0
    damaged: int = 0
    connections: int = 0
    delay_ms: float | None = None


@dataclass(frozen=True, slots=True)
class HeadsetStatus:
    """How a headset is doing at one moment.

    Attributes:
        host: its address.
        streams: by the names of `StreamName`.
        version: of the program on the headset; None before it has said so.
        clock: its clock on the session's; None before the first answer.
        surfaces: how many it observes.
        drawn: items on its display.
        battery_percent: None where it does not say, which its protocol does not.
    """

    host: str
    streams: Mapping[str, StreamStatus] = field(default_factory=dict[str, StreamStatus])
    version: tuple[int, int, int, int] | None = None
    clock: ClockEstimate | None = None
    surfaces: int = 0
    drawn: int = 0
    battery_percent: float | None = None

    @property
    def is_live(self) -> bool:
        """Whether everything that was asked for sends."""
        wanted = [s.state for s in self.streams.values() if s.state is not StreamState.OFF]
        return bool(wanted) and all(state is StreamState.LIVE for state in wanted)
