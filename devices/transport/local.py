"""The transport within one process: whoever shares an exchange reaches each other."""

from __future__ import annotations

import threading
from collections.abc import Callable
from itertools import count

from devices.transport.keys import matches
from devices.transport.transport import (
    MAX_ANSWER_BYTES,
    MAX_QUESTION_BYTES,
    Answer,
    Handler,
    check_length,
)


class Exchange:
    """All subscriptions and services of a process's local transports."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._numbers = count()
        self._handlers: dict[int, tuple[str, Handler]] = {}
        self._answers: dict[int, tuple[str, Answer]] = {}

    def add_handler(self, pattern: str, handler: Handler) -> Callable[[], None]:
        """Let somebody hear; return what ends it."""
        with self._lock:
            number = next(self._numbers)
            self._handlers[number] = (pattern, handler)
        return lambda: self._forget(number)

    def add_answer(self, pattern: str, answer: Answer) -> Callable[[], None]:
        """Let somebody answer; return what ends it."""
        with self._lock:
            number = next(self._numbers)
            self._answers[number] = (pattern, answer)
        return lambda: self._forget(number)

    def listeners(self, key: str) -> list[Handler]:
        """Return who hears a key."""
        with self._lock:
            return [one for pattern, one in self._handlers.values() if matches(pattern, key)]

    def answerers(self, key: str) -> list[Answer]:
        """Return who answers at a key."""
        with self._lock:
            return [answer for pattern, answer in self._answers.values() if matches(pattern, key)]

    def _forget(self, number: int) -> None:
        with self._lock:
            self._handlers.pop(number, None)
            self._answers.pop(number, None)


class LocalTransport:
    """A `Transport` whose messages are heard before `put` returns, on its thread.

    Args:
        exchange: shared by all that are to reach each other.
    """

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._ends: list[Callable[[], None]] = []
        self._is_closed = False

    def put(self, key: str, data: bytes) -> None:
        """Send a message."""
        check_length(key, data)
        if self._is_closed:
            return
        for handler in self._exchange.listeners(key):
            handler(key, data)

    def subscribe(self, pattern: str, handler: Handler) -> Callable[[], None]:
        """Hear messages; return what ends it."""
        end = self._exchange.add_handler(pattern, handler)
        self._ends.append(end)
        return end

    def serve(self, pattern: str, answer: Answer) -> Callable[[], None]:
        """Answer questions; return what ends it."""
        end = self._exchange.add_answer(pattern, answer)
        self._ends.append(end)
        return end

    def ask(self, key: str, question: bytes, *, answered: Callable[[bytes], None]) -> None:
        """Ask; the answer comes before this returns."""
        check_length(key, question, limit=MAX_QUESTION_BYTES)
        if self._is_closed:
            return
        for answer in self._exchange.answerers(key):
            data = answer(key, question)
            if data is not None and len(data) <= MAX_ANSWER_BYTES:
                answered(data)
                return

    def close(self) -> None:
        """End all that it hears and answers."""
        self._is_closed = True
        for end in self._ends:
            end()
        self._ends.clear()
