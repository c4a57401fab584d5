"""A simulated HoloLens in a live session, in a process of its own, and what it is held against."""

from __future__ import annotations

import json
import subprocess
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from devices.clock import Clock
from devices.hololens.display_list import Item, Label, Shape, Solid
from devices.hololens.display_orders import UNIT_SIZES
from devices.hololens.plan import HeadsetPlan, Ports
from devices.hololens.values import PersonalVideoFrame
from devices.hub.roles import Role
from devices.hub.server import Hub
from scenes.package.records import pose_from_json
from scenes.pose import rotation_angle
from scenes.workers.child_process import ChildProcess, module_command, module_environment
from scenes.workers.task import Task
from sim.hololens.holograms import TEXT
from studio.live.hololens.figures import Seen, SimulatedFigures
from studio.live.hololens.showing.view import seen_by_wearer
from studio.live.hololens.simulated.attacking import Visited
from studio.live.hololens.worn import WornHeadset, WornPlan
from studio.live.people.pictures import jpeg_of

START_S = 300.0
"""Longest that the process may take to listen, seconds: it draws a room's textures first, or takes
a scan apart by its objects."""

END_S = 5.0
"""Seconds that it may take to end before it is killed."""

LAST_WORDS = 20
"""Lines of what it says on stderr that are kept."""

SETTLED_NS = 10_000_000_000
"""Session time from the first answer after which the clock is held against the truth."""

CAMERA_CODE, CAMERA_CODE_M = "nexus:camera", 0.10
"""Code on the simulated 360° camera, and its side."""

POLL_S = 0.1
"""Seconds between two looks whether somebody can join."""

MAX_SEEN = 20_000
"""Places of pointing rays that are kept: of half an hour."""


@dataclass(frozen=True, slots=True)
class Attack:
    """Hostile visits that a session's ports are to get.

    Attributes:
        visits: of each kind.
        camera_port: at which the session waits for a camera that pushes; 0 for none.
    """

    visits: int
    camera_port: int = 0


