"""Many simulated people in one process, on one thread."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import aiohttp

from sim.headset.client import RATE_HZ, ClientPlan, HeadsetClient
from sim.headset.connection import HubAddress, HubRefusedError
from sim.headset.faults import HeadsetFault
from sim.headset.moves import Moves
from sim.headset.tally import Tally
from sim.headset.voice.speech import NO_SPEECH, Speech

if TYPE_CHECKING:
    from sim.headset.scripted import Script

MAX_CLIENTS = 256
"""People of one process: as many connections as a hub takes."""

NAMES = ("Ann", "Ben", "Cem", "Dora", "Eva", "Finn", "Gita", "Hugo")
"""Of the people, in turn."""


@dataclass(frozen=True, slots=True)
class CrowdPlan:
    """People who join.

    Attributes:
        address: of the hub.
        clients: how many.
        seconds: that they stay once all have joined; None until they are stopped.
        seed: of their moves, and of chance.
        rate_hz: bodies a second of each.
        faults: of each.
        draws: whether they draw, put, propose and carry things.
        scripts: what each does, where a scenario says; else they move by chance.
        speech: how many of them speak, and how.
        answers: whether the first of them answers what a study asks.

    Raises:
        ValueError: a number is out of range, or not that of the scripts.
    """

    address: HubAddress
    clients: int = 1
    seconds: float | None = None
    seed: int = 0
    rate_hz: float = RATE_HZ
    faults: tuple[HeadsetFault, ...] = ()
    draws: bool = True
    scripts: tuple[Script, ...] = ()
    speech: Speech = NO_SPEECH
    answers: bool = False

    def __post_init__(self) -> None:
        if not 1 <= self.clients <= MAX_CLIENTS:
            raise ValueError(f"clients {self.clients}: wanted 1 to {MAX_CLIENTS}")
        if self.seconds is not None and not self.seconds > 0:
            raise ValueError(f"seconds {self.seconds:g}: wanted more than 0")
        if not 1.0 <= self.rate_hz <= 120.0:
            raise ValueError(f"rate {self.rate_hz:g} Hz: wanted 1 to 120")
        if self.scripts and len(self.scripts) != self.clients:
            raise ValueError(f"clients {self.clients}: the scenario has {len(self.scripts)} people")

    def client(self, number: int) -> ClientPlan:
        """Return the plan of one of them."""
        name = f"{NAMES[number % len(NAMES)]} {number + 1}"
        script = self.scripts[number] if self.scripts else None
        return ClientPlan(
            self.address,
            name if script is None else script.settings.user_id,
            Moves(self.seed + number),
            self.rate_hz,
            self.faults,
            self.draws,
            script,
            speech=self.speech.of(number),
            answers=self.answers and number == 0,
        )


async def run_crowd(
    plan: CrowdPlan,
    codes: AsyncIterator[str],
    *,
    over: asyncio.Event,
    joined: Callable[[int], None] = lambda _count: None,
) -> Tally:
    """Let people join one after the other, each with a code, and stay.

    Args:
        plan: of all of them.
        codes: one for each; the next is asked for when the one before has been used.
        over: ends it.
        joined: takes how many are there, whenever somebody has joined.

    Raises:
        HubRefusedError: one of them is not let in.
        ValueError: there are too few codes.
        aiohttp.ClientError, TimeoutError, OSError: the hub is not reached.
    """
    tally = Tally()
    async with plan.address.opened() as http:
        stays: list[asyncio.Task[None]] = []
        try:
            for number in range(plan.clients):
                client = HeadsetClient(http, plan.client(number), tally=tally)
                # Making a person's moves takes a moment, in which the others go on.
                await asyncio.sleep(0)
                connection = await client.join(await _next(codes, plan, number=number))
                stays.append(asyncio.create_task(client.stay(connection, over)))
                joined(number + 1)
            await _wait(stays, over, seconds=plan.seconds)
        finally:
            over.set()
            ended = await asyncio.gather(*stays, return_exceptions=True)
    for result in ended:
        if isinstance(result, (HubRefusedError, aiohttp.ClientError)):
            tally.failures.append(str(result))
        elif isinstance(result, Exception):
            raise result
    return tally


async def _next(codes: AsyncIterator[str], plan: CrowdPlan, *, number: int) -> str:
    code = await anext(codes, None)
    if code is None:
        raise ValueError(f"codes: {number} for {plan.clients} people; each needs one of their own")
    return code


async def _wait(
    stays: list[asyncio.Task[None]], over: asyncio.Event, *, seconds: float | None
) -> None:
    """Return when it is over, the time is up, or nobody is left."""
    stopped = asyncio.create_task(over.wait())
    everybody = asyncio.gather(*stays, return_exceptions=True)
    await asyncio.wait([stopped, everybody], timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
    stopped.cancel()
    with suppress(asyncio.CancelledError):
        await stopped
