"""A HoloLens on the network: one connection a port, any number of consumers of each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from devices.clock import Clock
from devices.hololens.display_list import DisplayList
from devices.hololens.values import (
    HeadAndHands,
    HeadsetStatus,
    PersonalVideoFrame,
    StreamName,
    SurfaceChange,
)
from devices.messages import Event

T = TypeVar("T", covariant=True)


class Subscription(Protocol[T]):
    """One consumer's newest values; never more than one waits."""

    def take(self, timeout_s: float | None = 0.0) -> T | None:
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


@dataclass(frozen=True, slots=True)
class Ports:
    """TCP ports of the headset's program; others where a simulator listens elsewhere."""

    configuration: int = 3809
    video: int = 3810
    body: int = 3812
    surfaces: int = 3813
    display: int = 3816


@dataclass(frozen=True, slots=True)
class VideoOptions:
    """What is asked of the headset's camera."""

    width_px: int = 760
    height_px: int = 428
    fps: int = 30
    codec: str = "h264"


@dataclass(frozen=True, slots=True)
class HeadsetPlan:
    """A headset and what is wanted of it.

    Attributes:
        host: its address, as the operator entered it: the protocol has no password.
        ports: where it listens.
        streams: which are used; the clock always is.
        video: what its camera is asked for.
    """

    host: str
    ports: Ports = field(default_factory=Ports)
    streams: frozenset[StreamName] = frozenset(StreamName)
    video: VideoOptions = field(default_factory=VideoOptions)


class Headset:
    """Receives one headset, and draws on it, until it is closed; starts at once.

    Args:
        plan: which, and what is wanted of it.
        clock: session time.
    """

    def __init__(self, plan: HeadsetPlan, clock: Clock) -> None:
        raise NotImplementedError

    def video(self) -> Subscription[PersonalVideoFrame]:
        """Return the newest pictures for one more consumer."""
        raise NotImplementedError

    def body(self) -> Subscription[HeadAndHands]:
        """Return the newest head and hands for one more consumer."""
        raise NotImplementedError

    def surfaces(self) -> SurfaceSubscription:
        """Return changes of surfaces for one more consumer: first all that are there."""
        raise NotImplementedError

    def set_volumes(self, volumes: Iterable[object]) -> None:
        """Mesh only there from the next poll on."""
        raise NotImplementedError

    def draw(self, items: DisplayList) -> None:
        """Have this and nothing else on the display; never waits, the newest list wins."""
        raise NotImplementedError

    def status(self) -> HeadsetStatus:
        """Return how it is doing."""
        raise NotImplementedError

    def take_events(self) -> list[Event]:
        """Take the events since the last call, oldest first."""
        raise NotImplementedError

    def close(self) -> None:
        """Hang up; waits for the threads."""
        raise NotImplementedError
