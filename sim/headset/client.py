"""A simulated person with a headset: joins, moves at display rate, draws, listens, comes back."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import aiohttp
import numpy as np

from devices.hub.protocol.wire import encode_body
from sim.headset.answering import answer_all
from sim.headset.connection import (
    HubAddress,
    HubConnection,
    HubRefusedError,
    connect,
    fetch_page,
    pair,
)
from sim.headset.device import SAY_S, QuestDevice
from sim.headset.doings import Box, Doing, Message, doings, erased
from sim.headset.faults import HeadsetFault, HeadsetState, headset_state
from sim.headset.hearing import Hearing
from sim.headset.moves import Moves, filmed, place_in_film
from sim.headset.room_download import RoomDownload
from sim.headset.tally import Tally
from sim.headset.voice.speech import NO_SPEECH, Speaking, Speech

if TYPE_CHECKING:
    from sim.headset.scripted import Script, ScriptedPerson

RATE_HZ = 72.0
"""Bodies a second: the display rate of a Quest 3."""

RETRY_S = 0.5
"""Time between two attempts to connect, as of the web client."""

GIVE_UP_NS = 60_000_000_000
"""Time without a hub after which somebody leaves: a room whose program has ended."""

LOOK_S = 0.02
"""Time between two looks at the faults of somebody who sends nothing."""

PING_S = 1.0
"""Time between two pings, of which the fastest gives the hub's clock."""

DRAW_EVERY_S, DRAW_S, DRAW_HZ = 10.0, 2.0, 10.0
"""Time between two doings of a person, how long one takes, and how often it is sent meanwhile."""

STAMP, STAMP_AT = struct.Struct("<IQ"), 4
"""Number and device time, and where they are."""


@dataclass(frozen=True, slots=True)
class ClientPlan:
    """One person.

    Attributes:
        address: of the hub.
        name: shown to the others.
        moves: of the body.
        rate_hz: bodies a second.
        faults: between the person and the hub.
        draws: whether they draw, put, propose and carry things.
        script: what they do in place of moves and lines by chance; None for those.
        speech: whether they speak and listen, and how.
        answers: whether they answer what a study asks.
    """

    address: HubAddress
    name: str
    moves: Moves
    rate_hz: float = RATE_HZ
    faults: tuple[HeadsetFault, ...] = ()
    draws: bool = True
    script: Script | None = None
    speech: Speech = NO_SPEECH
    answers: bool = False


