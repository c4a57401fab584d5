"""Simulated people in a live session, in a process of their own, and the figures that they give."""

from __future__ import annotations

import asyncio
import json
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

from devices.clock import Clock
from devices.hub.entry.tokens import TOKEN_NS, Ticket, Tokens
from devices.hub.roles import Role
from devices.hub.server import Hub
from scenes.memory import growth_percent, resident_kib
from scenes.workers.child_process import ChildProcess, module_command, module_environment
from scenes.workers.task import Task
from sim.headset.attacks import Attempt, attack
from sim.headset.connection import HubAddress, HubRefusedError
from studio.console.rows import Row, at_least, at_most

FRAME_TO_CLIENT_BAR_MS = 150.0
"""Milliseconds from a picture's arrival to its state at a client, 95th percentile: the promise."""

HAND_TO_CLIENT_BAR_MS = 20.0
"""Milliseconds from a body's sending to another client, 95th percentile: the promise."""

JOIN_BAR_S = 3.0
"""Seconds from opening the page until the room is recognisable: the promise."""

WHOLE_BAR_S = 15.0
"""Seconds from opening the page until all of the room is there: the promise."""

RSS_BAR_PERCENT = 2.0
"""Growth of memory, percent: as of a session without people."""

END_BEFORE_S = 2.0
"""Seconds before the session's end at which people leave, to give their figures."""

ATTACK_AFTER_S = 2.0
"""Seconds from the last one's joining to the attacks, whose guesses close the door to others."""

POLL_S = 0.5
"""Seconds between two looks at the session: forty in the shortest useful one. Of fifty threads and
ten processes the memory takes 3 ms to add up, beside what is measured."""

ANSWER_S = 10.0
"""Seconds that the process may take for its last figures."""

LAST_WORDS = 5
"""Lines of the process's errors that are kept."""

FIGURES = {
    "quest.state_ms.p50": ("live.frame_to_client_ms.p50", "ms", None),
    "quest.state_ms.p95": ("live.frame_to_client_ms.p95", "ms", FRAME_TO_CLIENT_BAR_MS),
    "quest.hand_ms.p50": ("live.hand_to_client_ms.p50", "ms", None),
    "quest.hand_ms.p95": ("live.hand_to_client_ms.p95", "ms", HAND_TO_CLIENT_BAR_MS),
    "quest.join_s": ("live.join_s", "s", JOIN_BAR_S),
    "quest.whole_s": ("live.join_whole_s", "s", WHOLE_BAR_S),
}
"""Figures of the process: their names here, units and bars."""


