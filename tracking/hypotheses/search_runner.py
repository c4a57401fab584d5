"""Runners of long searches and looks: in the frames, beside them, or as was recorded.

A search is a pure function of the frame in which it began, so that these differ only in the frame
in which its result is there. In the frames it takes a share of each, and a session may repeat; a
live session, which may not wait, computes it beside (`tracking.beside`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from tracking.hypotheses.budget import NOMINAL_COSTS, BudgetExhausted, FrameBudget, StepCosts

T = TypeVar("T")

Work = Callable[[FrameBudget], T]
"""A search that goes through a budget; raises `BudgetExhausted` where that ends."""


@dataclass(frozen=True, slots=True, eq=False)
class Progress:
    """How far a search is.

    Attributes:
        done: results of its steps so far, of one that is computed in the frames.
        number: of one that is computed beside them.
    """

    done: Sequence[object] = ()
    number: int | None = None


BEGUN = Progress()
"""Of a search of which nothing is computed yet."""


class SearchRunner(Protocol):
    """Computes searches, one at a time for each tracker's state."""

    def advance(
        self, progress: Progress, work: Work[T], *, budget_ms: float
    ) -> tuple[Progress, T | None]:
        """How far a search is in this frame, and its result once it has one.

        Args:
            progress: after the frame before; `BEGUN` of a new one.
            work: the search; the same in all frames of one. It can be pickled.
            budget_ms: time that it may take of this frame.
        """
        ...

    def give_up(self, progress: Progress) -> None:
        """Nobody will ask for the result of a search any more."""
        ...


class SearchInFrames:
    """Computes some steps in each frame.

    Args:
        costs: of the steps.
    """

    def __init__(self, costs: StepCosts = NOMINAL_COSTS) -> None:
        self._costs = costs

    def advance(
        self, progress: Progress, work: Work[T], *, budget_ms: float
    ) -> tuple[Progress, T | None]:
        """See `SearchRunner.advance`."""
        budget = FrameBudget(budget_ms, progress.done, self._costs)
        try:
            return progress, work(budget)
        except BudgetExhausted:
            return Progress(budget.done()), None

    def give_up(self, progress: Progress) -> None:
        """See `SearchRunner.give_up`: its steps are forgotten with it."""


IN_FRAMES = SearchInFrames()
"""Stateless default: by nominal costs, the same in every run."""


class SearchAsRecorded:
    """Has the result of a search in the frame in which it was there once.

    Args:
        costs: of a recording whose searches were computed in the frames.
    """

    def __init__(self, costs: StepCosts) -> None:
        self._in_frames = SearchInFrames(costs)
        self._ends: bool | None = None

    def give(self, *, ends: bool | None) -> None:
        """Whether a search ended in the next frame; None if it was computed in the frames."""
        self._ends = ends

    def advance(
        self, progress: Progress, work: Work[T], *, budget_ms: float
    ) -> tuple[Progress, T | None]:
        """See `SearchRunner.advance`."""
        if self._ends is None:
            return self._in_frames.advance(progress, work, budget_ms=budget_ms)
        return progress, work(FrameBudget()) if self._ends else None

    def give_up(self, progress: Progress) -> None:
        """See `SearchRunner.give_up`: nothing of it was computed."""
