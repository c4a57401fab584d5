"""A remote person who points at legs of objects, and what of it is seen on a simulated headset."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
from numpy.typing import NDArray

from devices.hub.protocol.wire import Body, encode_body
from scenes.frames import OPENGL_FROM_OPENCV, WORLD_FROM_GLTF, look_at
from scenes.mesh import PhysicalObject
from scenes.pose import Pose
from scenes.workers.task import Task
from sim.headset.connection import HubAddress, HubConnection, HubRefusedError, connect, pair
from sim.headset.device import SAY_S, QuestDevice
from sim.headset.faults import HeadsetState
from sim.hololens.simulator import Simulator
from studio.live.hololens.showing.display import RAY_END_M

Floats = NDArray[np.float64]

RATE_HZ = 72.0
"""Bodies a second: the display rate of a Quest 3."""

DWELL_S = 1.6
"""Seconds for which one leg is pointed at: what is seen settles in a tenth of it."""

LEG_Z_M = 0.2
"""Height of the place on a leg, metres: clear of the floor, below the seat."""

SETTLED_NS, SAID_NS = 400_000_000, 100_000_000
"""Time after the ray's turn to a leg from which it is where it stays, and time between two places
of it that are said, nanoseconds."""

ARRIVED_M = 0.06
"""Distance from the place at which the ray's end counts as seen there: legs are farther apart."""

LOOK_S, REST_S = 0.004, 0.02
"""Seconds between two looks at what the headset shows: until a ray is seen, to 4 ms, and
afterwards, five times for each place that is said."""

EYE_M = (0.4, -0.6, 1.6)
"""Eye of the person, from the middle of the first object, metres."""

GLTF_FROM_WORLD = WORLD_FROM_GLTF.inverse()
"""Turn from the world's axes to upright ones, as they are on the wire."""

Say = Callable[[dict[str, Any]], None]


def leg_of(item: PhysicalObject) -> Floats:
    """Return (3,) a place on a leg in an object's frame: a corner of its lowest part."""
    points = np.concatenate([mesh.vertices for mesh in item.meshes])
    height = min(LEG_Z_M, 0.5 * item.box_m[2])
    low = points[points[:, 2] <= height + 0.05]
    corner = low[int(np.argmax(low[:, 0] + low[:, 1]))]
    return np.array([corner[0], corner[1], height])