class Crowd:
    """Simulated people who join once the session is live.

    Args:
        hub: where they join.
        live_s: seconds since the session went live; None before.
        clients: how many.
        seconds: that the session is live; None for no end.
        clock: session time.
        tokens: the hub's, to make one that has expired.
        say: takes a line for the log.
        trusted: file of the hub's root certificate; None without TLS.
        scenario: they are its remote people, who do as it says; None for moves by chance.
        takes_part: whether they take part in a study: the first answers what is asked, and nobody
            tries what people may not.
    """

    def __init__(
        self,
        hub: Hub,
        live_s: Callable[[], float | None],
        *,
        clients: int,
        seconds: float | None,
        clock: Clock,
        tokens: Tokens,
        say: Callable[[str], None],
        trusted: Path | None = None,
        scenario: str | None = None,
        takes_part: bool = False,
    ) -> None:
        self._trusted, self._scenario, self._takes_part = trusted, scenario, takes_part
        self._hub, self._live_s = hub, live_s
        self._clients, self._seconds = clients, seconds
        self._clock, self._tokens, self._say = clock, tokens, say
        self._process: ChildProcess | None = None
        self._here = 0
        self._figures: dict[str, float] = {}
        self._failures: list[str] = []
        self._rss_kib: list[float] = []
        self._attempts: tuple[Attempt, ...] = ()
        self._directing = Task("direct the people", self._directed)

    def start(self) -> None:
        """Wait for the session to be live, on a thread, and let people join then."""
        self._directing.start()

    @property
    def process_ids(self) -> tuple[int, ...]:
        """Of the process in which people are, while there is one."""
        return () if self._process is None else (self._process.process_id,)

    def end(self) -> None:
        """Let people leave and give their figures; harmless when they have, or never came."""
        self._directing.cancel()
        self._directing.join(ANSWER_S)
        self._leave()

    def rows(self) -> list[Row]:
        """Return the figures; what was not measured is left out."""
        self.end()
        rows: list[Row] = []
        for name, (shown, unit, bar) in FIGURES.items():
            if (value := self._figures.get(name)) is not None:
                rows.append(at_most(shown, value, unit, bar=bar))
        growth = growth_percent(self._rss_kib)
        if growth is not None:
            name = f"live.clients{self._clients}.rss_growth_percent"
            rows.append(at_most(name, growth, "%", bar=RSS_BAR_PERCENT))
        if self._attempts:
            refused = sum(attempt.was_refused for attempt in self._attempts)
            share = 100.0 * refused / len(self._attempts)
            rows.append(at_least("live.refused_percent", share, "%", bar=100.0))
        rows.append(at_most("live.clients.failed", float(len(self._failures)), "", bar=0.0))
        return rows

    def _directed(self, task: Task[None]) -> None:
        while self._live_s() is None:
            if task.pause(POLL_S):
                return
        self._join()
        here_s: float | None = None
        while not task.pause(POLL_S):
            live_s = self._live_s() or 0.0
            process = self._process
            if self._seconds is not None and live_s >= self._seconds - END_BEFORE_S:
                break
            if process is not None and not process.is_running:
                break
            if self._here == self._clients:
                here_s = live_s if here_s is None else here_s
                self._rss_kib.append(resident_kib(but=self.process_ids))
                if not (self._attempts or self._takes_part) and live_s - here_s >= ATTACK_AFTER_S:
                    self._attack()
        self._leave()

    def _join(self) -> None:
        words = ["simulate", "quest", self._hub.url, "--code", "-", "--json"]
        if self._trusted is not None:
            words += ["--trust", str(self._trusted)]
        if self._scenario is not None:
            words += ["--scenario", self._scenario]
        if self._takes_part:
            words += ["--answers"]
        self._process = ChildProcess(
            module_command("studio.cli", *words, "--clients", str(self._clients)),
            stdin=subprocess.PIPE,
            on_line=self._hear,
            last_words=LAST_WORDS,
            environment=module_environment(),
        )
        self._give_code()

    def _give_code(self) -> None:
        if self._process is not None:
            with suppress(OSError):  # it has ended, and says why
                self._process.say(self._hub.invite().code)

    def _hear(self, line: str) -> None:
        """Take a line of the process."""
        try:
            value: Any = json.loads(line)
        except ValueError:
            return
        said = cast(dict[str, Any], value) if isinstance(value, dict) else {}
        if said.get("event") == "joined":
            self._here = int(said["count"])
            if self._here < self._clients:
                self._give_code()
        elif said.get("event") == "ended":
            self._figures = {row["name"]: float(row["value"]) for row in said["rows"]}
            self._failures += [str(failure) for failure in said["failures"]]

    def _attack(self) -> None:
        def expired(person_id: str) -> str:
            ticket = Ticket(person_id, Role.REMOTE, 1)
            return self._tokens.make(ticket, self._clock.now_ns() - TOKEN_NS)

        address = HubAddress(self._hub.url, self._trusted)
        try:
            self._attempts = asyncio.run(attack(address, self._hub, expired=expired))
        except (HubRefusedError, OSError, TimeoutError) as error:
            self._failures.append(f"attacks: {error}")
            self._attempts = (Attempt(f"attacks: {error}", was_refused=False),)
        for attempt in self._attempts:
            if not attempt.was_refused:
                self._say(f"people: not refused: {attempt.name}")

    def _leave(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        was_early = not process.is_running
        process.cancel()
        if not process.join(ANSWER_S):
            process.kill()
        words = " ".join(line.strip() for line in process.last_words())
        process.end()
        if was_early or not self._figures:
            self._failures.append(words or "the simulated people have ended early")
        for failure in self._failures:
            self._say(f"simulated people: {failure}")
