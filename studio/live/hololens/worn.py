"""A HoloLens in a live session from beginning to end: origin, wearer, display, mesh."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.clock import Clock
from devices.hololens.headset import Headset
from devices.hololens.plan import HeadsetPlan
from devices.hololens.values import HeadAndHands, HeadsetStatus
from devices.hub.attendance import AWAY_NS
from devices.hub.server import Hub
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.state import Avatar, SceneState
from scenes.workers.task import Task
from studio.live.hololens.anchoring import Anchoring, OriginStatus
from studio.live.hololens.carrying import Carrying
from studio.live.hololens.local_user import WEARER, WithLocalUser, show_to, wearer_now
from studio.live.hololens.meshing import HiddenSurfaces, Hiding, Meshing, MeshStatus
from studio.live.hololens.rig_code import RigCode, is_apart, rig_code_after
from studio.live.hololens.showing.drawing import Drawing
from studio.live.hololens.showing.view import seen_by_wearer
from studio.live.hololens.timing import Durations
from studio.live.people.entering import People
from tracking.headset.origin import OriginPlan

WAIT_S = 0.25
"""Longest wait for a body before an end that was asked for is noticed, and people without one are
told that the wearer is gone."""

SHOW_EVERY_NS = 15_000_000
"""Session time between two bodies that are sent on: as often as the headset measures, 60 Hz."""

STALE_NS = 1_000_000_000
"""Age from which a body says nothing of where the wearer is, ns."""

MAX_EVENTS = 200
"""Events that wait for the session, chosen: it takes them with every picture."""

MESH_FILE = "headset-mesh.glb"
"""Name of the room's mesh with what the headset has added, beside a recording."""


@dataclass(frozen=True, slots=True)
class WornPlan:
    """A HoloLens as the operator asked for it.

    Attributes:
        headset: its address, and what is wanted of it.
        name: of the wearer, as others see it.
        camera_code: what the code on the 360° camera says; empty for none.
        camera_code_side_m: its printed side, over the dark pattern.
    """

    headset: HeadsetPlan
    name: str = "HoloLens"
    camera_code: str = ""
    camera_code_side_m: float = 0.1


@dataclass(frozen=True, slots=True)
class WornStatus:
    """How it is doing at one moment, for people.

    Attributes:
        headset: its streams, clock and battery.
        origin: the room in its world.
        mesh: its surfaces in the room's physics.
        drawn: items that are to be on its display.
        body_age_s: since the newest head and hands; None before the first.
    """

    headset: HeadsetStatus
    origin: OriginStatus = field(default_factory=OriginStatus)
    mesh: MeshStatus = field(default_factory=MeshStatus)
    drawn: int = 0
    body_age_s: float | None = None


