"""A long computation spread over frames within a time budget, and the costs of its steps.

Each frame does some of the work, and no step is done twice. How many steps fit into a frame follows
from their costs: nominal ones, the same in every run, or running estimates from a stopwatch.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from enum import Enum
from typing import ParamSpec, Protocol, TypeVar, cast

P = ParamSpec("P")
T = TypeVar("T")

ESTIMATE_SHARE = 0.2
"""Weight of a new duration in the running estimate of a step's cost. Chosen on lab and desk."""


MAX_DURATIONS = 100_000
"""Durations that are kept until they are taken: more than the steps of any frame (a first one with
all objects gone has some thousands)."""


class Step(Enum):
    """A step of a search with its nominal cost in ms, by which runs that must repeat are paced.

    Processor time was two to three times that while the likelihood was computed in numpy (medians
    in rooms 101 and 102: a whole look 43, screening 9, an alignment 8, a solve 9, a comparison 9, a
    local hypothesis 8 ms); its kernel takes a fifth to a half. At those costs a search took 60
    pictures of ten a second instead of 25: a book that was put down stayed lost for the rest of the
    default rehearsal. Live sessions pace by `MeasuredCosts`.

    A look's four parts and the four groups of yaws share what the whole cost before it was parted;
    a climb, 8 ms, takes 9 steps (median of 24 starts on a desk; 6 to 15).
    """

    LOOK = ("compare a whole lens with what is known, a part of it", 7.5)
    PLACES = ("list the places of the support planes", 4.0)
    CUT = ("cut places out of a lens", 4.0)
    PROPOSE = ("choose the best places", 4.0)
    SCREEN = ("screen some proposals", 4.0)
    ALIGN = ("align a pose", 3.0)
    GATHER = ("gather the evidence of a window", 4.0)
    TURN = ("compare some yaws at a place", 3.75)
    SOLVE = ("solve a pose by its outline", 3.0)
    SUPPORT = ("compare some poses by the likelihood", 3.0)
    PATCH = ("fit a pose by its colours", 4.0)
    CLIMB = ("climb the likelihood by a step", 1.0)
    BIRTH = ("look for an object around where it was known", 60.0)
    BESIDE = ("compare a moving object's pose with those beside it", 20.0)
    LOCAL_HYPOTHESIS = ("evaluate a hypothesis beside the prediction", 5.0)
    YAWS = ("propose other yaws of a tracked object", 2.0)
    COMPARE = ("compare places with templates", 4.0)

    def __init__(self, what: str, nominal_ms: float) -> None:
        self.what = what
        self.nominal_ms = nominal_ms


class StepCosts(Protocol):
    """Runs steps, and estimates what they cost."""

    def cost_ms(self, step: Step) -> float:
        """Expected duration of a step in ms."""
        ...

    def timed(self, step: Step, work: Callable[[], T]) -> tuple[T, float]:
        """Result of a step, and its duration in ms."""
        ...


class NominalCosts:
    """Nominal costs: every run does the same steps in the same frames."""

    def cost_ms(self, step: Step) -> float:
        """Nominal duration of a step in ms."""
        return step.nominal_ms

    def timed(self, step: Step, work: Callable[[], T]) -> tuple[T, float]:
        """Result of a step, and its nominal duration in ms."""
        return work(), step.nominal_ms


class _Estimates:
    """Running estimates of the costs of steps, beginning with the nominal ones."""

    def __init__(self) -> None:
        self._estimates_ms = {step: step.nominal_ms for step in Step}

    def cost_ms(self, step: Step) -> float:
        """Estimated duration of a step in ms."""
        return self._estimates_ms[step]

    def _learn(self, step: Step, duration_ms: float) -> None:
        self._estimates_ms[step] += ESTIMATE_SHARE * (duration_ms - self._estimates_ms[step])


class MeasuredCosts(_Estimates):
    """Costs as they are measured on this machine.

    Args:
        stopwatch: returns nanoseconds from any origin.
    """

    def __init__(self, stopwatch: Callable[[], int]) -> None:
        super().__init__()
        self._stopwatch = stopwatch
        self._durations_ms: deque[float] = deque(maxlen=MAX_DURATIONS)

    def timed(self, step: Step, work: Callable[[], T]) -> tuple[T, float]:
        """Result of a step, and its measured duration in ms."""
        began_ns = self._stopwatch()
        result = work()
        duration_ms = (self._stopwatch() - began_ns) / 1e6
        self._learn(step, duration_ms)
        self._durations_ms.append(duration_ms)
        return result, duration_ms

    def taken(self) -> tuple[float, ...]:
        """Durations of the steps since the last call, in order, ms: what `RepeatedCosts` needs."""
        durations = tuple(self._durations_ms)
        self._durations_ms.clear()
        return durations


class RepeatedCosts(_Estimates):
    """Costs as they were measured once: the same steps in the same frames again."""

    def __init__(self) -> None:
        super().__init__()
        self._durations_ms: deque[float] = deque()

    def give(self, durations_ms: Sequence[float]) -> None:
        """The durations of the next frame's steps; what the frame before left is forgotten."""
        self._durations_ms.clear()
        self._durations_ms.extend(durations_ms)

    def timed(self, step: Step, work: Callable[[], T]) -> tuple[T, float]:
        """Result of a step, and its duration then; a step more than then costs the nominal."""
        duration_ms = self._durations_ms.popleft() if self._durations_ms else step.nominal_ms
        self._learn(step, duration_ms)
        return work(), duration_ms


NOMINAL_COSTS = NominalCosts()
"""Stateless default."""


def steps_within(costs: StepCosts, step: Step, budget_ns: int) -> int:
    """Number of steps that fit into a budget in ns."""
    return budget_ns // max(round(costs.cost_ms(step) * 1e6), 1)


class BudgetExhausted(Exception):
    """The budget of this frame is used up."""


class FrameBudget:
    """Budget of a computation that is begun anew in every frame and gets farther in each.

    Expensive steps go through `do`, which replays the results of earlier frames. The code between
    them has to be quick, and to depend only on its inputs and those results.

    Args:
        budget_ms: for this frame; one step is done in any case.
        done: results of the steps of earlier frames.
        costs: of the steps.
        is_given_up: asked before every step; no more of them are done then.
    """

    def __init__(
        self,
        budget_ms: float = math.inf,
        done: Sequence[object] = (),
        costs: StepCosts = NOMINAL_COSTS,
        *,
        is_given_up: Callable[[], bool] = lambda: False,
    ) -> None:
        self._budget_ms = budget_ms
        self._is_given_up = is_given_up
        self._done = list(done)
        self._costs = costs
        self._replayed = 0
        self._spent_ms = 0.0

    def do(self, step: Step, work: Callable[P, T], *args: P.args, **keywords: P.kwargs) -> T:
        """The result of a step, computed now or in an earlier frame.

        Args:
            step: which step, for its cost.
            work: a pure function.
            args: its arguments.
            keywords: its keyword arguments.

        Raises:
            BudgetExhausted: the step has to wait for the next frame, or is not needed any more.
        """
        if self._replayed == len(self._done):
            cost_ms = self._costs.cost_ms(step)
            is_spent = self._spent_ms > 0.0 and self._spent_ms + cost_ms > self._budget_ms
            if is_spent or self._is_given_up():
                raise BudgetExhausted
            result, spent_ms = self._costs.timed(step, lambda: work(*args, **keywords))
            self._done.append(result)
            self._spent_ms += spent_ms
        self._replayed += 1
        return cast(T, self._done[self._replayed - 1])

    def done(self) -> tuple[object, ...]:
        """Results of all steps so far."""
        return tuple(self._done)
