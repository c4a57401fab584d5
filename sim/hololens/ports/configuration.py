"""Port 3809 of a simulated HoloLens: questions and settings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from devices.hololens.wire.packets import TICK_NS
from devices.hololens.wire.remote_configuration import (
    Request,
    Setting,
    TimeSource,
    Values,
    encode_reply,
    read_request,
    reply_layout,
)
from devices.hololens.wire.taking import WireError
from sim.hololens.axes import NOT_LOCATED, camera_rows
from sim.hololens.ports.serving import Guest, HeadsetPort
from sim.hololens.world import BOOTED_NS, Counts, HeadsetWorld

VERSION = (1, 0, 37, 0)
"""Version of the program that it behaves as."""

GREY_FOCAL_PX, GREY_MIDDLE_PX = 450.0, (320.0, 240.0)
"""Lens of the grey cameras, whose points are mapped: about what the headset's are."""

TO_PLANE, TO_PICTURE = 0, 1
"""Operations on points: from a picture to the plane at depth 1, and back."""


class ConfigurationPort:
    """Remote configuration.

    Args:
        place: host and port.
        world: what all ports share.

    Attributes:
        settings: the last values of each setting.

    Raises:
        OSError: the port is taken.
    """

    def __init__(self, place: tuple[str, int], world: HeadsetWorld) -> None:
        self._world = world
        self.settings: dict[Setting, Values] = {}
        self.counts = Counts()
        self._port = HeadsetPort(
            place, world, serve=self._serve, name="hololens configuration", counts=self.counts
        )

    @property
    def number(self) -> int:
        """The real number of the port."""
        return self._port.number

    def close(self) -> None:
        """Stop; waits for the thread."""
        self._port.close()

    def _serve(self, guest: Guest) -> None:
        while True:
            guest.message_ended()
            request = read_request(guest.take)
            guest.delay()
            if reply_layout(request).size:
                guest.send(encode_reply(request, self._answer(request)))
            else:
                self.settings[request.setting] = request.values
            self.counts.messages += 1

    def _answer(self, request: Request) -> Values:
        world = self._world
        now_ns = world.clock.now_ns()
        match request.setting:
            case Setting.VERSION:
                return VERSION
            case Setting.UTC_OFFSET:
                return (world.utc_ticks(world.began_ns) - world.ticks(world.began_ns),)
            case Setting.VIDEO_STATUS:
                return (int(world.camera_runs()),)
            case Setting.TIME:
                is_utc = request.values[0] == TimeSource.UTC
                return (world.utc_ticks(now_ns) if is_utc else world.ticks(now_ns),)
            case Setting.MAP_POINTS:
                return tuple(_mapped(request))
            case Setting.RIG_POSES:
                return tuple(value for ticks in request.following for value in self._rig(ticks))
            case _:
                raise WireError(f"{request.setting.name}: has no answer")

    def _rig(self, ticks: int) -> list[float]:
        """Sixteen numbers of where the headset was at a time of its own."""
        t_s = (ticks * TICK_NS - BOOTED_NS) * 1e-9
        # What lies before the beginning or an hour ahead, nobody knows.
        if not -1.0 <= t_s <= self._world.now_s() + 3600.0 or self._world.is_lost(t_s):
            return [float(value) for value in NOT_LOCATED.ravel()]
        room_from_world = self._world.room_from_world(t_s)
        head = room_from_world.inverse() @ self._world.wearer.at(t_s).world_from_head
        return [float(value) for value in camera_rows(head).ravel()]


def _mapped(request: Request) -> Iterator[float]:
    points = np.array(request.following, dtype=np.float64).reshape(-1, 2)
    middle = np.array(GREY_MIDDLE_PX)
    with np.errstate(all="ignore"):
        if request.values[1] == TO_PLANE:
            points = (points - middle) / GREY_FOCAL_PX
        else:
            points = points * GREY_FOCAL_PX + middle
    limit = float(np.finfo(np.float32).max)
    yield from np.clip(np.nan_to_num(points), -limit, limit).ravel().tolist()
