"""The shared origin while a session runs: codes in the headset's video, on threads of its own.

One takes pictures as they come, for whoever shows them, the other looks for codes in some.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from devices.clock import Clock
from devices.hololens.headset import Subscription
from devices.hololens.values import PersonalVideoFrame
from scenes.pose import Pose, rotation_angle
from scenes.workers.latest import Latest
from scenes.workers.task import Task
from studio.live.hololens.timing import Durations
from tracking.headset.codes import CodeReader
from tracking.headset.origin import (
    CodePicture,
    Origin,
    OriginPlan,
    expected_corners,
    origin_after,
    shown_at,
)

LOOK_S = 0.125
"""Time between two pictures in which codes are looked for, chosen: eight a second hold the origin
to a millimetre, and take a tenth of a processor."""

WAIT_S = 0.5
"""Longest wait for a picture before an end that was asked for is noticed."""

GOOD_M, GOOD_RAD = 0.02, math.radians(0.5)
"""Standard deviations of an origin that the room's physics and people elsewhere may rely on."""

DRIFT_EVERY_NS, DRIFT_KEPT = 5_000_000_000, 13
"""Time between two remembered origins, and how many: by how much the last minute has moved it."""

STALE_NS = 60_000_000_000
"""Time without a code after which the wearer is asked to look at one: what a headset's world may
have drifted by then, a centimetre, is half of what people point at."""

Report = Callable[[str, str], None]


@dataclass(frozen=True, slots=True)
class OriginStatus:
    """The shared origin at one moment, for people.

    Attributes:
        is_known: whether a code was seen.
        sigma_mm: standard deviation of its place at the codes; None before.
        sigma_deg: of its direction; None before.
        codes: payloads in the last picture.
        age_s: since a code was seen last; None before.
        drift_mm: by how much the headset's world has moved in the room within the last minute.
        restarts: how often the headset was somewhere else all at once.
        moved: codes that were moved since the scan, and are left out.
        camera_moves: how often the camera with its code was put elsewhere.
    """

    is_known: bool = False
    sigma_mm: float | None = None
    sigma_deg: float | None = None
    codes: tuple[str, ...] = ()
    age_s: float | None = None
    drift_mm: float = 0.0
    restarts: int = 0
    moved: tuple[str, ...] = ()
    camera_moves: int = 0


