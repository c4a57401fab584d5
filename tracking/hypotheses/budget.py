"""A long computation, spread over frames: each does some of its work, and nothing is done twice."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import ParamSpec, TypeVar, cast

P = ParamSpec("P")
T = TypeVar("T")


class NotYet(Exception):
    """The time for this frame is used up."""


class Pace:
    """Time for a computation that is begun anew in every frame, and comes a little further in each.

    What takes long in it is asked of `do`, which remembers all it did before. What is between that
    has to be quick, and to depend on nothing but what it began with and what `do` returned: so it
    comes by the same way again.

    Args:
        budget_ms: how much may be done in this frame; one piece of work is done in any case.
        done: what was done in the frames before.
    """

    def __init__(self, budget_ms: float = math.inf, done: Sequence[object] = ()) -> None:
        self._budget_ms = budget_ms
        self._done = list(done)
        self._asked = 0
        self._spent_ms = 0.0

    def do(self, cost_ms: float, work: Callable[P, T], *args: P.args, **keywords: P.kwargs) -> T:
        """What a piece of work returns, or returned before.

        Args:
            cost_ms: about how long it takes on one core of a laptop. A clock would not come by the
                same poses twice.
            work: a pure function.
            args: its arguments.
            keywords: and those with names.

        Raises:
            NotYet: it has to wait for the next frame.
        """
        if self._asked == len(self._done):
            if self._spent_ms > 0.0 and self._spent_ms + cost_ms > self._budget_ms:
                raise NotYet
            self._done.append(work(*args, **keywords))
            self._spent_ms += cost_ms
        self._asked += 1
        return cast(T, self._done[self._asked - 1])

    def done(self) -> tuple[object, ...]:
        """All that was done, to go on from."""
        return tuple(self._done)
