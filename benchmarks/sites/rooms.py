"""All rooms of a simulated building in one process: `python -m benchmarks.sites.rooms`."""

from __future__ import annotations

import sys
import time

import numpy as np

from benchmarks.sites.orders import (
    OBJECTS,
    STATE_HZ,
    Counted,
    Orders,
    name_of,
    read_orders,
    say,
    stamp_now,
)
from devices.clock import WallClock
from devices.sites.about import RoomAbout
from devices.transport.keys import MemberRole
from devices.transport.zenoh_transport import ZenohTransport
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState
from scenes.workers.task import Task
from studio.live.sites.shared_room import SharedRoom

COVARIANCE = np.eye(4)
"""Of every object; it does not travel."""


def state_at(step: int) -> SceneState:
    """Return a state in which every object moves; the first one's place tells when it was made."""
    objects = {
        f"object {number}": TrackedObject(
            f"object {number}",
            step,
            Pose.from_yaw(0.01 * step, (stamp_now() if number == 0 else number, 0.001 * step, 0)),
            COVARIANCE,
            1.0,
            TrackState.TRACKED,
            0.9,
            step,
        )
        for number in range(OBJECTS)
    }
    return SceneState(step, step, objects)


def run_rooms(orders: Orders) -> None:
    """Share so many rooms until standard input ends."""
    ways = [
        Counted(ZenohTransport(orders.router, orders.pass_of(MemberRole.ROOM, number)))
        for number in range(orders.rooms)
    ]
    rooms = [
        SharedRoom(
            way,
            name_of(number),
            about=RoomAbout("lab", ""),
            inner=None,
            hub=lambda: None,
            clock=WallClock(),
            epoch=time.time_ns(),
            say=lambda line: print(line, file=sys.stderr),
        )
        for number, way in enumerate(ways)
    ]
    for room in rooms:
        room.start()
    say(event="up")
    driving = Task("states", lambda task: _drive(rooms, task)).start()
    for _line in sys.stdin:
        totals = [sum(getattr(way, name) for way in ways) for name in ("sent", "sent_bytes")]
        say(event="counts", sent=totals[0], sent_bytes=totals[1])
    driving.cancel()
    driving.join()
    for room in rooms:
        room.close()
    for way in ways:
        way.close()


def _drive(rooms: list[SharedRoom], task: Task[None]) -> None:
    """Let every room have its states, each room between the others."""
    begin_s, step = time.monotonic(), 0
    while not task.is_cancelled:
        for number, room in enumerate(rooms):
            due_s = begin_s + (step + number / len(rooms)) / STATE_HZ
            task.pause(max(0.0, due_s - time.monotonic()))
            room.publish(state_at(step + 1))
            room.take()
        step += 1


if __name__ == "__main__":
    run_rooms(read_orders())
