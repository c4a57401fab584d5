"""The protocol between machines: messages to whoever listens, and questions to who can answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

MAX_MESSAGE_BYTES = 1024 * 1024
"""Length of a message, chosen: a picture of a live surface, the largest, has half of it."""

MAX_QUESTION_BYTES = 1024
"""Length of a question: a header and room for another version's."""

MAX_ANSWER_BYTES = 8 * 1024 * 1024
"""Length of an answer: a log's snapshot of 4 MB and its frame, twice."""

ASK_S = 1.0
"""Time that an answer may take, seconds: a router that was killed is back by then."""

Handler = Callable[[str, bytes], None]
"""Takes key and bytes of a message, on any thread; has to return at once."""

Answer = Callable[[str, bytes], bytes | None]
"""Gives the answer to a question, by its key; None where there is none. On any thread."""


class TransportError(OSError):
    """The other machines are not reached; says which address, and what to do."""


class Transport(Protocol):
    """A way between machines. Any thread; nothing waits for a network.

    A message reaches whoever subscribes at that moment, or is lost: an overfull link drops it. What
    must arrive is asked for again, see `Source` and `Follower`.
    """

    def put(self, key: str, data: bytes) -> None:
        """Send a message; returns at once.

        Raises:
            ValueError: it is too long.
        """
        ...

    def subscribe(self, pattern: str, handler: Handler) -> Callable[[], None]:
        """Hear messages whose keys a pattern holds (`*` one part, `**` at the end any).

        Returns:
            What ends it.
        """
        ...

    def serve(self, pattern: str, answer: Answer) -> Callable[[], None]:
        """Answer questions at keys that a pattern holds.

        Returns:
            What ends it.
        """
        ...

    def ask(self, key: str, question: bytes, *, answered: Callable[[bytes], None]) -> None:
        """Ask at a key; returns at once. Without an answer in time `answered` is not called."""
        ...

    def close(self) -> None:
        """End; harmless when it has ended."""
        ...


def check_length(key: str, data: bytes, *, limit: int = MAX_MESSAGE_BYTES) -> None:
    """Check that a message is as long as may be.

    Raises:
        ValueError: it is longer.
    """
    if len(data) > limit:
        raise ValueError(f"message at {key}: {len(data)} bytes, at most {limit}; send less")
