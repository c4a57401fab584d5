"""The tracker's settings as words of a recording."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.options import SEARCH_MS_RANGE, TrackerOptions, options_from_text, options_text

options = st.builds(
    TrackerOptions, st.booleans(), st.booleans(), st.booleans(), st.floats(*SEARCH_MS_RANGE)
)


@given(options)
def test_reads_back_what_it_writes(value):
    assert options_from_text(options_text(value)) == value


def test_what_is_not_named_is_as_usual():
    assert options_from_text("texture=off") == TrackerOptions(texture=False)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("colour=on", "no setting 'colour'"),
        ("texture=1", "texture = '1', wanted on or off"),
        ("search_ms=0", "search_ms = 0.0, wanted 1 to 1000 ms"),
        ("search_ms=nan", "search_ms = nan, wanted"),
        ("search_ms=fast", "fast"),
    ],
)
def test_says_what_is_wrong(text, words):
    with pytest.raises(ValueError, match=words):
        options_from_text(text)
