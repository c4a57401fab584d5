"""Everybody at all sites in one process: `python -m benchmarks.sites.clients`.

Reads its orders, then the hubs' addresses and a code for each person.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from dataclasses import dataclass, field
from typing import Any

import aiohttp
import numpy as np

from benchmarks.sites.orders import Orders, age_s, read_orders, say
from benchmarks.wire.crowd import STAMPS, STAMPS_AT
from sim.wire.people_messages import valid_bodies

WARM_S = 1.5
"""Seconds in which nothing is counted: everybody comes in."""

MAX_AGES = 1_000_000
"""Ages that are kept: 32 people at 30 Hz for a quarter of an hour."""


@dataclass(slots=True)
class _Seen:
    sent: int = 0
    states: int = 0
    received_bytes: int = 0
    ages_s: list[float] = field(default_factory=list[float])


async def run_clients(orders: Orders, urls: list[str], *, codes: list[list[str]]) -> None:
    """Let everybody join, move, and say how old the states were that came."""
    seen = _Seen()
    async with aiohttp.ClientSession() as http:
        sockets = [
            await _join(http, url, code=code)
            for url, of_hub in zip(urls, codes, strict=True)
            for code in of_hub
        ]
        counts_from_s = time.monotonic() + WARM_S
        readers = [
            asyncio.ensure_future(_read(s, seen, counts_from_s=counts_from_s)) for s in sockets
        ]
        say(event="in")
        await asyncio.gather(
            *(
                _move(socket, orders, seen=seen, share=number / len(sockets))
                for number, socket in enumerate(sockets)
            )
        )
        for socket in sockets:
            await socket.close()
        await asyncio.gather(*readers)
    p50, p95, p99 = np.percentile(np.asarray(seen.ages_s or [np.nan]), (50, 95, 99)) * 1000
    say(
        event="ended",
        sent=seen.sent,
        states=seen.states,
        received_bytes=seen.received_bytes,
        age_ms=[float(p50), float(p95), float(p99)],
    )


async def _join(
    http: aiohttp.ClientSession, url: str, *, code: str
) -> aiohttp.ClientWebSocketResponse:
    async with http.post(f"{url}pair", json={"code": code, "name": "somebody"}) as reply:
        reply.raise_for_status()
        token = (await reply.json())["token"]
    socket = await http.ws_connect(f"{url}people")
    await socket.send_json({"kind": "hello", "token": token})
    return socket


async def _move(
    socket: aiohttp.ClientWebSocketResponse, orders: Orders, *, seen: _Seen, share: float
) -> None:
    """Send bodies at their times, each person between the others."""
    body = bytearray(valid_bodies()[0])
    begin_s = time.monotonic() + share / orders.hz
    for seq in range(1, round((orders.seconds + WARM_S) * orders.hz) + 1):
        await asyncio.sleep(max(0.0, begin_s + seq / orders.hz - time.monotonic()))
        STAMPS.pack_into(body, STAMPS_AT, seq, time.perf_counter_ns() // 1000)
        await socket.send_bytes(bytes(body))
        seen.sent += 1


async def _read(
    socket: aiohttp.ClientWebSocketResponse, seen: _Seen, *, counts_from_s: float
) -> None:
    async for message in socket:
        is_counted = time.monotonic() >= counts_from_s
        if is_counted:
            seen.received_bytes += len(message.data)
        if message.type is not aiohttp.WSMsgType.TEXT:
            continue
        fields: dict[str, Any] = json.loads(message.data)
        if fields["kind"] != "state":
            continue
        await socket.send_json({"kind": "seen", "version": fields["version"]})
        first = fields["objects"].get("object 0")
        if is_counted and first and len(seen.ages_s) < MAX_AGES:
            seen.states += 1
            seen.ages_s.append(age_s(float(first[0])))


if __name__ == "__main__":
    given = read_orders()
    orders: dict[str, Any] = json.loads(sys.stdin.readline())
    asyncio.run(run_clients(given, orders["urls"], codes=orders["codes"]))
