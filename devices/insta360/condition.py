"""Condition of an Insta360 camera beside its pictures: battery, card, clock, asked over HTTP."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from devices.camera.address import AddressKind, CameraAddress
from devices.clock import Clock
from devices.insta360.errors import CameraError
from devices.insta360.osc import PORT, OscClient
from scenes.workers.task import Task

EVERY_S = 15.0
"""Time between two rounds of questions. A battery that lasts an hour falls by 0.4 % in it."""

PAUSE_S = 1.0
"""Time between two questions of a round: the vendor asks for no more than one a second."""

LOW_BATTERIES = (0.2, 0.1, 0.05)
"""Shares of the battery at which an operator is warned: 12, 6 and 3 minutes of an hour."""

CARDS = {
    "pass": "ready",
    "noCard": "none",
    "noSpace": "full",
    "invalidFormat": "of a wrong format",
    "writeProtect": "write-protected",
    "otherError": "faulty",
}
"""The camera's words for its card, as people read them."""


@dataclass(frozen=True, slots=True)
class CameraCondition:
    """A camera at one moment, as far as it said.

    Attributes:
        model, serial, firmware: in the camera's words.
        battery: 0 to 1; None if unsaid.
        card: in the camera's words, see `CARDS`; empty if unsaid.
        ahead_s: of the camera's clock before this computer's; None if unsaid.
    """

    model: str
    serial: str
    firmware: str
    battery: float | None
    card: str
    ahead_s: float | None

    @property
    def text(self) -> str:
        """All of it in a line."""
        parts = [f"{self.model} {self.firmware}".strip()]
        if self.battery is not None:
            parts.append(f"battery {self.battery:.0%}")
        if self.card:
            parts.append(f"card {CARDS.get(self.card, self.card)}")
        if self.ahead_s is not None and abs(self.ahead_s) >= 1.0:
            side = "ahead" if self.ahead_s > 0 else "behind"
            parts.append(f"clock {abs(self.ahead_s):.0f} s {side}")
        return ", ".join(part for part in parts if part)


class ConditionWatch:
    """Asks a camera from the start until `close`; a camera that does not answer says nothing.

    Args:
        host: name or address of the camera.
        port: of its HTTP interface.
        clock: session time.
        unix_s: seconds since 1970.
        say: called on a thread of its own with a sentence when the battery is low.
        every_s: time between two rounds of questions.
    """

    def __init__(
        self,
        host: str,
        port: int = PORT,
        *,
        clock: Clock,
        unix_s: Callable[[], float],
        say: Callable[[str], None],
        every_s: float = EVERY_S,
    ) -> None:
        self._client = OscClient(host, port, clock=clock)
        self._unix_s, self._say, self._every_s = unix_s, say, every_s
        self._last: CameraCondition | None = None
        self._task = Task("camera condition", self._watch).start()

    @property
    def last(self) -> CameraCondition | None:
        """The camera as it said last; None before it did, or when it answers no more."""
        return self._last

    def close(self) -> None:
        """Stop asking; a question that waits for its reply ends by itself."""
        self._task.cancel()

    def _watch(self, task: Task[None]) -> None:
        announced = 1.0
        while not task.is_cancelled:
            try:
                self._last = self._ask(task)
            except CameraError:
                self._last = None
            if self._last is not None and self._last.battery is not None:
                announced = self._announce(self._last.battery, announced)
            task.pause(self._every_s)

    def _ask(self, task: Task[None]) -> CameraCondition:
        """Ask one round of questions.

        Raises:
            CameraError: one had no answer.
        """
        info = self._client.info()
        task.pause(PAUSE_S)
        state = self._client.state()
        task.pause(PAUSE_S)
        return CameraCondition(
            info.model, info.serial, info.firmware, state.battery, state.card, self._ahead_s()
        )

    def _ahead_s(self) -> float | None:
        """Middle of question and reply against the camera's time in between."""
        before_s = self._unix_s()
        said: Any = self._client.options(["_sysTimestamp"]).get("_sysTimestamp")
        after_s = self._unix_s()
        if not isinstance(said, int | float) or isinstance(said, bool):
            return None
        return said / 1e6 - 0.5 * (before_s + after_s)

    def _announce(self, battery: float, announced: float) -> float:
        """Say once of each of `LOW_BATTERIES` that it is reached; the lowest said so far."""
        reached = [low for low in LOW_BATTERIES if battery <= low < announced]
        if not reached:
            return 1.0 if battery > LOW_BATTERIES[0] else announced
        self._say(f"the camera's battery is at {battery:.0%}: plug it in")
        return min(reached)


def watch_condition(
    camera: CameraAddress, clock: Clock, *, say: Callable[[str], None]
) -> ConditionWatch | None:
    """Start to ask a camera that has words beside its pictures; None for others.

    Args:
        camera: its address.
        clock: session time.
        say: see `ConditionWatch`.
    """
    if camera.kind is not AddressKind.INSTA360:
        return None
    return ConditionWatch(camera.host, camera.http_port, clock=clock, unix_s=time.time, say=say)