class HeadsetClient:
    """A person; `join` once, then `stay`.

    Args:
        http: shared by everybody of the process.
        plan: of the person.
        tally: takes the figures.
        now_ns: clock of this process.
    """

    def __init__(
        self,
        http: aiohttp.ClientSession,
        plan: ClientPlan,
        *,
        tally: Tally,
        now_ns: Callable[[], int] = time.perf_counter_ns,
    ) -> None:
        self._http, self._plan, self._tally, self._now_ns = http, plan, tally, now_ns
        self._random = np.random.default_rng(plan.moves.seed)
        self._scripted = None if plan.script is None else plan.script.person()
        self._film = filmed(plan.moves, plan.rate_hz) if self._scripted is None else []
        self._hearing = Hearing(tally, self._scripted, now_ns=now_ns)
        self._room = RoomDownload(http, plan.address)
        self._rest: asyncio.Task[None] | None = None
        self._joined_ns = self._seq = self._boxes = 0

    async def join(self, code: str) -> HubConnection:
        """Fetch the page, pair, fetch what the room is recognised by, and connect.

        Raises:
            HubRefusedError: the hub does not let them in.
            aiohttp.ClientError, TimeoutError, OSError: the hub is not reached.
        """
        begun_ns = self._now_ns()
        await fetch_page(self._http, self._plan.address)
        self._hearing.token = await pair(
            self._http, self._plan.address, code=code, name=self._plan.name
        )
        has_room = await self._room.fetch_first(self._hearing.token)
        connection = await self._connect(log_seq=None)
        self._joined_ns = self._now_ns()
        self._tally.joins_s.append((self._joined_ns - begun_ns) / 1e9)
        if has_room:
            self._rest = asyncio.create_task(self._fetch_rest(begun_ns))
        return connection

    async def _fetch_rest(self, begun_ns: int) -> None:
        """Fetch the rest of the room while the person is there already."""
        try:
            await self._room.fetch_rest(self._hearing.token)
        except (HubRefusedError, aiohttp.ClientError, TimeoutError, OSError) as error:
            self._tally.failures.append(f"{self._plan.name}: {error}")
            return
        self._tally.wholes_s.append((self._now_ns() - begun_ns) / 1e9)
        self._tally.downloaded_bytes += self._room.received_bytes

    async def stay(self, connection: HubConnection, over: asyncio.Event) -> None:
        """Take part until it is over, or the hub says goodbye; come back when it breaks.

        Raises:
            HubRefusedError: the hub does not let them in again.
        """
        answering = asyncio.create_task(self._answer())
        try:
            await self._stay(connection, over)
        finally:
            answering.cancel()
            if self._rest is not None:
                self._rest.cancel()

    async def _answer(self) -> None:
        if (plan := self._plan).answers:
            http, seed = self._http, plan.moves.seed
            await answer_all(http, plan.address, token=lambda: self._hearing.token, seed=seed)

    async def _stay(self, connection: HubConnection, over: asyncio.Event) -> None:
        while True:
            why = await self._take_part(connection, over)
            if over.is_set() or why:
                await connection.close()
                if why and not over.is_set():
                    self._tally.failures.append(f"{self._plan.name}: {why}")
                return
            old, back_ns = connection, self._now_ns()
            while self._faults().is_cut and not over.is_set():
                await asyncio.sleep(LOOK_S)
                back_ns = self._now_ns()
            again = await self._return(over)
            await old.close()
            if again is None:
                return
            connection = again
            self._tally.returns_s.append((self._now_ns() - back_ns) / 1e9)

    def _faults(self) -> HeadsetState:
        return headset_state(self._plan.faults, self._here_s())

    async def _connect(self, *, log_seq: int | None) -> HubConnection:
        connection = await connect(
            self._http,
            self._plan.address,
            token=self._hearing.token,
            name=self._plan.name,
            log_seq=log_seq,
        )
        self._hearing.take_welcome(connection)
        return connection

    async def _return(self, over: asyncio.Event) -> HubConnection | None:
        """Connect again, until it is over."""
        # Somebody tries at their own moments, not at the network's.
        await asyncio.sleep(RETRY_S * float(self._random.random()))
        since_ns = self._now_ns()
        while not over.is_set():
            try:
                return await self._connect(log_seq=self._hearing.log_seq)
            except (aiohttp.ClientError, TimeoutError, OSError) as error:
                if self._now_ns() - since_ns > GIVE_UP_NS:
                    why = f"no hub for {GIVE_UP_NS / 1e9:g} s: {error}"
                    self._tally.failures.append(f"{self._plan.name}: {why}")
                    return None
            await asyncio.sleep(RETRY_S)
        return None

    async def _take_part(self, connection: HubConnection, over: asyncio.Event) -> str:
        """Send and listen until it is over or breaks; return the hub's goodbye, if any."""
        works = [
            asyncio.ensure_future(work)
            for work in (
                self._listen(connection),
                self._move(connection),
                self._ping(connection),
                self._say_device(connection),
                self._draw(connection),
                self._notice_cut(),
                self._speak(connection),
                _until(over),
            )
        ]
        try:
            done, _ = await asyncio.wait(works, return_when=asyncio.FIRST_COMPLETED)
            for work in done:
                error = work.exception()
                if error is not None and not isinstance(error, ConnectionError):
                    raise error
            heard = works[0]
            ended = heard.done() and heard.exception() is None
            return heard.result() if ended else ""
        finally:
            for work in works:
                work.cancel()
            await asyncio.gather(*works, return_exceptions=True)

    async def _speak(self, connection: HubConnection) -> str:
        """Speak and listen, where that is wanted, until the connection ends."""
        plan = self._plan
        if not plan.speech.is_on:
            await asyncio.Event().wait()
        speaking = Speaking(connection, plan.speech, seed=plan.moves.seed, tally=self._tally)
        self._hearing.speaking = speaking
        try:
            await speaking.go_on(lambda: self._faults().shows_body)
        finally:
            self._hearing.speaking = None
            await speaking.close()
        return ""

    async def _notice_cut(self) -> str:
        while not self._faults().is_cut:
            await asyncio.sleep(LOOK_S)
        return ""

    async def _move(self, connection: HubConnection) -> str:
        """Send bodies at display rate."""
        step_s = 1.0 / self._plan.rate_hz
        due_s = self._now_ns() / 1e9 + step_s * float(self._random.random())
        while True:
            await asyncio.sleep(max(due_s - self._now_ns() / 1e9, 0.0))
            # After a stall there are fewer bodies, not several at once.
            due_s = max(due_s + step_s, self._now_ns() / 1e9)
            faults = self._faults()
            self._seq += 1
            if not faults.shows_body or self._random.random() < faults.loss:
                self._tally.left_out += 1
                continue
            body = self._body()
            if faults.jitter_s:
                await asyncio.sleep(faults.jitter_s * float(self._random.random()))
            await connection.send_bytes(bytes(body))
            self._tally.sent += 1

    def _body(self) -> bytearray:
        """Return the body of this moment."""
        t_us = self._now_ns() // 1000
        if self._scripted is not None:
            body = self._scripted.body(self._here_s(), seq=self._seq, t_us=t_us)
            return bytearray(encode_body(body))
        body = self._film[place_in_film(self._seq, len(self._film))]
        STAMP.pack_into(body, STAMP_AT, self._seq, t_us)
        return body

    def _here_s(self) -> float:
        """Return the time since this person joined."""
        return (self._now_ns() - self._joined_ns) / 1e9

    async def _ping(self, connection: HubConnection) -> str:
        while True:
            await connection.send({"kind": "ping", "t_us": self._now_ns() // 1000})
            await asyncio.sleep(PING_S)

    async def _say_device(self, connection: HubConnection) -> str:
        """Say how the headset is, as a page does."""
        role = str(connection.welcome["role"])
        device = QuestDevice(seed=self._plan.moves.seed, role=role)
        while True:
            await asyncio.sleep(SAY_S)
            here_s, faults = self._here_s(), self._faults()
            said = device.said(here_s, pictures=self._seq, faults=faults)
            if said is not None:
                await connection.send(said)

    async def _draw(self, connection: HubConnection) -> str:
        """Do as the script says, or something now and then, and take away what was before."""
        welcome, seed = connection.welcome, self._plan.moves.seed
        rights = welcome["rights"] if self._plan.draws else ()
        if self._scripted is not None and "line" in rights:
            await self._draw_as_scripted(connection, self._scripted)
        number, last = 0, None
        for doing in doings(rights, sorted(welcome["state"]["objects"]), seed=seed):
            await asyncio.sleep((DRAW_EVERY_S - DRAW_S) * (0.5 + float(self._random.random())))
            for message in self._endings(last):
                number += 1
                await connection.send({"kind": "do", "id": number, **message})
            for _ in range(max(2, round(DRAW_S * DRAW_HZ))):
                await asyncio.sleep(1.0 / DRAW_HZ)
                if self._faults().shows_body:
                    number += 1
                    message = doing.step(self._plan.moves.pen(self._here_s()))
                    await connection.send({"kind": "do", "id": number, **message})
            last = doing
        await asyncio.Event().wait()  # somebody who may do nothing looks on
        return ""

    def _endings(self, last: Doing | None) -> list[Message]:
        """Return what ends a doing, and takes away what others have given.

        Every other box is handed to somebody, where somebody is there.
        """
        messages: list[Message] = [erased(key) for key in self._hearing.gifts]
        if isinstance(last, Box):
            self._boxes += 1
            if takers := self._hearing.takers if self._boxes % 2 else ():
                taker = takers[int(self._random.integers(len(takers)))]
                return [*messages, last.given(taker)]
        return messages if last is None else [*messages, last.end()]

    async def _draw_as_scripted(self, connection: HubConnection, person: ScriptedPerson) -> None:
        """Send lines as they grow, for ever."""
        while True:
            if self._faults().shows_body:
                for line in person.new_things(self._here_s()):
                    await connection.send(line)
            await asyncio.sleep(1.0 / DRAW_HZ)

    async def _listen(self, connection: HubConnection) -> str:
        """Take what comes; return the hub's goodbye, empty where there is none."""
        while True:
            while self._faults().is_asleep:
                await asyncio.sleep(LOOK_S)
            message = await connection.receive()
            if message is None:
                return ""
            if goodbye := await self._hearing.take(connection, message):
                return goodbye


async def _until(over: asyncio.Event) -> str:
    await over.wait()
    return ""