class WornHeadset:
    """The headset of the local user; `people` stands for the session's hub. Starts with `start`.

    Args:
        plan: as the operator asked for it.
        scene: the room.
        clock: session time.
        hub: returns the hub of the moment; None while nobody can join.
        make: makes the headset's receiver.
    """

    def __init__(
        self,
        plan: WornPlan,
        scene: ScenePackage,
        *,
        clock: Clock,
        hub: Callable[[], Hub | None] = lambda: None,
        make: Callable[[HeadsetPlan, Clock], Headset] = Headset,
    ) -> None:
        self.plan, self._clock, self._hub = plan, clock, hub
        self.headset = headset = make(plan.headset, clock)
        self.video_delays, self.body_delays = Durations(), Durations()
        self._events: deque[tuple[str, str]] = deque(maxlen=MAX_EVENTS)
        self._events_lock = threading.Lock()
        codes = OriginPlan(scene.codes, plan.camera_code, plan.camera_code_side_m)
        self.anchoring = Anchoring(
            headset.video(), codes, clock=clock, note=self._note, delays=self.video_delays
        )
        self._hidden = HiddenSurfaces()
        self._elsewhere: Hiding | None = None
        """A room that sites join, in which surfaces hide what is behind them as well."""
        self.meshing = Meshing(
            headset.surfaces(),
            scene,
            world_from_device=self._world_from_device,
            clock=clock,
            changed=self._hidden.change,
        )
        self._carrying = Carrying(WEARER, hub=hub, note=self._note)
        self.drawing = Drawing(
            headset.draw,
            device_from_world=self.anchoring.device_from_world,
            eye=self._eye,
            hub=hub,
            in_hand=self._carrying.shown,
            models={item.object_id: item for item in scene.objects},
            wearer=WEARER,
            clock=clock,
        )
        self._body = headset.body()
        self._sample: HeadAndHands | None = None
        self._rig_code = RigCode()
        self._world_from_rig: Pose | None = None
        self._move_camera: Callable[[Pose], None] = lambda _pose: None
        self._task = Task("headset body", self._follow_body)

    def start(self, move_camera: Callable[[Pose], None] = lambda _pose: None) -> None:
        """Begin.

        Args:
            move_camera: takes the 360° camera's pose where its code shows that it was moved.
        """
        self._move_camera = move_camera
        self.anchoring.start()
        self.meshing.start()
        self.drawing.start()
        self._task.start()

    def close(self) -> None:
        """End everything, and hang up."""
        self._task.cancel()
        for part in (self.drawing, self.meshing, self.anchoring):
            part.close()
        self._task.join(2.0)
        if (hub := self._hub()) is not None:
            with suppress(RuntimeError):
                hub.meet([], way=WEARER)
        self._body.close()
        self.headset.draw({})
        self.headset.close()

    def people(self, inner: People | None) -> WithLocalUser:
        """Return the session's people with the wearer among them."""
        self._elsewhere = inner if isinstance(inner, Hiding) else None
        return WithLocalUser(
            inner, wearer=self.avatar, take_events=self._take_events, publish=self.publish
        )

    def publish(self, state: SceneState) -> None:
        """Draw a new state, and let its objects be where it has them; returns at once."""
        self.drawing.publish(state)
        self._carrying.publish(state)
        self.meshing.publish(state)
        if state.world_from_rig is not None:
            self.see_camera(state.world_from_rig)

    def see_camera(self, world_from_rig: Pose) -> None:
        """Take where the 360° camera's own pictures have it; say where its code has it."""
        self._world_from_rig = world_from_rig
        self._rig_code, moved = rig_code_after(
            self._rig_code, self.anchoring.origin, world_from_rig=world_from_rig
        )
        if moved is not None and is_apart(moved, world_from_rig):
            self._note("camera-moved", "the 360° camera was put elsewhere, as its code shows")
            self._move_camera(moved)

    def avatar(self) -> Avatar | None:
        """Return the wearer in the room now; None while that is not known."""
        return wearer_now(self._newest(), self.anchoring.device_from_world(), name=self.plan.name)

    def status(self) -> WornStatus:
        """Return how it is doing."""
        sample = self._sample
        age = None if sample is None else (self._clock.now_ns() - sample.arrived_ns) / 1e9
        return WornStatus(
            self.headset.status(),
            self.anchoring.status(),
            self.meshing.status(),
            self.drawing.count,
            age,
        )

    def view(self) -> NDArray[np.uint8] | None:
        """Return (H, W, 3) uint8 RGB: what the wearer sees now; None before the first picture."""
        frame = self.anchoring.picture
        return None if frame is None else seen_by_wearer(frame, self.drawing.items())

    def save_mesh(self, folder: Path) -> Path | None:
        """Write the room's mesh with what the headset has added; None where it added nothing."""
        path = folder / MESH_FILE
        return path if self.meshing.save(path) else None

    def _note(self, kind: str, text: str) -> None:
        with self._events_lock:
            self._events.append((kind, text))

    def _take_events(self) -> tuple[tuple[str, str], ...]:
        said = [(event.kind, event.text) for event in self.headset.take_events()]
        with self._events_lock:
            said += self._events
            self._events.clear()
        return tuple(said)

    def _newest(self) -> HeadAndHands | None:
        """Return the newest head and hands while they say where the wearer is."""
        sample = self._sample
        if sample is None or self._clock.now_ns() - sample.arrived_ns > STALE_NS:
            return None
        return sample

    def _eye(self) -> np.ndarray | None:
        sample = self._sample
        if sample is None or sample.world_from_head is None:
            return None
        return sample.world_from_head.translation

    def _world_from_device(self) -> Pose | None:
        return self.anchoring.origin.world_from_device if self.anchoring.is_good else None

    def _follow_body(self, task: Task[None]) -> None:
        next_ns = 0
        while not task.is_cancelled:
            sample = self._body.take(WAIT_S)
            now_ns = self._clock.now_ns()
            if sample is not None:
                self._sample = sample
                self.body_delays.add((now_ns - sample.t_ns) / 1e6)
            pose, hub = self.anchoring.device_from_world(), self._hub()
            self._carrying.step(sample, device_from_world=pose, now_ns=now_ns)
            if now_ns >= next_ns:
                next_ns = now_ns + SHOW_EVERY_NS
                with suppress(RuntimeError):  # its loop has just ended
                    self._show(hub, pose, now_ns=now_ns)

    def _show(self, hub: Hub | None, device_from_world: Pose | None, *, now_ns: int) -> None:
        """Let others see the wearer, and surfaces hide what is behind them."""
        if hub is not None and self._is_away(now_ns):
            hub.meet([], way=WEARER)
        elif hub is not None:
            body, name = self._newest(), self.plan.name
            show_to(hub, body, device_from_world=device_from_world, name=name)
        those: dict[int, Hiding] = {id(each): each for each in (hub, self._elsewhere) if each}
        self._hidden.show(*those.values())

    def _is_away(self, now_ns: int) -> bool:
        """Return whether the headset has been silent for as long as a person may be away."""
        sample = self._sample
        return sample is None or now_ns - sample.arrived_ns >= AWAY_NS
