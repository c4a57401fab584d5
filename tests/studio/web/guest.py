"""A second person in the room, without a browser: what a headset's program would send and get."""

from __future__ import annotations

import asyncio
import json
import threading
import time
from concurrent.futures import Future
from typing import Any

import aiohttp
import numpy as np

from devices.hub.protocol.wire import Body, Controller, Hand, encode_body
from scenes.pose import Pose, rotation_from_quaternion

ANSWER_WITHIN_S = 10.0
KEPT_EVERY_S = 0.05
FINGERS = (4, 5, 5, 5, 5)


class Guest:
    """A connection, served on a thread of its own.

    Args:
        url: of the hub.
        code: of an invitation.
        name: as others see it.
    """

    def __init__(self, url: str, code: str, name: str) -> None:
        self.messages: list[dict[str, Any]] = []
        self.bodies: list[bytes] = []
        self._seq = 0
        self._keeping: Future[None] | None = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()
        self._reading = self._run(self._join(url.rstrip("/"), code, name))

    def send(self, **parts: Any) -> None:
        """Send a body."""
        self._seq += 1
        t_us = time.monotonic_ns() // 1000
        self._run(self._socket.send_bytes(encode_body(Body(self._seq, t_us, **parts))))

    def keep(self, **parts: Any) -> None:
        """Send a body again and again, as a device does, in place of the one before."""
        self.stop()
        self._keeping = asyncio.run_coroutine_threadsafe(self._send_kept(parts), self._loop)

    def stop(self) -> None:
        """Send the body that is kept no more."""
        if self._keeping is not None:
            self._keeping.cancel()
            self._keeping = None

    def do(self, **fields: Any) -> None:
        """Ask for an operation."""
        self._seq += 1
        message = {"kind": "do", "id": self._seq, **fields}
        self._run(self._socket.send_str(json.dumps(message)))

    def close(self) -> None:
        self.stop()
        self._run(self._session.close())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _run(self, coroutine: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(ANSWER_WITHIN_S)

    async def _send_kept(self, parts: dict[str, Any]) -> None:
        while not self._socket.closed:
            self._seq += 1
            t_us = time.monotonic_ns() // 1000
            await self._socket.send_bytes(encode_body(Body(self._seq, t_us, **parts)))
            await asyncio.sleep(KEPT_EVERY_S)

    async def _join(self, url: str, code: str, name: str) -> asyncio.Task[None]:
        self._session = aiohttp.ClientSession()
        async with self._session.post(f"{url}/pair", json={"code": code, "name": name}) as answer:
            token = (await answer.json())["token"]
        self._socket = await self._session.ws_connect(f"{url}/people")
        await self._socket.send_str(json.dumps({"kind": "hello", "token": token, "name": name}))
        return asyncio.create_task(self._read())

    async def _read(self) -> None:
        async for message in self._socket:
            if message.type is aiohttp.WSMsgType.BINARY:
                self.bodies.append(message.data)
            elif message.type is aiohttp.WSMsgType.TEXT:
                self.messages.append(json.loads(message.data))


def facing(place: tuple[float, float, float], yaw: float) -> Pose:
    """A head or controller at a place (y up), turned to its left from -z."""
    turn = np.array([np.cos(yaw / 2), 0.0, np.sin(yaw / 2), 0.0])
    return Pose(rotation_from_quaternion(turn), np.array(place))


def open_hand(wrist: tuple[float, float, float], *, side: float) -> Hand:
    """A flat hand of ordinary size, fingers along -z; `side` is +1 of a right one, else -1."""
    joints, radii = [(0.0, 0.0, 0.0)], [0.012]
    for finger, bones in enumerate(FINGERS):
        across = side * (-0.035 + 0.018 * finger)
        for bone in range(bones):
            reach = 0.02 + 0.03 * bone if finger == 0 else 0.025 + 0.028 * bone
            away = across * (0.6 + 0.4 * min(bone, 2)) - side * (
                0.02 * bone if finger == 0 else 0.0
            )
            joints.append((away, 0.004 * bone - 0.003 * bone * bone, -reach * (1.2 if bone else 1)))
            radii.append(0.011 - 0.0015 * bone)
    return Hand(np.array(joints) + np.array(wrist), np.array(radii))


def controller(place: tuple[float, float, float], yaw: float) -> Controller:
    """A controller that points level."""
    pose = facing(place, yaw)
    return Controller(pose, pose)
