"""How values pass between threads. There is no unbounded queue: each type says what it gives up."""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class StreamFullError(ValueError):
    """A lossless queue has no room: whoever fills it must slow down or stop."""


class StreamClosedError(ValueError):
    """A value was put into a stream that is closed."""


class Slot(Generic[T]):
    """Holds the latest value only. Putting never blocks; what nobody took is dropped and counted.

    One producer, one consumer. `None` is not a value.
    """

    def __init__(self) -> None:
        self._value: T | None = None
        self._dropped = 0
        self._closed = False
        self._changed = threading.Condition()

    @property
    def dropped(self) -> int:
        """Values that were replaced before anyone took them."""
        return self._dropped

    def put(self, value: T) -> None:
        """Replace what is there.

        Raises:
            StreamClosedError: the slot is closed.
        """
        with self._changed:
            if self._closed:
                raise StreamClosedError("Slot: closed, takes no more values")
            self._dropped += self._value is not None
            self._value = value
            self._changed.notify_all()

    def take(self, timeout_s: float | None = 0.0) -> T | None:
        """Remove and return the latest value, waiting up to `timeout_s` (None: until one comes).

        Returns:
            The value, or None when time is up or the slot is closed and empty.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._value is not None or self._closed, timeout_s)
            value, self._value = self._value, None
            return value

    def close(self) -> None:
        """No more values; waiting consumers wake up. What is in it can still be taken."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed


class BoundedQueue(Generic[T]):
    """First in, first out, lossless: full is an error that the sender sees.

    Args:
        capacity: most values it holds, at least 1.
        name: what to call it in messages.
    """

    def __init__(self, capacity: int, *, name: str = "queue") -> None:
        if capacity < 1:
            raise ValueError(f"BoundedQueue {name!r}: capacity {capacity}, wanted at least 1")
        self._capacity = capacity
        self._name = name
        self._values: deque[T] = deque()
        self._closed = False
        self._changed = threading.Condition()

    def __len__(self) -> int:
        return len(self._values)

    def put(self, value: T, timeout_s: float | None = 0.0) -> None:
        """Append, waiting up to `timeout_s` for room (None: as long as it takes).

        Raises:
            StreamFullError: there was no room in time.
            StreamClosedError: the queue is closed.
        """
        with self._changed:
            room = self._changed.wait_for(
                lambda: len(self._values) < self._capacity or self._closed, timeout_s
            )
            if self._closed:
                raise StreamClosedError(f"{self._name}: closed, takes no more values")
            if not room:
                raise StreamFullError(
                    f"{self._name}: full with {self._capacity} values; the reader is too slow"
                )
            self._values.append(value)
            self._changed.notify_all()

    def take(self, timeout_s: float | None = 0.0) -> T | None:
        """Remove and return the oldest value; None when time is up, or closed and empty."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._values) or self._closed, timeout_s)
            value = self._values.popleft() if self._values else None
            self._changed.notify_all()
            return value

    def close(self) -> None:
        """No more values; everyone who waits wakes up. What is in it can still be taken."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed


class ByteQuota:
    """Counts bytes against a limit; the caller decides what to shed.

    Args:
        limit_bytes: most that may be spent, at least 0.
    """

    def __init__(self, limit_bytes: int) -> None:
        if limit_bytes < 0:
            raise ValueError(f"ByteQuota: limit {limit_bytes} bytes, wanted at least 0")
        self.limit_bytes = limit_bytes
        self._used_bytes = 0

    @property
    def used_bytes(self) -> int:
        """Spent so far; never above the limit."""
        return self._used_bytes

    def spend(self, size_bytes: int, *, reserve_bytes: int = 0) -> bool:
        """Take `size_bytes` if at least `reserve_bytes` stay free afterwards; else take nothing.

        Returns:
            Whether the bytes were taken.
        """
        if self._used_bytes + size_bytes + reserve_bytes > self.limit_bytes:
            return False
        self._used_bytes += size_bytes
        return True
