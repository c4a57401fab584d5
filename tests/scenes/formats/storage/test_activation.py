import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.formats.storage.activation import exponential, logarithm, logit, sigmoid


@given(st.lists(st.floats(0.0, 1.0, width=32), min_size=1, max_size=50))
def test_opacity_survives_the_logit_and_is_stable_after_it(values):
    opacities = np.array(values, dtype=np.float32)
    raw = logit(opacities)
    once = sigmoid(raw)
    assert np.isfinite(raw).all()
    np.testing.assert_allclose(once, opacities, rtol=7e-6, atol=1e-38)
    ordinary = opacities > 1e-6
    np.testing.assert_allclose(once[ordinary], opacities[ordinary], rtol=1e-6)
    np.testing.assert_array_equal(sigmoid(logit(once)), once)


def test_opacity_ends_are_exact_and_infinite_logits_are_opacities():
    ends = np.array([0.0, 1.0], dtype=np.float32)
    np.testing.assert_array_equal(sigmoid(logit(ends)), ends)
    infinite = np.array([-np.inf, np.inf], dtype=np.float32)
    np.testing.assert_array_equal(sigmoid(infinite), ends)
    assert np.isnan(sigmoid(np.array([np.nan], dtype=np.float32)))[0]


def test_sigmoid_equals_the_definition():
    raw = np.linspace(-20, 20, 401, dtype=np.float32)
    expected = 1.0 / (1.0 + np.exp(-raw.astype(np.float64)))
    np.testing.assert_allclose(sigmoid(raw), expected, rtol=1e-7)


@given(st.lists(st.floats(2.0**-20, 2.0**10, width=32), min_size=1, max_size=50))
def test_scale_survives_the_logarithm_and_is_stable_after_it(values):
    scales = np.array(values, dtype=np.float32)
    once = exponential(logarithm(scales))
    np.testing.assert_allclose(once, scales, rtol=1e-6)
    np.testing.assert_array_equal(exponential(logarithm(once)), once)


@pytest.mark.parametrize(("raw", "expected"), [(200.0, np.inf), (-200.0, 0.0)])
def test_scales_beyond_float32_become_values_that_readers_refuse(raw, expected):
    assert exponential(np.array([raw], dtype=np.float32))[0] == expected
