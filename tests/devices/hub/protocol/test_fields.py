"""Single fields of JSON: taken as they should be, refused by name otherwise."""

import pytest

from devices.hub.protocol.fields import (
    MAX_COUNT,
    MessageError,
    read_count,
    read_label,
    read_number,
    read_object,
    read_text,
)


def test_fields_of_the_right_type_are_taken():
    assert read_object(b'{"a": 1}') == {"a": 1}
    assert read_text({"a": "b"}, "a") == "b"
    assert read_count({"a": MAX_COUNT}, "a") == MAX_COUNT
    assert read_number(2, "a") == 2.0
    assert read_label("p1/a-1") == "p1/a-1"
    assert read_label(-3) == -3


@pytest.mark.parametrize("value", [None, True, "1", float("nan"), float("inf"), 10**400, [1], {}])
def test_what_is_no_number_is_refused_by_name(value):
    with pytest.raises(MessageError, match="size: wanted a number"):
        read_number(value, "size")


@pytest.mark.parametrize("value", [None, True, 1.5, "", "a b", "x" * 41, MAX_COUNT + 1, "a/b/c"])
def test_what_is_no_label_is_none(value):
    assert read_label(value) is None


@pytest.mark.parametrize("value", [None, 3, -1, 1.5, True, []])
def test_counts_and_texts_are_refused_by_name(value):
    with pytest.raises(MessageError, match="a: wanted a text"):
        read_text({"a": value}, "a")
    if value != 3:
        with pytest.raises(MessageError, match="a: wanted a whole number"):
            read_count({"a": value}, "a")
