"""A HoloLens on the network: one connection a port, any number of consumers of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

from devices.adapter import Sink
from devices.clock import Clock
from devices.hololens.body import Body
from devices.hololens.camera.video import Video
from devices.hololens.configuration import Configuration
from devices.hololens.display import Display
from devices.hololens.display_list import DisplayList
from devices.hololens.plan import HeadsetPlan, MeshedBox
from devices.hololens.surfaces import Surfaces
from devices.hololens.values import (
    HeadAndHands,
    HeadsetStatus,
    PersonalVideoFrame,
    StreamName,
    StreamState,
    StreamStatus,
    SurfaceChange,
)
from devices.hololens.wire.remote_configuration import Request, Values
from devices.messages import EncodedFrame, Event

V_co = TypeVar("V_co", covariant=True)


class Subscription(Protocol[V_co]):
    """One consumer's newest values; never more than one waits."""

    def take(self, timeout_s: float | None = 0.0) -> V_co | None:
        """Remove and return the newest value, waiting for it; None if none came meanwhile."""
        ...

    def close(self) -> None:
        """Want no more."""
        ...


class SurfaceSubscription(Protocol):
    """One consumer's changes of surfaces; of each surface only the newest waits."""

    def take(self, timeout_s: float | None = 0.0) -> list[SurfaceChange]:
        """Remove and return what changed since the last call, waiting for something to change."""
        ...

    def close(self) -> None:
        """Want no more."""
        ...


ASK_S = 2.0
"""Longest wait for an answer to a command, seconds."""

OFF = StreamStatus(StreamState.OFF, "not asked for")
"""Status of a stream that nobody wants."""


class Headset:
    """Receives one headset, and draws on it, until it is closed; starts at once.

    Args:
        plan: which, and what is wanted of it.
        clock: session time.
        packets: takes every encoded picture of its camera, in order; it must not block.

    Raises:
        ValueError: the video's codec is none that the headset has.
    """

    def __init__(
        self, plan: HeadsetPlan, clock: Clock, *, packets: Sink[EncodedFrame] | None = None
    ) -> None:
        self.plan = plan
        ports, wanted = plan.ports, plan.streams
        self._configuration = Configuration(
            (plan.host, ports.configuration), clock, retry_s=plan.retry_s
        )
        self._video = self._body = self._surfaces = self._display = None
        if StreamName.VIDEO in wanted:
            self._video = Video(
                (plan.host, ports.video),
                clock,
                options=plan.video,
                configuration=self._configuration,
                packets=packets,
                retry_s=plan.retry_s,
            )
        if StreamName.BODY in wanted:
            self._body = Body(
                (plan.host, ports.body),
                clock,
                configuration=self._configuration,
                retry_s=plan.retry_s,
            )
        if StreamName.SURFACES in wanted:
            self._surfaces = Surfaces(
                (plan.host, ports.surfaces),
                clock,
                boxes=plan.boxes,
                triangles_per_m3=plan.triangles_per_m3,
                retry_s=plan.retry_s,
            )
        if StreamName.DISPLAY in wanted:
            self._display = Display((plan.host, ports.display), clock, retry_s=plan.retry_s)

    def video(self) -> Subscription[PersonalVideoFrame]:
        """Return the newest pictures for one more consumer.

        Raises:
            ValueError: the plan has no video.
        """
        return _there(self._video, StreamName.VIDEO).frames.subscribe()

    def body(self) -> Subscription[HeadAndHands]:
        """Return the newest head and hands for one more consumer.

        Raises:
            ValueError: the plan has no body.
        """
        return _there(self._body, StreamName.BODY).samples.subscribe()

    def surfaces(self) -> SurfaceSubscription:
        """Return changes of surfaces for one more consumer: first all that are there.

        Raises:
            ValueError: the plan has no surfaces.
        """
        return _there(self._surfaces, StreamName.SURFACES).changes.subscribe()

    def mesh(self, boxes: Sequence[MeshedBox]) -> None:
        """Mesh there and nowhere else, from the next poll on.

        Raises:
            ValueError: the plan has no surfaces.
        """
        _there(self._surfaces, StreamName.SURFACES).set_boxes(boxes)

    def draw(self, items: DisplayList) -> None:
        """Have this and nothing else on the display; never waits, the newest list wins.

        Raises:
            ValueError: the plan has no display, or there are too many items.
        """
        _there(self._display, StreamName.DISPLAY).draw(items)

    def configure(self, request: Request) -> Values:
        """Return the answer to a command of remote configuration; empty where it has none.

        Raises:
            HeadsetError: the headset does not answer.
        """
        return self._configuration.ask(request, ASK_S)

    def session_ns(self, ticks: int) -> int | None:
        """Return the session time of a time of the headset's, 100 ns; None before it is known."""
        return self._configuration.session_ns(ticks)

    def status(self) -> HeadsetStatus:
        """Return how it is doing."""
        parts = {
            StreamName.VIDEO: self._video,
            StreamName.BODY: self._body,
            StreamName.SURFACES: self._surfaces,
            StreamName.DISPLAY: self._display,
        }
        streams = {
            str(name): OFF if part is None else part.status() for name, part in parts.items()
        }
        streams[str(StreamName.CLOCK)] = self._configuration.health.status()
        return HeadsetStatus(
            self.plan.host,
            streams,
            self._configuration.version,
            self._configuration.estimate,
            0 if self._surfaces is None else len(self._surfaces.changes),
            0 if self._display is None else self._display.drawn,
        )

    def take_events(self) -> list[Event]:
        """Take the events since the last call, oldest first."""
        parts = (self._configuration, self._video, self._body, self._surfaces, self._display)
        taken = [e for part in parts if part is not None for e in part.health.take_events()]
        return sorted(taken, key=lambda event: event.t_ns)

    def close(self) -> None:
        """Take everything off the display, stop the camera, hang up; waits for the threads."""
        for part in (self._display, self._surfaces, self._body, self._video, self._configuration):
            if part is not None:
                part.close()


P = TypeVar("P", Video, Body, Surfaces, Display)


def _there(part: P | None, name: StreamName) -> P:
    if part is None:
        raise ValueError(f"headset: no {name}: name it in HeadsetPlan.streams")
    return part
