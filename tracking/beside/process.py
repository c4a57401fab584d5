"""The process that computes searches: reads them on stdin, writes what they gave.

They are computed one after the other. One that is given up, or all at the end of stdin, ends at
its next step.
"""

from __future__ import annotations

import os
import queue
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from io import BufferedIOBase
from typing import cast

from scenes.memory import return_free_pages, share_one_heap
from scenes.workers.task import Task
from tracking.beside.messages import (
    Answer,
    Part,
    decoded,
    encoded,
    read_message,
    write_message,
)
from tracking.hypotheses.budget import BudgetExhausted, FrameBudget

MAX_WAITING = 3
"""Searches that wait, 0.13 GB each with pictures of 2880 × 1440. A session has two at most, its own
and that of settings tried beside, and one that it has just given up."""

SEARCHES = ("tracking.follow.redetection", "tracking.follow.rebirth")
"""The modules whose functions are ordered."""

Order = Callable[[FrameBudget], object]
"""A search; everything that it needs comes with it. A message without parts gives it up."""


def serve(orders: BufferedIOBase, answers: BufferedIOBase) -> None:
    """Compute searches until there is an end of orders."""
    waiting: queue.Queue[tuple[int, list[Part]] | None] = queue.Queue(MAX_WAITING)
    given_up: set[int] = set()
    is_over = threading.Event()

    def listen(_task: Task[None]) -> None:
        while _read_next(orders, waiting, given_up):
            pass
        is_over.set()
        waiting.put(None)

    Task("orders", listen).start()

    def is_given_up(number: int) -> bool:
        return number in given_up or is_over.is_set()

    while (number := _serve_next(waiting, answers, is_given_up)) is not None:
        given_up.difference_update([n for n in tuple(given_up) if n <= number])
        return_free_pages()


def _read_next(
    orders: BufferedIOBase,
    waiting: queue.Queue[tuple[int, list[Part]] | None],
    given_up: set[int],
) -> bool:
    """Read the next order; whether there was one. Nothing of it is held here afterwards."""
    message = read_message(orders)
    if message is None:
        return False
    number, parts = message
    if parts:
        waiting.put((number, parts))
    else:
        given_up.add(number)
    return True


def _serve_next(
    waiting: queue.Queue[tuple[int, list[Part]] | None],
    answers: BufferedIOBase,
    is_given_up: Callable[[int], bool],
) -> int | None:
    """Compute the next search; its number, None at the end. Nothing of it stays in memory."""
    ordered = waiting.get()
    if ordered is None:
        return None
    number, parts = ordered
    answer = _answer(parts, lambda: is_given_up(number))
    if answer:
        write_message(answers, number, answer)
    return number


def _answer(parts: Sequence[Part], is_given_up: Callable[[], bool]) -> list[Part]:
    """Return the encoded result of an order; empty if it is given up."""
    try:
        order = cast(Order, decoded(parts))
        return encoded(Answer(order(FrameBudget(is_given_up=is_given_up))))
    except BudgetExhausted:
        return []
    except Exception:  # noqa: BLE001 - raised in the session
        return encoded(Answer(None, traceback.format_exc(limit=-3)))


def main(niceness: int) -> None:
    """Serve stdin and stdout; whatever else prints goes to stderr."""
    # Ctrl-C in a terminal is for the session, which ends this with its pipes.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(niceness)
    share_one_heap()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    # The first search shall not wait for the modules that it needs.
    for name in SEARCHES:
        import_module(name)
    with suppress(BrokenPipeError):
        serve(cast(BufferedIOBase, sys.stdin.buffer), answers)
    # A thread still reads; nothing is left to be put away.
    os._exit(0)


if __name__ == "__main__":
    main(int(sys.argv[1]))
