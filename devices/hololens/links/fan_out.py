"""One source, any number of consumers: each has the newest value waiting, and never more."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Generic, TypeVar

from devices.hololens.values import SpatialSurface, SurfaceChange, SurfaceGone
from devices.streams import Slot, StreamClosedError

T = TypeVar("T")

MAX_CONSUMERS = 64
"""Consumers of one stream, chosen: a session has a tenth of that; more is one that never closes."""


class Newest(Generic[T]):
    """One consumer's newest value."""

    def __init__(self, leave: Callable[[Newest[T]], None]) -> None:
        self._leave = leave
        self.slot: Slot[T] = Slot()

    def take(self, timeout_s: float | None = 0.0) -> T | None:
        """Remove and return the newest value, waiting for it; None if none came meanwhile."""
        return self.slot.take(timeout_s)

    @property
    def dropped(self) -> int:
        """Values that newer ones replaced."""
        return self.slot.dropped

    def close(self) -> None:
        """Want no more."""
        self._leave(self)
        self.slot.close()


class FanOut(Generic[T]):
    """Gives every value to every consumer; never waits for one.

    Attributes:
        last: the newest value; None before the first.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._consumers: list[Newest[T]] = []
        self._is_closed = False
        self.last: T | None = None

    def subscribe(self) -> Newest[T]:
        """Return one more consumer, who gets the newest value at once if there is one.

        Raises:
            RuntimeError: there are `MAX_CONSUMERS`.
        """
        consumer = Newest[T](self._leave)
        with self._lock:
            if len(self._consumers) >= MAX_CONSUMERS:
                raise RuntimeError(f"{MAX_CONSUMERS} consumers of a stream: close those not needed")
            self._consumers.append(consumer)
            if self.last is not None:
                consumer.slot.put(self.last)
            if self._is_closed:
                consumer.slot.close()
        return consumer

    @property
    def dropped(self) -> int:
        """Values that the slowest of the present consumers never took."""
        with self._lock:
            return max((consumer.dropped for consumer in self._consumers), default=0)

    def put(self, value: T) -> None:
        """Give a value to all."""
        with self._lock:
            self.last = value
            for consumer in self._consumers:
                with suppress(StreamClosedError):
                    consumer.slot.put(value)

    def close(self) -> None:
        """No more values."""
        with self._lock:
            self._is_closed = True
            for consumer in self._consumers:
                consumer.slot.close()

    def _leave(self, consumer: Newest[T]) -> None:
        with self._lock, suppress(ValueError):
            self._consumers.remove(consumer)


class SurfaceChanges:
    """One consumer's changes of surfaces: of each surface the newest."""

    def __init__(self, leave: Callable[[SurfaceChanges], None]) -> None:
        self._leave = leave
        self._waiting: dict[str, SurfaceChange] = {}
        self._is_closed = False
        self._changed = threading.Condition()

    def take(self, timeout_s: float | None = 0.0) -> list[SurfaceChange]:
        """Remove and return what changed since the last call, waiting for something to change."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._waiting) or self._is_closed, timeout_s)
            taken = list(self._waiting.values())
            self._waiting.clear()
            return taken

    def add(self, change: SurfaceChange) -> None:
        """Have a change taken next."""
        with self._changed:
            self._waiting.pop(change.id, None)
            self._waiting[change.id] = change
            self._changed.notify_all()

    def close(self) -> None:
        """Want no more."""
        self._leave(self)
        self.end()

    def end(self) -> None:
        """Wake whoever waits: no more will come."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()


class SurfaceFanOut:
    """Surfaces that there are, and their changes for every consumer.

    At most as many surfaces wait for a consumer as the headset may list.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._consumers: list[SurfaceChanges] = []
        self._surfaces: dict[str, SpatialSurface] = {}
        self._is_closed = False

    def __len__(self) -> int:
        return len(self._surfaces)

    def versions(self) -> dict[str, int]:
        """Return the version of each surface that there is, by its id."""
        with self._lock:
            return {each.id: each.version for each in self._surfaces.values()}

    def subscribe(self) -> SurfaceChanges:
        """Return one more consumer, who gets all surfaces at first.

        Raises:
            RuntimeError: there are `MAX_CONSUMERS`.
        """
        consumer = SurfaceChanges(self._leave)
        with self._lock:
            if len(self._consumers) >= MAX_CONSUMERS:
                raise RuntimeError(f"{MAX_CONSUMERS} consumers of surfaces: close those not needed")
            for surface in self._surfaces.values():
                consumer.add(surface)
            self._consumers.append(consumer)
            if self._is_closed:
                consumer.end()
        return consumer

    def put(self, change: SurfaceChange) -> None:
        """Give a change to all."""
        with self._lock:
            if isinstance(change, SurfaceGone):
                self._surfaces.pop(change.id, None)
            else:
                self._surfaces[change.id] = change
            for consumer in self._consumers:
                consumer.add(change)

    def close(self) -> None:
        """No more changes."""
        with self._lock:
            self._is_closed = True
            for consumer in self._consumers:
                consumer.end()

    def _leave(self, consumer: SurfaceChanges) -> None:
        with self._lock, suppress(ValueError):
            self._consumers.remove(consumer)
