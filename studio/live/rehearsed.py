"""A live session on a simulated camera that fails as real ones do, held against its truth."""

from __future__ import annotations

import json
import subprocess
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, cast

from devices.camera.receiver import HELD_AFTER_NS
from scenes.memory import growth_percent, resident_kib
from scenes.pose import Pose
from scenes.workers.child_process import ChildProcess, module_command
from scenes.workers.task import Task
from sim.camera.camera360 import default_rig
from sim.wire.streaming.truth_file import TruthRow, read_truth
from studio.console.rows import Row, at_most
from studio.live.against_truth import (
    Published,
    bump_rows,
    calibration_rows,
    delay_rows,
    located_row,
    matched,
    object_rows,
    recovery_row,
)
from studio.live.live import LiveSession
from studio.live.status import LiveResult, LiveState
from studio.session.session import SessionOutput
from studio.session.trackers.camera_events import event_kind
from tracking.output import CameraMoment

CUT_AT_S, CUT_FOR_S = 15.0, 20.0
"""Seconds live until the camera is cut off, and for how long: an operator's Wi-Fi drop."""

AFTER_CUT_S = 10.0
"""Seconds that must be left after a cut to see it return."""

BUMP = "bump:at=10,size=0.6"
"""Fault of the film: a knock by a hip. Played forward and backward, one comes every 20 s."""

FILM_S = 20.0
"""Seconds of the script that are drawn."""

KEPT = 9_000
"""Published pictures that are compared: five minutes at 30 Hz."""

MAX_RETURNS = 200
"""Pictures beside gaps that are kept, for the returns of a long session: one gap is planned."""

RSS_BAR_PERCENT = 2.0
"""Growth of memory over a session, percent: the product's promise for an hour."""

STREAM_S = 900.0
"""Longest that the simulated camera may take to draw its film, seconds."""

POLL_S = 0.5
"""Seconds between two looks at the session, as at a simulated crowd's."""

Say = Callable[[str], None]

MAX_EVENTS = 10_000
"""Events of the camera that are kept; the oldest go first."""

LAST_WORDS = 20
"""Lines of what it says on stderr that are kept."""

END_S = 5.0
"""Seconds that the process may take to end before it is killed."""


def usual_feed(scene: str, scenario: str | None, seed: int) -> SimulatedFeed:
    """A film of a scene at full size and rate, in which the camera is bumped."""
    return SimulatedFeed(scene, scenario, seed, FILM_S, faults=(BUMP,))


