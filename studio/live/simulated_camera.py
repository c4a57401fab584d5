"""A simulated camera in a process of its own: what `nexus live --simulated` receives from."""

from __future__ import annotations

import json
import subprocess
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, cast

from scenes.workers.child_process import ChildProcess, module_command

MAX_EVENTS = 10_000
"""Events of the camera that are kept; the oldest go first."""

LAST_WORDS = 20
"""Lines of what it says on stderr that are kept."""

END_S = 5.0
"""Seconds that the process may take to end before it is killed."""


@dataclass(frozen=True, slots=True)
class SimulatedFeed:
    """Film and stream of a simulated camera.

    Attributes:
        scene: as `nexus simulate camera` takes it.
        scenario: name or file; None for the scene's own.
        seed: of all that is random.
        film_s: seconds of the script that are drawn; played forward and backward.
        size: of the stream's picture, such as "2880x1440".
        fps: pictures a second.
        faults: known beforehand, such as "bump:at=10,size=0.6".
    """

    scene: str
    scenario: str | None = None
    seed: int = 0
    film_s: float = 20.0
    size: str = "2880x1440"
    fps: float = 30.0
    faults: tuple[str, ...] = ()


class SimulatedCamera:
    """The running process. Use as a context manager: leaving it ends the camera.

    Args:
        feed: what it plays.
        push_to: RTMP address that it streams to.
        truth: file of the truth that it writes.
    """

    def __init__(self, feed: SimulatedFeed, *, push_to: str, truth: Path) -> None:
        words = [feed.scene, "--push", push_to, "--json", "--control", "--truth", str(truth)]
        words += ["--seed", str(feed.seed), "--film-seconds", str(feed.film_s)]
        words += ["--size", feed.size, "--fps", str(feed.fps)]
        if feed.scenario is not None:
            words += ["--scenario", feed.scenario]
        for fault in feed.faults:
            words += ["--fault", fault]
        self._events: deque[dict[str, Any]] = deque(maxlen=MAX_EVENTS)
        self._process = ChildProcess(
            module_command("studio.cli", "simulate", "camera", *words),
            stdin=subprocess.PIPE,
            heard=self._take_event,
            last_words=LAST_WORDS,
        )

    @property
    def failure(self) -> str:
        """Why it ended by itself, in its words; empty while it runs."""
        code = self._process.code
        if code in (None, 0):
            return ""
        words = " ".join(line.strip() for line in self._process.last_words())
        return words or f"the simulated camera ended with exit code {code}"

    def events(self) -> tuple[dict[str, Any], ...]:
        """Return its messages so far: `event`, `wall_ns` and what belongs to it."""
        return tuple(self._events)

    @property
    def process_id(self) -> int:
        """Of the process that plays it."""
        return self._process.process_id

    def last_drawing(self) -> str:
        """How far the drawing of its film is; empty before and after."""
        said = self._events[-1] if self._events else {}
        return str(said.get("text", "")) if said.get("event") == "drawing" else ""

    def fault(self, text: str) -> None:
        """Begin a fault now, such as "black_hole:for=20"."""
        if self._process.code is None:
            self._process.say(text)

    def __enter__(self) -> SimulatedCamera:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._process.end(END_S)

    def _take_event(self, line: str) -> None:
        try:
            said = json.loads(line)
        except ValueError:
            return
        if isinstance(said, dict):
            self._events.append(cast("dict[str, Any]", said))
