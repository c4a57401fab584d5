"""Answers to items are checked."""

import pytest

from studio.study.questionnaires import KNOWN, SUS, Item


@pytest.mark.parametrize(
    ("item", "value"),
    [
        (Item("a", "?"), "6"),
        (Item("a", "?"), "2.5"),
        (Item("a", "?", "scale"), "7"),
        (Item("a", "?", "scale"), "105"),
        (Item("a", "?", "choice", options=("x", "y")), "z"),
        (Item("a", "?", "number"), "-3"),
        (Item("a", "?", "text"), "x" * 4001),
        (Item("a", "?"), ""),
        (Item("a", "?"), None),
    ],
)
def test_what_is_no_answer_is_refused(item, value):
    with pytest.raises(ValueError, match="a"):
        item.checked(value)


def test_every_known_questionnaire_has_items_of_different_names():
    for questionnaire in KNOWN.values():
        names = [item.name for item in questionnaire.items]
        assert len(set(names)) == len(names) > 0
    assert len(KNOWN["tlx-weighed"].items) == 6 + 15
    assert len(SUS.items) == 10


def test_an_answer_to_no_item_is_refused():
    with pytest.raises(ValueError, match="no item 'SQ11'"):
        SUS.checked({f"SQ{k}": "3" for k in range(1, 12)})