class RehearsedLive:
    """The camera, its faults, and what the session made of both. Use as a context manager.

    Args:
        session: receives from an RTMP port of its own.
        feed: what the camera plays.
        truth: file for the camera's truth.
        seconds: that the session is live; None for no end.
        apart: ids of processes that are none of the session's, beside the camera's.
    """

    def __init__(
        self,
        session: LiveSession,
        feed: SimulatedFeed,
        *,
        truth: Path,
        seconds: float | None,
        apart: Callable[[], Iterable[int]] = tuple,
    ) -> None:
        self._apart = apart
        self._session = session
        self._truth = truth
        self._seconds = seconds
        self._feed = feed
        self._stack = ExitStack()
        self._camera: SimulatedCamera | None = None
        self._published: deque[Published] = deque(maxlen=KEPT)
        self._returns: deque[Published] = deque(maxlen=MAX_RETURNS)
        """The pictures before and after every gap, for longer than `_published` keeps them."""
        self._rss_kib: deque[tuple[float, float]] = deque(maxlen=20_000)
        self._wall_from_session_ns = time.time_ns() - session.now_ns()
        self._directing = Task("direct the rehearsal", self._directed)

    def __enter__(self) -> RehearsedLive:
        url = self._listening_at()
        self._camera = self._stack.enter_context(
            SimulatedCamera(self._feed, push_to=url, truth=self._truth)
        )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._directing.cancel()
        self._stack.__exit__(kind, error, traceback)

    @property
    def failure(self) -> str:
        """Why the camera ended by itself, in its words; empty while it runs."""
        return self._running().failure

    @property
    def drawing(self) -> str:
        """How far the drawing of its film is; empty before and after."""
        return self._running().last_drawing()

    def wait_for_stream(self, say: Say) -> None:
        """Wait until the camera streams; its film may have to be drawn first.

        Raises:
            ValueError: it ended, or takes too long.
        """
        camera, since, said = self._running(), time.monotonic(), ""
        while not any(event.get("event") == "started" for event in camera.events()):
            if camera.failure:
                raise ValueError(f"simulated camera: {camera.failure}")
            if time.monotonic() - since > STREAM_S:
                raise ValueError(f"simulated camera: no stream within {STREAM_S:g} s")
            text = camera.last_drawing()
            if text and text != said:
                said = text
                say(f"the simulated camera is made ready: {text}")
            time.sleep(POLL_S)

    def watch(self, output: SessionOutput) -> None:
        """Take what the session published of a picture."""
        times = self._session.picture_times
        if times is None:
            return
        zero = self._wall_from_session_ns
        published = Published(
            times.pts_ns,
            zero + times.arrived_ns,
            zero + output.now_ns,
            {track.object_id: track.world_from_object for track in output.shown.objects},
            output.shown.world_from_rig,
            frozenset(track.object_id for track in output.shown.objects if track.is_flagged),
        )
        before = self._published[-1] if self._published else published
        if published.arrived_ns - before.arrived_ns > HELD_AFTER_NS:
            self._returns += (before, published)
        self._published.append(published)

    def direct(self) -> None:
        """Begin to cut the camera off as planned, and to watch the memory; returns at once."""
        self._directing.start()

    def true_poses(self) -> list[tuple[int, Mapping[str, Pose]]]:
        """Wall time and true poses of objects in every picture that was taken."""
        truth = read_truth(self._truth)
        return [(row.time.wall_ns, row.world_from_object) for row in truth if row.world_from_object]

    def rows(self, result: LiveResult) -> list[Row]:
        """The figures against the truth."""
        truth = read_truth(self._truth)
        if not self._published or not truth:
            return []
        published = list(self._published)
        pairs = matched(published, truth)
        zero = self._wall_from_session_ns
        noticed = [zero + e.t_ns for e in result.events if e.kind in NOTICED]
        rows = delay_rows(pairs)
        rows.append(recovery_row([*self._returns, *published], self._cuts_ended_ns()))
        rows += bump_rows(published, truth, noticed)
        rows += self._placing_rows(result, truth)
        rows += object_rows(pairs)
        rows.append(self._memory_row())
        return rows

    def _placing_rows(self, result: LiveResult, truth: list[TruthRow]) -> list[Row]:
        placed = result.placed
        if placed is None:
            return []
        wall_ns = self._wall_from_session_ns + placed.t_ns
        nearest = min(truth, key=lambda row: abs(row.time.wall_ns - wall_ns))
        true_pose = nearest.world_from_rig
        if true_pose is None:
            return []
        rows: list[Row] = []
        if placed.calibration is not None:
            true_rig = default_rig(placed.stream.lens_size_px)
            rows += calibration_rows(placed.rig, placed.world_from_rig, true_rig, true_pose)
        if placed.searched_world_from_rig is not None:
            rows.append(located_row([(placed.searched_world_from_rig, true_pose)]))
        return rows

    def _cuts_ended_ns(self) -> list[int]:
        return [
            int(event["wall_ns"])
            for event in self._running().events()
            if event.get("event") == "fault_ends" and event.get("kind") == "black_hole"
        ]

    def _memory_row(self) -> Row:
        growth = growth_percent([value for _, value in self._rss_kib])
        return at_most(
            "live.rss_growth_percent",
            float("nan") if growth is None else growth,
            "%",
            bar=RSS_BAR_PERCENT,
        )

    def _directed(self, task: Task[None]) -> None:
        cut = False
        while not task.pause(POLL_S):
            status = self._session.status()
            if status.state is LiveState.ENDED:
                return
            live_s = status.live_s
            if live_s is None:
                continue
            apart = {self._running().process_id, *self._apart()}
            self._rss_kib.append((live_s, resident_kib(but=apart)))
            wanted = CUT_AT_S + CUT_FOR_S + AFTER_CUT_S
            is_long = self._seconds is None or self._seconds >= wanted
            if not cut and is_long and live_s >= CUT_AT_S:
                cut = True
                self._running().fault(f"black_hole:for={CUT_FOR_S:g}")

    def _listening_at(self) -> str:
        deadline = time.monotonic() + 5.0
        while not (url := self._session.status().listening_at):
            if time.monotonic() > deadline:
                raise ValueError("simulated camera: the session listens on no RTMP port")
            time.sleep(0.05)
        return url

    def _running(self) -> SimulatedCamera:
        assert self._camera is not None, "used outside its context"
        return self._camera


NOTICED = frozenset(map(event_kind, (CameraMoment.BUMPED, CameraMoment.NOT_FOUND)))
"""Kinds of the session's events by which it says that the camera was moved."""


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
            on_line=self._take_event,
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
