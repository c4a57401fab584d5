"""Remote configuration of the headset, and its clock by round trips, over one connection."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, field

from devices.clock import Clock
from devices.clock_mapping import ClockEstimate, ClockMapping, add_round_trip, estimate
from devices.hololens.links.connection import Connection, HeadsetError, StoppedError
from devices.hololens.links.health import StreamHealth
from devices.hololens.links.link import Link
from devices.hololens.plan import MAX_RETRY_S
from devices.hololens.values import StreamState
from devices.hololens.wire.packets import TICK_NS
from devices.hololens.wire.remote_configuration import (
    Request,
    Setting,
    TimeSource,
    Values,
    encode_request,
    read_reply,
)

FAST_S, SLOW_S = 0.05, 0.2
"""Seconds between round trips, at first and later. Of 20 a second the fastest is within a third of
the jitter of both ways; a drift of 50 ppm moves the offset by 10 µs in 0.2 s."""

FAST_TRIPS = 200
"""Round trips after each connection that come fast: 10 s."""

MAX_WAITING = 16
"""Questions that wait for the connection; more are refused."""

TIME = Request(Setting.TIME, (TimeSource.OWN,))
"""Question for the headset's clock, by which it stamps packets."""


@dataclass(slots=True)
class _Question:
    request: Request
    answered: threading.Event = field(default_factory=threading.Event)
    values: Values | None = None


class Configuration:
    """Asks the headset, and keeps its clock; starts at once.

    Args:
        address: of the port.
        clock: session time.
        retry_s: longest wait between two attempts to connect.
    """

    def __init__(
        self, address: tuple[str, int], clock: Clock, *, retry_s: float = MAX_RETRY_S
    ) -> None:
        self.health = StreamHealth("clock", clock)
        self._clock = clock
        self._mapping = ClockMapping()
        self._estimate: ClockEstimate | None = None
        self._version: tuple[int, int, int, int] | None = None
        self._waiting: deque[_Question] = deque()
        self._lock = threading.Lock()
        self._asked = threading.Event()
        self._link = Link(
            address,
            clock,
            health=self.health,
            talk=self._talk,
            name="hololens configuration",
            retry_s=retry_s,
        )

    @property
    def version(self) -> tuple[int, int, int, int] | None:
        """Version of the program on the headset; None before it has said so."""
        return self._version

    @property
    def estimate(self) -> ClockEstimate | None:
        """The headset's clock on the session's; None before the first answer."""
        return self._estimate

    def session_ns(self, ticks: int) -> int | None:
        """Return the session time of a time of the headset's; None before it is known."""
        found = self._estimate
        return None if found is None else found.session_ns(ticks * TICK_NS)

    def ask(self, request: Request, timeout_s: float) -> Values:
        """Return the answer to a command, flat; empty where it has none.

        Raises:
            HeadsetError: none came in time, or too many wait.
        """
        status = self.health.status()
        if status.state is StreamState.WAITING:
            raise HeadsetError(f"{request.setting.name}: not asked: {status.reason}")
        question = _Question(request)
        with self._lock:
            if len(self._waiting) >= MAX_WAITING:
                raise HeadsetError(f"{request.setting.name}: {MAX_WAITING} questions wait already")
            self._waiting.append(question)
        self._asked.set()
        if not question.answered.wait(timeout_s) or question.values is None:
            with self._lock:
                if question in self._waiting:
                    self._waiting.remove(question)
            raise HeadsetError(
                f"{request.setting.name}: no answer within {timeout_s:g} s: "
                f"{self.health.status().reason}"
            )
        return question.values

    def close(self) -> None:
        """Hang up; waits for the thread."""
        self._link.close()

    def _talk(self, connection: Connection) -> None:
        self._version = self._exchange(connection, Request(Setting.VERSION))[:4]
        trips = 0
        while not connection.is_stopped:
            self._answer_waiting(connection)
            self._round_trip(connection)
            trips += 1
            self._asked.wait(FAST_S if trips < FAST_TRIPS else SLOW_S)
            self._asked.clear()
        raise StoppedError

    def _answer_waiting(self, connection: Connection) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    return
                question = self._waiting.popleft()
            try:
                question.values = self._exchange(connection, question.request)
            finally:
                question.answered.set()

    def _round_trip(self, connection: Connection) -> None:
        sent_ns = self._clock.now_ns()
        (ticks,) = self._exchange(connection, TIME)
        received_ns = self._clock.now_ns()
        # Beyond this no clock of the system counts, and arithmetic on it would overflow.
        if ticks * TICK_NS < 1 << 62:
            self._mapping = add_round_trip(self._mapping, sent_ns, ticks * TICK_NS, received_ns)
            self._estimate = estimate(self._mapping)
        self.health.came(8, delay_ns=(received_ns - sent_ns) // 2)

    def _exchange(self, connection: Connection, request: Request) -> Values:
        connection.send(encode_request(request))
        return read_reply(connection.take, request)
