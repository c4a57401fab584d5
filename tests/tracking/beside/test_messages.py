"""Values pass between a session and its search process as they are, arrays without a copy."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tracking.beside.messages import decoded, encoded, read_message, write_message

ARRAYS = hnp.arrays(
    st.sampled_from([np.uint8, np.float32, np.float64]),
    hnp.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=5),
)


@given(st.lists(st.tuples(st.integers(0, 2**40), st.dictionaries(st.text(), ARRAYS)), max_size=4))
def test_what_is_written_is_read(messages):
    stream = io.BytesIO()
    for number, value in messages:
        write_message(stream, number, encoded(value))
    stream.seek(0)
    for number, value in messages:
        message = read_message(stream)
        assert message is not None
        assert message[0] == number
        read = decoded(message[1])
        assert read.keys() == value.keys()
        for key, array in value.items():
            np.testing.assert_array_equal(read[key], array)
            assert read[key].dtype == array.dtype
    assert read_message(stream) is None


@pytest.mark.parametrize("cut", [1, 11, 13, 20, 60])
def test_a_message_that_ends_early_is_none(cut):
    stream = io.BytesIO()
    write_message(stream, 7, encoded(np.arange(20)))
    assert cut < len(stream.getvalue())
    assert read_message(io.BytesIO(stream.getvalue()[:cut])) is None


def test_arrays_are_not_copied_into_the_pickle():
    picture = np.zeros((100, 100, 3), np.uint8)
    head, content = encoded(("a picture", picture))
    assert len(head) < 1000
    assert np.shares_memory(np.frombuffer(content, np.uint8), picture)


def test_a_message_without_parts_gives_up():
    stream = io.BytesIO()
    write_message(stream, 3, ())
    stream.seek(0)
    assert read_message(stream) == (3, [])