class SimulatedHeadset:
    """The process; use as a context manager.

    Args:
        scene: name of a built-in room, or path of a package that can be rehearsed in.
        seed: of all that is random.
        clock: session time.
        say: takes a line for the log.
    """

    def __init__(self, scene: str, *, seed: int, clock: Clock, say: Callable[[str], None]) -> None:
        self._scene, self._seed, self._clock, self._say = scene, seed, clock, say
        self._zero_ns = time.perf_counter_ns() - clock.now_ns()
        self._ports: Ports | None = None
        self._worn: WornHeadset | None = None
        self._middle = np.zeros(3)
        self._first_clock_ns: int | None = None
        self.figures = SimulatedFigures()
        self.visited = Visited()
        """Hostile visits so far."""
        self._view: tuple[PersonalVideoFrame, tuple[Item, ...]] | None = None
        """What the headset truly shows."""
        self.failures: deque[str] = deque(maxlen=LAST_WORDS)
        self._process: ChildProcess | None = None
        self._joining: Task[None] | None = None

    def __enter__(self) -> SimulatedHeadset:
        words = [self._scene, "--seed", str(self._seed)]
        self._process = ChildProcess(
            module_command("studio.live.hololens.simulated.stand_in", *words),
            stdin=subprocess.PIPE,
            on_line=self._hear,
            last_words=LAST_WORDS,
            environment=module_environment(),
        )
        return self

    def __exit__(self, *_: object) -> None:
        if self._joining is not None:
            self._joining.cancel()
        if self._process is not None:
            with suppress(OSError):
                self._process.stdin.close()
            if not self._process.join(END_S):
                self._process.kill()
            self._process.end(END_S)

    @property
    def process_id(self) -> int:
        """Of the process."""
        assert self._process is not None, "used outside its context"
        return self._process.process_id

    def plan(self, *, name: str = "") -> WornPlan:
        """Return the headset to be worn, once it listens.

        Raises:
            ValueError: it has ended, or takes too long.
        """
        process, since = self._process, time.monotonic()
        assert process is not None, "used outside its context"
        while self._ports is None:
            if not process.is_running or time.monotonic() - since > START_S:
                words = " ".join(line.strip() for line in process.last_words())
                raise ValueError(f"simulated HoloLens: {words or 'it does not listen'}")
            time.sleep(0.05)
        return WornPlan(
            HeadsetPlan("127.0.0.1", ports=self._ports),
            name or "Simulated wearer",
            CAMERA_CODE,
            CAMERA_CODE_M,
        )

    def measure(self, worn: WornHeadset, *, middle: np.ndarray) -> None:
        """Hold a worn headset against the truth from now on.

        Args:
            worn: the headset.
            middle: (3,) place at which the origin's error is said, world metres.
        """
        self._middle, self._worn = middle, worn

    def follow(self, truth: Path) -> None:
        """Have it see objects and 360° camera where a simulated camera's truth has them.

        Args:
            truth: file that the camera writes.
        """
        assert self._process is not None, "used outside its context"
        with suppress(OSError):  # it has ended, and says why
            self._process.say(f"follow {truth}")

    def let_point(
        self,
        hub: Hub,
        live_s: Callable[[], float | None],
        *,
        trusted: Path | None = None,
        attack: Attack | None = None,
    ) -> None:
        """Let somebody join and point once the session is live, and hostile visitors follow.

        Args:
            hub: that they join.
            live_s: returns for how long the session is live; None before.
            trusted: file of the hub's root certificate; None where it has none.
            attack: the hostile visits; None for none.
        """

        def join(task: Task[None]) -> None:
            while live_s() is None:
                if task.pause(POLL_S):
                    return
            words = ["join", hub.url, hub.invite().code]
            words += [] if trusted is None else [str(trusted)]
            said = [words]
            if attack is not None:
                code = hub.invite(Role.SPECTATOR).code
                said.append(["attack", hub.url, code, f"{attack.camera_port}", f"{attack.visits}"])
            assert self._process is not None, "used outside its context"
            with suppress(OSError):  # it has ended, and says why
                for each in said:
                    self._process.say(" ".join(each))

        self._joining = Task("let somebody point", join).start()

    def _hear(self, line: str) -> None:
        try:
            value: Any = json.loads(line)
        except ValueError:
            return
        said = cast("dict[str, Any]", value) if isinstance(value, dict) else {}
        match said.get("event"):
            case "started":
                self._ports = Ports(**said["ports"])
            case "truth":
                self._compare(said)
            case "pointed":
                self.figures.point_ms.add(float(said["ms"]))
            case "seen":
                at, leg = np.array(said["at"], float), np.array(said["leg"], float)
                wall_ns = int(said["perf_ns"]) + time.time_ns() - time.perf_counter_ns()
                self.figures.seen.append(Seen(wall_ns, str(said["object"]), at, leg))
            case "visited":
                self.visited = Visited(int(said["streams"]), int(said["unserved"]))
            case "shown":
                self._keep_view(tuple(_item_of(item) for item in said["items"]))
            case "failed":
                self.failures.append(str(said["text"]))
                self._say(str(said["text"]))
            case _:
                pass

    def _compare(self, said: dict[str, Any]) -> None:
        """Hold clock and origin against the truth of this moment."""
        worn = self._worn
        if worn is None:
            return
        figures, clock = self.figures, worn.headset.status().clock
        session_ns = int(said["perf_ns"]) - self._zero_ns
        if clock is not None:
            first = self._first_clock_ns = self._first_clock_ns or session_ns
            if session_ns - first >= SETTLED_NS:
                off_ns = clock.session_ns(int(said["device_ns"])) - session_ns
                figures.clock_ms.add(abs(off_ns) / 1e6)
        figures.items = max(figures.items, int(said["items"]))
        device_from_world = worn.anchoring.device_from_world()
        if device_from_world is None or not worn.anchoring.is_good:
            return
        off = device_from_world.inverse() @ pose_from_json(said["room_from_world"]).inverse()
        middle = self._middle
        figures.origin_mm.add(1e3 * float(np.linalg.norm(off @ middle - middle)))
        figures.origin_deg.add(float(np.degrees(rotation_angle(off.rotation))))

    def _keep_view(self, shown: tuple[Item, ...]) -> None:
        """Keep what the wearer sees; at the end everything is taken off the display."""
        frame = None if self._worn is None else self._worn.anchoring.picture
        if frame is not None and (shown or self._view is None):
            self._view = frame, shown

    def save_view(self, path: Path) -> bool:
        """Write what the wearer saw last as a JPEG; return whether there was anything."""
        if self._view is None:
            return False
        path.write_bytes(jpeg_of(seen_by_wearer(*self._view)))
        return True


def _item_of(said: dict[str, Any]) -> Item:
    pose, (red, green, blue, opacity) = pose_from_json(said["pose"]), map(float, said["colour"])
    colour = (red, green, blue, opacity)
    if said["text"] or int(said["shape"]) == TEXT:
        return Label(str(said["text"]), pose, colour=colour)
    shape = Shape(int(said["shape"]))
    # The scene's own shapes are not all within a cube of 1 m.
    x, y, z = (np.array(said["scale"], float) * UNIT_SIZES[shape]).tolist()
    return Solid(shape, pose, (x, y, z), colour)