class Anchoring:
    """Keeps the origin; any thread may ask for it.

    Args:
        video: newest pictures of the headset.
        plan: codes of the room.
        clock: session time.
        note: takes an event: kind and text.
        delays: takes from when a picture was taken until it is here, ms.
    """

    def __init__(
        self,
        video: Subscription[PersonalVideoFrame],
        plan: OriginPlan,
        *,
        clock: Clock,
        note: Report,
        delays: Durations,
    ) -> None:
        self._video, self._plan, self._clock = video, plan, clock
        self._note, self._delays = note, delays
        self._lock = threading.Lock()
        self._origin = Origin()
        self._reader = CodeReader(plan.payloads)
        self._remembered: deque[tuple[int, Pose]] = deque(maxlen=DRIFT_KEPT)
        self._next_ns = 0
        self.picture: PersonalVideoFrame | None = None
        """The newest picture."""
        self._task = Task("headset video", self._run)
        self._looks: Latest[PersonalVideoFrame] | None = None

    def start(self) -> None:
        """Begin to look."""
        self._looks = Latest("headset origin", lambda frame, _stale: self.look(frame))
        self._task.start()

    def close(self) -> None:
        """End the threads."""
        self._task.cancel()
        self._task.join(2.0 * WAIT_S)
        if self._looks is not None:
            self._looks.close(2.0 * WAIT_S)
        self._video.close()

    @property
    def origin(self) -> Origin:
        """As it is known now, without what is shown of it."""
        return self._origin

    def device_from_world(self) -> Pose | None:
        """Return the room's origin in the headset's world as it is shown now; None before."""
        with self._lock:
            self._origin = shown_at(self._origin, self._clock.now_ns(), plan=self._plan)
            glide = self._origin.glide
        return None if glide is None else glide.b_from_a

    @property
    def has_codes(self) -> bool:
        """Whether the room has codes that could be found."""
        return bool(self._plan.codes)

    @property
    def is_good(self) -> bool:
        """Whether the origin is known well enough to place surfaces and people by it."""
        known = self._origin
        return known.sigma_m <= GOOD_M and known.sigma_rad <= GOOD_RAD

    def status(self) -> OriginStatus:
        """Return how it is now."""
        known = self._origin
        belief = known.anchor.belief
        if belief is None:
            return OriginStatus()
        return OriginStatus(
            is_known=True,
            sigma_mm=1e3 * known.sigma_m,
            sigma_deg=math.degrees(known.sigma_rad),
            codes=known.seen,
            age_s=(self._clock.now_ns() - known.anchor.seen_ns) / 1e9,
            drift_mm=self._drift_mm(belief.a_from_b),
            restarts=known.anchor.restarts,
            moved=known.moved,
            camera_moves=known.carried.restarts,
        )

    def _drift_mm(self, device_from_world: Pose) -> float:
        if not self._remembered:
            return 0.0
        middle = self._plan.middle
        before = self._remembered[0][1]
        return 1e3 * float(np.linalg.norm(device_from_world @ middle - before @ middle))

    def _run(self, task: Task[None]) -> None:
        looks = self._looks
        assert looks is not None, "start first"
        while not task.is_cancelled:
            frame = self._video.take(WAIT_S)
            if frame is None:
                continue
            now_ns = self._clock.now_ns()
            self._delays.add((now_ns - frame.t_ns) / 1e6)
            self.picture = frame
            if now_ns >= self._next_ns:
                self._next_ns = now_ns + round(LOOK_S * 1e9)
                looks.ask(frame)

    def look(self, frame: PersonalVideoFrame) -> None:
        """Look for codes in one picture."""
        device_from_camera = frame.world_from_camera
        if device_from_camera is None:
            return
        expected = expected_corners(
            self._origin, self._plan, camera=frame.camera, device_from_camera=device_from_camera
        )
        grey = np.ascontiguousarray(frame.picture.y)
        codes = tuple(self._reader.find(grey, expected))
        if not codes:
            return
        picture = CodePicture(frame.t_ns, frame.camera, device_from_camera, codes)
        with self._lock:
            before = self._origin
            self._origin = after = origin_after(before, picture, plan=self._plan)
        self._tell(before, after)

    def _tell(self, before: Origin, after: Origin) -> None:
        """Say what has happened to the origin."""
        belief = after.anchor.belief
        if belief is None:
            return
        if not self._remembered or belief.t_ns - self._remembered[-1][0] >= DRIFT_EVERY_NS:
            self._remembered.append((belief.t_ns, belief.a_from_b))
        old = before.anchor.belief
        if old is None:
            names = ", ".join(after.seen)
            self._note("headset-anchored", f"the headset has found the room by code {names}")
        elif after.anchor.restarts > before.anchor.restarts:
            change = belief.a_from_b @ old.a_from_b.inverse()
            middle = old.a_from_b @ self._plan.middle
            way_cm = 100 * float(np.linalg.norm(change @ middle - middle))
            turn_deg = math.degrees(rotation_angle(change.rotation))
            text = f"the headset's world was off by {way_cm:.0f} cm, {turn_deg:.1f}°; anchored anew"
            self._remembered.clear()
            self._note("headset-anchored", text)
        for payload in set(after.moved) - set(before.moved):
            text = f"code {payload!r} is not where the scan has it and is left out; fix it there"
            self._note("code-moved", text)
        if after.carried.restarts > before.carried.restarts:
            self._note("camera-code-moved", "the code on the camera stands elsewhere")
