"""Many people in a session, in a process of their own: each moves at a display's rate.

`python -m benchmarks.wire.crowd` reads its orders as one line of JSON, asks for a code for each
person by printing "code", and prints its figures as JSON.
"""

from __future__ import annotations

import asyncio
import json
import struct
import sys
import time
from array import array
from dataclasses import asdict, dataclass, field
from typing import Any

import aiohttp
import numpy as np

from devices.hub.protocol.wire import BUNDLE_KIND, unpack_bodies
from sim.wire.people_messages import valid_bodies

STAMPS = struct.Struct("<IQ")
"""Sequence number and time of a body, after its flags."""

STAMPS_AT = 4
"""Their place in the bytes of a body."""

ASK = "code"
"""Printed for each person; a code is read then."""

MAX_TIMES = 2_000_000
"""Latencies that are kept: 16 people at 72 Hz for two minutes."""


@dataclass(frozen=True, slots=True)
class Orders:
    """A crowd to come.

    Attributes:
        url: of the hub.
        people: how many.
        hz: bodies a second of each.
        seconds: how long, once all are in.
        warm_s: seconds before that in which nothing is counted.
    """

    url: str
    people: int
    hz: float
    seconds: float
    warm_s: float = 1.0


@dataclass(slots=True)
class CrowdFigures:
    """How it went.

    Attributes:
        sent: bodies.
        received: bodies of others, of all clients together.
        bundles: messages in which they came.
        states: of the room, of all clients together.
        late: bodies sent over 5 ms after their time: the crowd itself is too slow.
        latency_ms: percentiles 50, 95, 99 and the largest from a body's being sent to its being
            read by another.
    """

    sent: int = 0
    received: int = 0
    bundles: int = 0
    states: int = 0
    late: int = 0
    latency_ms: list[float] = field(default_factory=list[float])


class _Crowd:
    def __init__(self, orders: Orders) -> None:
        self.orders, self.figures = orders, CrowdFigures()
        self._times_us = array("f")
        self._counts_from_us = 0
        self._is_over = False

    async def run(self) -> CrowdFigures:
        async with aiohttp.ClientSession(self.orders.url) as http:
            sockets = [await self._join(http, n) for n in range(self.orders.people)]
            self._counts_from_us = _now_us() + int(1e6 * self.orders.warm_s)
            readers = [asyncio.ensure_future(self._read(socket)) for socket in sockets]
            await asyncio.gather(*(self._move(s, n) for n, s in enumerate(sockets)))
            self._is_over = True
            for socket in sockets:
                await socket.close()
            await asyncio.gather(*readers)
        shares = np.percentile(np.asarray(self._times_us), (50, 95, 99, 100)) / 1000
        self.figures.latency_ms = [round(float(ms), 3) for ms in shares]
        return self.figures

    async def _join(
        self, http: aiohttp.ClientSession, number: int
    ) -> aiohttp.ClientWebSocketResponse:
        print(ASK, flush=True)
        code = sys.stdin.readline().strip()
        async with http.post("/pair", json={"code": code, "name": f"person {number}"}) as reply:
            reply.raise_for_status()
            token = (await reply.json())["token"]
        socket = await http.ws_connect("/people")
        await socket.send_json({"kind": "hello", "token": token})
        return socket

    async def _move(self, socket: aiohttp.ClientWebSocketResponse, number: int) -> None:
        """Send bodies at their times, each person between the others."""
        body = bytearray(valid_bodies()[0])
        period_s = 1.0 / self.orders.hz
        begin_s = time.perf_counter() + period_s * number / self.orders.people
        frames = round((self.orders.seconds + self.orders.warm_s) * self.orders.hz)
        for seq in range(1, frames + 1):
            due_s = begin_s + seq * period_s
            await asyncio.sleep(max(0.0, due_s - time.perf_counter()))
            now_us = _now_us()
            STAMPS.pack_into(body, STAMPS_AT, seq, now_us)
            await socket.send_bytes(bytes(body))
            if now_us >= self._counts_from_us:
                self.figures.sent += 1
                self.figures.late += now_us * 1e-6 - due_s > 0.005

    async def _read(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        async for message in socket:
            if message.type is aiohttp.WSMsgType.BINARY:
                self._take(message.data)
            elif message.type is aiohttp.WSMsgType.TEXT:
                fields: dict[str, Any] = json.loads(message.data)
                if fields["kind"] == "state":
                    self.figures.states += 1
                    await socket.send_json({"kind": "seen", "version": fields["version"]})
                elif fields["kind"] == "bye" and not self._is_over:
                    raise OSError(f"sent away: {fields['why']}")

    def _take(self, data: bytes) -> None:
        now_us = _now_us()
        if data[1] != BUNDLE_KIND or now_us < self._counts_from_us:
            return
        self.figures.bundles += 1
        for _index, body in unpack_bodies(data):
            _seq, sent_us = STAMPS.unpack_from(body, STAMPS_AT)
            self.figures.received += 1
            if len(self._times_us) < MAX_TIMES:
                self._times_us.append(now_us - sent_us)


def _now_us() -> int:
    return time.perf_counter_ns() // 1000


def main() -> None:
    """Read orders, follow them, print the figures."""
    orders = Orders(**json.loads(sys.stdin.readline()))
    print(json.dumps(asdict(asyncio.run(_Crowd(orders).run()))), flush=True)


if __name__ == "__main__":
    main()
