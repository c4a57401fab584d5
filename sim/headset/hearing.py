"""Messages that come to a simulated person: counted, timed against the hub's clock, acted upon."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from devices.hub.protocol.wire import WireError, decode_body, unpack_bodies
from sim.headset.connection import HubConnection
from sim.headset.tally import Tally
from sim.headset.voice.speech import Speaking

if TYPE_CHECKING:
    from sim.headset.scripted import ScriptedPerson

DECODED_EVERY = 100
"""One in so many bodies that come is read in full, chosen: a defect shows within a second."""

MAX_GIFTS = 64
"""Shapes that one person may have."""

HEADER = struct.Struct("<BBHIQ")
"""Version, kind, flags, number and device time of a body in bytes."""


class Hearing:
    """Everything that one person has received.

    Args:
        tally: takes the figures.
        scripted: acts as a script says; None for somebody who moves by chance.
        now_ns: clock of this process.

    Attributes:
        token: the newest one, to come back with.
        log_seq: number of the newest entry of the log.
        speaking: of somebody who does; None meanwhile.
        takers: ids of the others to whom shapes can be given.
        gifts: names of shapes that somebody has given them, the oldest first.
    """

    def __init__(
        self, tally: Tally, scripted: ScriptedPerson | None, *, now_ns: Callable[[], int]
    ) -> None:
        self._tally, self._scripted, self._now_ns = tally, scripted, now_ns
        self.token, self.log_seq = "", 0
        self.speaking: Speaking | None = None
        self.takers: tuple[str, ...] = ()
        self.gifts: deque[str] = deque(maxlen=MAX_GIFTS)
        self._you = ""
        self._since_hub_us: tuple[float, float] | None = None
        """Round trip of the fastest ping; this process's clock minus the hub's; microseconds."""

    def take_welcome(self, connection: HubConnection) -> None:
        """Take the first message of a connection."""
        welcome = connection.welcome
        self.token, self.log_seq = str(welcome["token"]), int(welcome["log_seq"])
        self._tally.indices.add(int(welcome["index"]))
        self._tally.connections += 1
        self._you = str(welcome["you"])
        self._take_people(welcome["people"])
        if self._scripted is not None:
            self._scripted.take_whole(welcome["state"]["objects"])

    async def take(self, connection: HubConnection, message: dict[str, Any] | bytes) -> str:
        """Take a message; return the hub's goodbye, empty where it is none."""
        if isinstance(message, bytes):
            if self.speaking is None or not self.speaking.take_voices(message):
                self._take_bodies(message)
        elif message.get("kind") == "bye":
            return str(message.get("why", "goodbye"))
        else:
            await self._take_text(connection, message)
        return ""

    def _take_people(self, people: list[dict[str, Any]]) -> None:
        self.takers = tuple(p["id"] for p in people if p["takes"] and p["id"] != self._you)

    def _take_shape(self, entry: dict[str, Any]) -> None:
        key = str(entry["primitive"])
        is_gift = (
            entry["by"] == self._you and entry["shape"] and not key.startswith(f"{self._you}/")
        )
        if is_gift and key not in self.gifts:
            self.gifts.append(key)
        elif not is_gift and key in self.gifts:
            self.gifts.remove(key)

    def _take_bodies(self, data: bytes) -> None:
        tally, now_us = self._tally, self._now_ns() // 1000
        try:
            bodies = unpack_bodies(data)
            for index, body in bodies:
                _version, _kind, _flags, seq, t_us = HEADER.unpack_from(body)
                if seq % DECODED_EVERY == 0:
                    decode_body(body)
                if index in tally.indices:
                    tally.hand.add((now_us - t_us) / 1000)
        except (WireError, struct.error):
            tally.unreadable += 1
            return
        tally.received += len(bodies)

    async def _take_text(self, connection: HubConnection, said: dict[str, Any]) -> None:
        tally, now_us = self._tally, self._now_ns() / 1000
        match said.get("kind"):
            case "state":
                tally.states += 1
                if self._scripted is not None:
                    self._scripted.take(said["objects"])
                if self._since_hub_us is not None:
                    tally.state.add((now_us - self._since_hub_us[1] - said["t_us"]) / 1000)
                await connection.send({"kind": "seen", "version": said["version"]})
            case "log":
                tally.log += 1
                self.log_seq = int(said["seq"])
                if said["op"] == "primitive":
                    self._take_shape(said)
            case "people":
                self._take_people(said["people"])
            case "pong":
                trip_us = now_us - said["t_us"]
                if self._since_hub_us is None or trip_us <= self._since_hub_us[0]:
                    middle_us = 0.5 * (now_us + said["t_us"])
                    self._since_hub_us = (trip_us, middle_us - said["hub_t_us"])
            case "answer":
                if self.speaking is not None:
                    await self.speaking.take_answer(said)
            case "token":
                self.token = str(said["token"])
            case "done":
                tally.done += 1
            case "refused":
                tally.refused += 1
            case _:
                return