class Pointer:
    """Joins a hub and points, on a thread; says what was seen of it.

    Args:
        words: address and code, and the root certificate's file where there is one.
        legs: (3,) by object id, in the object's frame.
        simulator: the headset.
        say: takes a message.
    """

    def __init__(
        self, words: Sequence[str], legs: Mapping[str, Floats], *, simulator: Simulator, say: Say
    ) -> None:
        self._address = HubAddress(words[0], Path(words[2]) if len(words) > 2 else None)
        self._code, self._legs, self._simulator, self._say = words[1], legs, simulator, say
        self._objects: dict[str, Pose] = {}
        self._aim: tuple[str, Floats] | None = None
        self._aimed_ns = 0
        self._task = Task("pointing", self._run, expected=Exception)

    def start(self) -> None:
        """Join."""
        self._task.start()

    def end(self) -> None:
        """Leave."""
        self._task.cancel()
        self._task.join(2.0)

    def _run(self, task: Task[None]) -> None:
        try:
            asyncio.run(self._point(task))
        except (HubRefusedError, aiohttp.ClientError, OSError, TimeoutError) as error:
            self._say({"event": "failed", "text": f"the person who points: {error}"})

    async def _point(self, task: Task[None]) -> None:
        async with self._address.opened() as http:
            token = await pair(http, self._address, code=self._code, name="Pointer")
            hub = await connect(http, self._address, token=token, name="Pointer")
            self._take(hub.welcome["state"]["objects"])
            listening = asyncio.create_task(self._listen(hub))
            try:
                await asyncio.gather(self._send(hub, task), self._watch(task))
            finally:
                listening.cancel()
                await hub.close()

    async def _listen(self, hub: HubConnection) -> None:
        while (said := await hub.receive()) is not None:
            if isinstance(said, dict) and said.get("kind") == "state":
                self._take(said["objects"])
                await hub.send({"kind": "seen", "version": said["version"]})

    def _take(self, objects: Mapping[str, Any]) -> None:
        for name, values in objects.items():
            if values is not None:
                pose = Pose.from_quaternion(np.roll(values[3:7], 1), values[:3])
                self._objects[name] = WORLD_FROM_GLTF @ pose @ GLTF_FROM_WORLD

    async def _send(self, hub: HubConnection, task: Task[None]) -> None:
        """Point at one leg after another, at display rate; say how the headset is."""
        device = QuestDevice(seed=0, role=str(hub.welcome["role"]))
        seq, since_s = 0, time.monotonic()
        due_s = since_s + SAY_S
        while not task.is_cancelled and not hub.is_closed:
            there = sorted(self._objects.keys() & self._legs.keys())
            if there:
                turn = int(time.monotonic() / DWELL_S)
                name = there[turn % len(there)]
                end = self._objects[name] @ self._legs[name]
                if self._aim is None or self._aim[0] != name:
                    self._aimed_ns = time.perf_counter_ns()
                self._aim = (name, end)
                await hub.send_bytes(encode_body(body_at(end, seq=seq)))
                seq += 1
            if (now_s := time.monotonic()) >= due_s:
                due_s = now_s + SAY_S
                if said := device.said(now_s - since_s, pictures=seq, faults=HeadsetState()):
                    await hub.send(said)
            await asyncio.sleep(1.0 / RATE_HZ)

    async def _watch(self, task: Task[None]) -> None:
        """Say when each leg was first seen pointed at, and where it was seen in the end."""
        done_ns = said_ns = 0
        before: tuple[str, Floats] | None = None
        while not task.is_cancelled:
            await asyncio.sleep(REST_S if done_ns == self._aimed_ns else LOOK_S)
            aim, aimed_ns = self._aim, self._aimed_ns
            if aim is None:
                continue
            now_ns = time.perf_counter_ns()
            shown = self._shown_at(aim[1])
            is_there = shown is not None and float(np.linalg.norm(shown - aim[1])) < ARRIVED_M
            if is_there and done_ns != aimed_ns:
                done_ns = aimed_ns
                if before is not None:
                    ms = (now_ns - aimed_ns) / 1e6
                    self._say({"event": "pointed", "ms": ms, "object": aim[0]})
                before = aim
            is_settled = now_ns - aimed_ns > SETTLED_NS and now_ns - said_ns > SAID_NS
            if is_there and shown is not None and is_settled:
                said_ns = now_ns
                leg = self._legs[aim[0]].tolist()
                said = {"event": "seen", "perf_ns": now_ns, "object": aim[0], "leg": leg}
                self._say({**said, "at": shown.tolist()})

    def _shown_at(self, near: Floats) -> Floats | None:
        """Return where the end of a ray is truly seen in the room: of several, the nearest."""
        room_from_world = self._simulator.room_from_world()
        ends = [
            room_from_world @ each.world_from_item.translation
            for each in self._simulator.holograms.shown()
            if each.shape == 0 and float(np.abs(each.scale - RAY_END_M).max()) < 1e-4
        ]
        return min(ends, key=lambda end: float(np.linalg.norm(end - near)), default=None)


def body_at(end: Floats, *, seq: int) -> Body:
    """Return a person who stands beside a place and points at it.

    Args:
        end: (3,) the place, world metres.
        seq: number of the body.
    """
    eye = np.array([end[0] + EYE_M[0], end[1] + EYE_M[1], EYE_M[2]])
    head = GLTF_FROM_WORLD @ look_at(eye, end) @ OPENGL_FROM_OPENCV
    hand = eye + np.array([0.0, 0.1, -0.35])
    ray = GLTF_FROM_WORLD @ np.stack([hand, end])
    return Body(seq, time.perf_counter_ns() // 1000, head, ray=ray)
