"""Orders are balanced: every place and every neighbour equally often."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise

import pytest

from studio.study.order import latin_square, participant_ids, trials_of
from studio.study.plan import FIRST_STUDY, Condition, read_study

STUDY = read_study(FIRST_STUDY)


@pytest.mark.parametrize("count", range(1, 8))
def test_a_latin_square_is_balanced(count):
    rows = latin_square(count)
    assert len(rows) == (1 if count == 1 else count * (1 + count % 2))
    for place in range(count):
        assert set(Counter(row[place] for row in rows).values()) == {len(rows) // count}
    after = Counter(pair for row in rows for pair in pairwise(row))
    assert len(after) == count * (count - 1)
    assert len(set(after.values())) <= 1


@pytest.mark.parametrize("conditions", [2, 3, 4])
def test_conditions_are_balanced_over_participants(conditions):
    count = len(latin_square(conditions))
    study = replace(
        STUDY,
        participants=4 * count,
        conditions=tuple(Condition(f"c{k}", f"c{k}") for k in range(conditions)),
    )
    trials = trials_of(study)
    firsts = Counter(t.condition for t in trials if t.number == 1)
    assert set(firsts.values()) == {4 * count // conditions}
    begins = Counter((t.condition, t.task) for t in trials if t.number == 1)
    assert len(begins) == 2 * conditions  # each task begins each condition
    for participant in participant_ids(study):
        own = [t for t in trials if t.participant == participant]
        assert len({(t.condition, t.task) for t in own}) == len(own) == 2 * conditions
        assert [t.is_last for t in own] == [False] * (len(own) - 1) + [True]
        assert sum(t.ends_condition for t in own) == conditions


def test_ids_are_different_and_say_nothing_of_an_order():
    ids = participant_ids(replace(STUDY, participants=200))
    assert len(set(ids)) == 200
    assert list(ids) != sorted(ids)
    assert participant_ids(STUDY) == ids[: STUDY.participants]
