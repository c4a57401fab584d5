"""Tests and intervals, against scipy's, against counting, and by how often they hold."""

import math
from itertools import product

import numpy as np
import pytest
from scipy import stats

from studio.study.results.statistics import (
    compared,
    concordance,
    described,
    hodges_lehmann,
    holm,
    signed_ranks,
)


def test_signed_ranks_are_those_of_scipy_where_that_is_exact():
    rng = np.random.default_rng(0)
    for n in (5, 9, 14):
        differences = rng.normal(0.4, 1.0, n)
        _, p = signed_ranks(differences)
        assert p == pytest.approx(stats.wilcoxon(differences, method="exact").pvalue)


def test_signed_ranks_with_ties_are_counted_out():
    differences = np.array([1.0, 1.0, 2.0, -1.0, 0.0, 3.0, 3.0])
    effect, p = signed_ranks(differences)
    left = differences[differences != 0]
    ranks = stats.rankdata(np.abs(left))
    seen = abs((ranks * np.sign(left)).sum())
    signs = np.array(list(product((-1, 1), repeat=len(left))))
    assert p == pytest.approx(np.mean(np.abs(signs @ ranks) >= seen - 1e-9))
    assert effect == pytest.approx((ranks * np.sign(left)).sum() / ranks.sum())


def test_of_many_the_normal_approximation_is_near():
    differences = np.random.default_rng(1).normal(0.3, 1.0, 60)
    _, p = signed_ranks(differences)
    assert p == pytest.approx(stats.wilcoxon(differences).pvalue, rel=0.1)


def test_no_difference_is_no_test():
    effect, p = signed_ranks(np.zeros(6))
    assert effect == 0.0
    assert math.isnan(p)
    (test,) = compared("x", {"a": {"p": 1.0, "q": 2.0}, "b": {"p": 1.0, "q": 2.0}})
    assert test.n == 2
    assert math.isnan(test.p)


def test_the_interval_of_the_median_difference_holds_as_often_as_it_says():
    rng, held, levels = np.random.default_rng(2), [], []
    for _ in range(400):
        middle, low, high, level = hodges_lehmann(rng.standard_t(3, 10) + 1.0)
        held.append(low <= 1.0 <= high)
        levels.append(level)
        assert low <= middle <= high
    assert len(set(levels)) == 1
    assert 0.95 <= levels[0] < 0.99
    assert np.mean(held) == pytest.approx(levels[0], abs=0.03)
    assert hodges_lehmann(np.arange(5.0))[3] == pytest.approx(1 - 2 / 2**5)  # too few for 95 %


def test_an_interval_rejects_what_the_test_rejects():
    rng = np.random.default_rng(4)
    for _ in range(60):
        differences = rng.normal(0.6, 1.0, 9)
        _, p = signed_ranks(differences)
        _, low, high, level = hodges_lehmann(differences)
        assert (p <= 1 - level + 1e-12) is not (low <= 0 <= high)


def test_holm():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    corrected = holm([math.nan, 0.5, 0.02])
    assert math.isnan(corrected[0])
    assert corrected[1:] == pytest.approx([0.5, 0.04])


def test_three_conditions_are_tested_at_once_and_in_pairs():
    rng = np.random.default_rng(3)
    values = {
        name: {f"P{k}": float(rng.normal(shift, 0.5)) for k in range(10)}
        for name, shift in (("a", 0.0), ("b", 0.2), ("c", 3.0))
    }
    del values["a"]["P9"]  # who misses one counts in none
    whole, *pairs = compared("time", values)
    assert whole.test == "Friedman"
    assert whole.n == 9
    table = np.array([[values[c][f"P{k}"] for c in "abc"] for k in range(9)])
    assert whole.p == pytest.approx(stats.friedmanchisquare(*table.T).pvalue)
    assert whole.effect == pytest.approx(concordance(table))
    assert whole.effect_low <= whole.effect <= whole.effect_high
    assert [pair.conditions for pair in pairs] == [("a", "b"), ("a", "c"), ("b", "c")]
    assert pairs[1].effect == 1.0
    assert pairs[1].p_holm == pytest.approx(3 * pairs[1].p)


def test_values_are_described():
    found = described([1.0, 2.0, 3.0, 4.0, 10.0])
    assert (found.n, found.mean, found.median) == (5, 4.0, 3.0)
    assert found.sd == pytest.approx(np.std([1, 2, 3, 4, 10], ddof=1))
    assert found.low < found.mean < found.high
    assert math.isnan(described([1.0]).low)
