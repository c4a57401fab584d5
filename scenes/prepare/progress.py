"""How long stages say how far they are, and how they are stopped."""

from __future__ import annotations

from typing import Protocol


class Cancelled(Exception):
    """Whoever watches no longer wants the result. What is finished stays."""


class Progress(Protocol):
    """Called with the share that a stage has done; raising `Cancelled` from it ends the stage."""

    def __call__(self, done: float, note: str) -> None:
        """`done` from 0 to 1 of this stage; `note` says in words what is going on."""
        ...


def silent(done: float, note: str) -> None:
    """A `Progress` that nobody watches."""
