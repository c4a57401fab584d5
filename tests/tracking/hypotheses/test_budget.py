"""A long computation that is spread over frames, and what its steps cost."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.hypotheses.budget import (
    BudgetExhausted,
    FrameBudget,
    MeasuredCosts,
    NominalCosts,
    RepeatedCosts,
    Step,
    steps_within,
)

STEPS = tuple(Step)


def step_of(number):
    return STEPS[number % len(STEPS)]


def long_sum(numbers, budget, log):
    def squared(number):
        log.append(number)
        return number * number

    total = 0
    for number in numbers:
        total += budget.do(step_of(number), squared, number)
    return total


def test_without_a_limit_all_is_done_at_once():
    log = []
    assert long_sum([1, 2, 3], FrameBudget(), log) == 14
    assert log == [1, 2, 3]


@given(st.lists(st.integers(0, 30)), st.floats(0.0, 60.0))
def test_spread_over_frames_it_comes_to_the_same_and_nothing_is_done_twice(numbers, budget_ms):
    log, done, frames = [], (), 0
    while True:
        budget, before = FrameBudget(budget_ms, done), len(log)
        try:
            found = long_sum(numbers, budget, log)
            break
        except BudgetExhausted:
            done, frames = budget.done(), frames + 1
            spent = [step_of(number).nominal_ms for number in log[before:]]
            assert spent, "every frame does something"
            assert sum(spent) <= max(budget_ms, spent[0])
    assert found == sum(number * number for number in numbers)
    assert log == numbers
    assert frames <= len(numbers)


def test_a_step_that_does_not_fit_waits_and_earlier_results_stay_as_they_were():
    log = []
    number = STEPS.index(Step.GATHER)
    first = FrameBudget(5.0)
    with pytest.raises(BudgetExhausted):
        long_sum([number, number], first, log)
    done = first.done()
    assert done == (number**2,)
    assert long_sum([number, number], FrameBudget(5.0, done), log) == 2 * number**2
    assert long_sum([number, number], FrameBudget(5.0, done), log) == 2 * number**2
    assert done == (number**2,)
    assert log == [number] * 3


class Watch:
    """A stopwatch that work moves on."""

    def __init__(self):
        self.t_ns = 0

    def __call__(self):
        return self.t_ns

    def work(self, ms):
        self.t_ns += round(ms * 1e6)
        return ms


@pytest.mark.parametrize(("ms", "steps"), [(3.0, 10), (30.0, 1)])
def test_measured_costs_approach_what_a_step_takes_on_this_machine(ms, steps):
    watch = Watch()
    costs = MeasuredCosts(watch)
    assert costs.cost_ms(Step.ALIGN) == Step.ALIGN.nominal_ms
    for _ in range(60):
        assert costs.timed(Step.ALIGN, lambda: watch.work(ms)) == (ms, pytest.approx(ms))
    assert costs.cost_ms(Step.ALIGN) == pytest.approx(ms, rel=1e-3)
    assert costs.cost_ms(Step.GATHER) == Step.GATHER.nominal_ms
    assert steps_within(costs, Step.ALIGN, 30_500_000) == steps


def test_a_slow_machine_does_fewer_steps_in_a_frame():
    def steps_done(ms):
        watch, log = Watch(), []
        costs = MeasuredCosts(watch)
        for _ in range(60):
            costs.timed(Step.ALIGN, lambda: watch.work(ms))
        budget = FrameBudget(50.0, costs=costs)

        def many():
            for _ in range(100):
                log.append(budget.do(Step.ALIGN, watch.work, ms))

        with pytest.raises(BudgetExhausted):
            many()
        return len(log)

    assert steps_done(2.0) > 20
    assert steps_done(24.0) == 2


def test_nominal_costs_are_the_same_whatever_a_step_takes():
    costs = NominalCosts()
    assert costs.timed(Step.GATHER, lambda: 7) == (7, Step.GATHER.nominal_ms)
    assert steps_within(costs, Step.LOCAL_HYPOTHESIS, 14_999_999) == 2


@given(
    st.lists(st.tuples(st.integers(1, 12), st.lists(st.integers(1, 10**8), max_size=12))),
    st.floats(0.5, 40.0),
)
def test_measured_costs_repeat_the_same_steps_in_the_same_frames(frames, budget_ms):
    """Whatever the steps took: with their durations given, as many are done in every frame."""
    clock = {"now": 0}
    pending = [ns for _, durations in frames for ns in durations]

    def stopwatch():
        clock["now"] += pending.pop() if pending and clock["now"] % 2 else 1
        return clock["now"]

    measured, repeated = MeasuredCosts(stopwatch), RepeatedCosts()

    def steps_of(costs, count):
        log = []
        with contextlib.suppress(BudgetExhausted):
            long_sum(list(range(count)), FrameBudget(budget_ms, (), costs), log)
        return log

    for count, _ in frames:
        done = steps_of(measured, count)
        repeated.give(measured.taken())
        assert steps_of(repeated, count) == done
        assert measured.taken() == ()
        for step in Step:
            assert measured.cost_ms(step) == repeated.cost_ms(step)


def test_more_steps_than_were_recorded_cost_the_nominal():
    costs = RepeatedCosts()
    costs.give([7.0])
    assert costs.timed(Step.CUT, lambda: "a") == ("a", 7.0)
    assert costs.timed(Step.CUT, lambda: "b") == ("b", Step.CUT.nominal_ms)
