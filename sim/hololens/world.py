"""Clock, world, wearer and faults of a simulated HoloLens, which all its ports share."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from devices.clock import Clock
from devices.hololens.wire.packets import TICK_NS
from scenes.pose import Pose, rotation_from_vector
from sim.hololens.faults import HoloLensFaultKind, HoloLensFaults
from sim.hololens.wearer import Wearer, WornBody

BOOTED_NS = 98_765_432_100_000
"""Reading of the headset's clock when the simulator begins: it was switched on a day ago."""

TICKS_1970 = 116_444_736_000_000_000
"""1970 in ticks of 100 ns since 1601, from which the headset counts coordinated time."""

HEAD_FROM_CAMERA = Pose(rotation_from_vector([-0.06, 0.0, 0.0]), np.array([0.01, -0.05, 0.07]))
"""Pose of the camera in the headset: above the eyes, tilted a little, OpenCV axes."""

HANG_UP, STALL = HoloLensFaultKind.HANG_UP, HoloLensFaultKind.STALL


@dataclass(slots=True)
class Counts:
    """Tally of a port."""

    connections: int = 0
    messages: int = 0
    refused: int = 0


@dataclass(slots=True, eq=False)
class HeadsetWorld:
    """A headset on somebody's head in a room.

    Attributes:
        clock: session time.
        wearer: whose head it is on.
        faults: what goes wrong when.
        seed: of where its world lies in the room.
        utc_ns: coordinated time when the simulator begins, since 1970.
        glass_ns: any clock of the machine, to be burnt into pictures.
        stop: set once all ends.
        camera_on_ns: since when the camera runs; None while it is off.
        began_ns: when the simulator began.
    """

    clock: Clock
    wearer: Wearer
    faults: HoloLensFaults
    seed: int
    utc_ns: int
    glass_ns: Callable[[], int]
    stop: threading.Event = field(default_factory=threading.Event)
    camera_on_ns: int | None = None
    began_ns: int = 0
    _room_from_start: Pose = field(default_factory=Pose.identity)

    def __post_init__(self) -> None:
        self.began_ns = self.clock.now_ns()
        yaw = float(np.random.default_rng(self.seed).uniform(-math.pi, math.pi))
        self._room_from_start = Pose.from_yaw(yaw, self.wearer.at(0.0).world_from_head.translation)

    def seconds(self, t_ns: int) -> float:
        """Return the time since the simulator began."""
        return (t_ns - self.began_ns) * 1e-9

    def now_s(self) -> float:
        """Return the present time since the simulator began."""
        return self.seconds(self.clock.now_ns())

    def ticks(self, t_ns: int) -> int:
        """Return a session time on the headset's own clock."""
        since_ns = t_ns - self.began_ns
        return (BOOTED_NS + since_ns + round(since_ns * self.faults.drift_ppm * 1e-6)) // TICK_NS

    def utc_ticks(self, t_ns: int) -> int:
        """Return a session time as coordinated time."""
        return TICKS_1970 + (self.utc_ns + t_ns - self.began_ns) // TICK_NS

    def room_from_world(self, t_s: float) -> Pose:
        """Return where the headset's world, z up, lies in the room."""
        aside = np.array([self.faults.shift_m(t_s), 0.0, 0.0])
        return self._room_from_start @ Pose(np.eye(3), aside)

    def body(self, t_s: float) -> WornBody | None:
        """Return the wearer in the room; None while the headset is lost."""
        return None if self.is_lost(t_s) else self.wearer.at(t_s)

    def is_lost(self, t_s: float) -> bool:
        """Whether the headset does not know where it is."""
        return self.faults.is_there(HoloLensFaultKind.LOST, t_s)

    def room_from_camera(self, t_s: float) -> Pose:
        """Return where its camera is, OpenCV axes."""
        return self.wearer.at(t_s).world_from_head @ HEAD_FROM_CAMERA

    def camera_is_on(self) -> bool:
        """Whether the camera was started and not stopped."""
        return self.camera_on_ns is not None

    def camera_runs(self) -> bool:
        """Whether the camera has started."""
        on_ns = self.camera_on_ns
        return on_ns is not None and self.clock.now_ns() >= on_ns

    def is_hung_up(self) -> bool:
        """Whether no connection is held."""
        return self.stop.is_set() or self.faults.is_there(HANG_UP, self.now_s())

    def is_stalled(self) -> bool:
        """Whether nothing is sent."""
        return self.faults.is_there(STALL, self.now_s())
