"""A picture in strips is the picture."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracking.background.strips import STRIPS, Strips, strip_of


@given(height=st.integers(STRIPS, 100), data=st.data())
def test_a_rectangle_of_the_strips_is_that_of_the_picture(height, data):
    picture = np.arange(height * 7 * 3).reshape(height, 7, 3)
    first, last = sorted(data.draw(st.tuples(*[st.integers(0, height)] * 2)))
    step = data.draw(st.integers(1, 9))
    place = slice(first, last, step), slice(1, None, 2)
    found = Strips.of(picture)
    assert found.shape == picture.shape
    np.testing.assert_array_equal(found[place], picture[place])


@given(height=st.integers(STRIPS, 100), data=st.data())
def test_rows_are_replaced_and_nothing_else(height, data):
    picture = np.arange(height * 3).reshape(height, 3)
    first, last = sorted(data.draw(st.tuples(*[st.integers(0, height)] * 2)))
    before = Strips.of(picture)
    wanted = picture.copy()
    wanted[first:last] *= -1
    found = before.with_rows(first, wanted[first:last])
    np.testing.assert_array_equal(found.whole(), wanted)
    np.testing.assert_array_equal(before.whole(), picture)


@pytest.mark.parametrize("index", [0, 7, STRIPS - 1])
def test_a_strip_is_replaced_without_copying_the_others(index):
    before = Strips.of(np.zeros((60, 4), np.float32))
    top, bottom = strip_of(index, 60)
    after = before.with_rows(top, np.ones((bottom - top, 4), np.float32))
    kept = [a is b for a, b in zip(before.parts, after.parts, strict=True)]
    assert kept == [k != index for k in range(STRIPS)]


@pytest.mark.parametrize("channels", [(), (3,)])
def test_pixels_are_replaced_without_copying_strips_that_have_none(channels):
    rng = np.random.default_rng(1)
    picture = rng.random((61, 9, *channels)).astype(np.float32)
    before, where = Strips.of(picture), rng.random((61, 9)) < 0.3
    top, bottom = strip_of(5, 61)
    where[top:bottom] = False
    values = rng.random((int(where.sum()), *channels)).astype(np.float32)
    wanted = picture.copy()
    wanted[where] = values
    after = before.with_pixels(where, values)
    np.testing.assert_array_equal(after.whole(), wanted)
    np.testing.assert_array_equal(before.whole(), picture)
    kept = [a is b for a, b in zip(before.parts, after.parts, strict=True)]
    assert kept == [k == 5 for k in range(STRIPS)]
    wanted[where] = 7.0
    np.testing.assert_array_equal(before.with_pixels(where, np.float32(7.0)).whole(), wanted)
