"""Orders in which participants meet conditions and tasks, balanced by Latin squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from studio.study.plan import Asked, Study, When

T = TypeVar("T")

LETTERS = "BCDFGHJKLMNPQRSTVWXZ"
"""Of anonymous ids: no vowels, so that no id is a word."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One task of one participant under one condition.

    Attributes:
        participant: anonymous id.
        number: 1 of the first one.
        condition: its id.
        task: its id.
        ends_condition: whether it is the last one of its condition.
        is_last: whether it is the participant's last one.
    """

    participant: str
    number: int
    condition: str
    task: str
    ends_condition: bool
    is_last: bool

    @property
    def name(self) -> str:
        """Name of its folder and of its rows in tables."""
        return f"{self.participant}-{self.number}"

    def asks(self, asked: Asked) -> bool:
        """Return whether a questionnaire is answered after this trial."""
        match asked.when:
            case When.FIRST:
                return False
            case When.TASK:
                return True
            case When.CONDITION:
                return self.ends_condition
            case When.END:
                return self.is_last


def latin_square(count: int) -> tuple[tuple[int, ...], ...]:
    """Return orders of so many items in which each is in each place equally often.

    They are Williams' designs: each item also comes right after each other one equally often, so
    that what lingers of one is met by all alike. An even count needs as many orders as items, an
    odd one twice as many.

    Raises:
        ValueError: fewer than one item.
    """
    if count < 1:
        raise ValueError(f"latin square: count = {count}, wanted at least 1")
    # 0, 1, n-1, 2, n-2 …: the steps from one to the next are all different.
    first = [0]
    low, high = 1, count - 1
    while low <= high:
        first.append(low)
        low += 1
        if low <= high:
            first.append(high)
            high -= 1
    rows = [tuple((value + shift) % count for value in first) for shift in range(count)]
    if count % 2 and count > 1:
        rows += [tuple(reversed(row)) for row in rows]
    return tuple(rows)


def participant_ids(study: Study) -> tuple[str, ...]:
    """Return anonymous ids: they say neither who somebody is nor in which order people came."""
    rng = np.random.default_rng([study.seed, 1])
    found: list[str] = []
    while len(found) < study.participants:
        letters = "".join(LETTERS[k] for k in rng.integers(0, len(LETTERS), 3))
        name = f"{letters}{int(rng.integers(0, 10))}"
        if name not in found:
            found.append(name)
    return tuple(found)


def trials_of(study: Study) -> tuple[Trial, ...]:
    """Return all trials, participant by participant, in the order in which they are done.

    Conditions are balanced by the rows of a Latin square, tasks within them by another one; both
    begin at a row by the study's seed.
    """
    return tuple(
        trial
        for place, participant in enumerate(participant_ids(study))
        for trial in _trials(study, participant, place=place)
    )


def _trials(study: Study, participant: str, *, place: int) -> list[Trial]:
    rng = np.random.default_rng([study.seed, 2])
    shift = int(rng.integers(0, 1000))
    conditions = _ordered(study.conditions, place + shift)
    # Tasks go on by one row after each round of conditions: all pairs of orders come up.
    rounds = (place + shift) // len(latin_square(len(study.conditions)))
    found: list[Trial] = []
    for at, condition in enumerate(conditions):
        tasks = _ordered(study.tasks, rounds + at)
        for k, task in enumerate(tasks):
            ends = k == len(tasks) - 1
            found.append(
                Trial(
                    participant,
                    len(found) + 1,
                    condition.condition_id,
                    task.task_id,
                    ends,
                    ends and at == len(conditions) - 1,
                )
            )
    return found


def _ordered(items: Sequence[T], row: int) -> list[T]:
    square = latin_square(len(items))
    return [items[k] for k in square[row % len(square)]]
