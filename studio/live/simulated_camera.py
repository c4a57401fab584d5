"""A simulated camera in a process of its own: what `nexus live --simulated` receives from."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, cast

MOST_EVENTS = 10_000
"""Events of the camera that are kept; the oldest go first."""

END_S = 5.0
"""Seconds that the process may take to end before it is killed."""


@dataclass(frozen=True, slots=True)
class SimulatedFeed:
    """What a simulated camera plays.

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
        self._events: deque[dict[str, Any]] = deque(maxlen=MOST_EVENTS)
        self._errors: deque[str] = deque(maxlen=20)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "studio.cli", "simulate", "camera", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for name, reads in (("events", self._read_events), ("errors", self._read_errors)):
            threading.Thread(target=reads, name=f"simulated camera {name}", daemon=True).start()

    @property
    def failure(self) -> str:
        """Why it ended by itself, in its words; empty while it runs."""
        code = self._process.poll()
        if code in (None, 0):
            return ""
        return " ".join(self._errors) or f"the simulated camera ended with exit code {code}"

    def events(self) -> tuple[dict[str, Any], ...]:
        """What it said so far: `event`, `wall_ns` and what belongs to it."""
        return tuple(self._events)

    @property
    def process_id(self) -> int:
        """Of the process that plays it."""
        return self._process.pid

    def last_drawing(self) -> str:
        """How far the drawing of its film is; empty before and after."""
        said = self._events[-1] if self._events else {}
        return str(said.get("text", "")) if said.get("event") == "drawing" else ""

    def fault(self, text: str) -> None:
        """Begin a fault now, such as "black_hole:for=20"."""
        stdin = self._process.stdin
        if stdin is None or self._process.poll() is not None:
            return
        stdin.write(text + "\n")
        stdin.flush()

    def __enter__(self) -> SimulatedCamera:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._process.terminate()
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _read_events(self) -> None:
        stdout = self._process.stdout
        assert stdout is not None
        for line in stdout:
            try:
                said = json.loads(line)
            except ValueError:
                continue
            if isinstance(said, dict):
                self._events.append(cast("dict[str, Any]", said))

    def _read_errors(self) -> None:
        stderr = self._process.stderr
        assert stderr is not None
        for line in stderr:
            self._errors.append(line.strip())
