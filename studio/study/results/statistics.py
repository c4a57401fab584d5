"""Tests for few participants who have met every condition: exact where it can be, with effects.

All are of ranks: answers are ordinal, times are skewed, and with ten people nobody can tell whether
differences are normal. How far from normal they look is said beside.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CONFIDENCE = 0.95
"""Of every interval."""

RESAMPLES = 4000
"""Resamples of an interval by bootstrap: its ends are then repeatable to a twentieth of its
width."""

MAX_EXACT = 40
"""Differences up to which the distribution of the signed ranks is counted out."""

MIN_RESAMPLED = 5
"""Participants from which an interval by bootstrap says something: of fewer there are only some
hundred different resamples."""

MIN_NORMALITY = 3
"""Values from which Shapiro and Wilk's test is defined."""


@dataclass(frozen=True, slots=True)
class Described:
    """Values of one condition.

    Attributes:
        n: how many.
        mean: of them.
        sd: standard deviation of the sample; NaN of one value.
        median: of them.
        low: lower end of the mean's confidence interval; NaN where there are too few.
        high: upper end.
    """

    n: int
    mean: float
    sd: float
    median: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Compared:
    """A measure under two conditions, or under all of more than two.

    Attributes:
        name: of the measure, or more that tells it from others.
        conditions: that are compared.
        n: participants who have a value under each of them.
        test: its name.
        p: two-sided; NaN where nothing can be tested.
        p_holm: the same after Holm's correction within its family.
        effect_name: of the effect.
        effect: rank-biserial correlation of two conditions, Kendall's W of more.
        effect_low: lower end of its confidence interval; NaN where there are too few.
        effect_high: upper end.
        difference: Hodges and Lehmann's median of second less first; NaN of more than two.
        low: lower end of its confidence interval.
        high: upper end.
        level: confidence that this interval has.
        normal_p: of Shapiro and Wilk's test of the differences; NaN where there are too few.
    """

    name: str
    conditions: tuple[str, ...]
    n: int
    test: str
    p: float
    p_holm: float
    effect_name: str
    effect: float
    effect_low: float
    effect_high: float
    difference: float = math.nan
    low: float = math.nan
    high: float = math.nan
    level: float = math.nan
    normal_p: float = math.nan


def described(values: Sequence[float], *, seed: int = 0) -> Described:
    """Return mean, spread and confidence interval of values.

    Raises:
        ValueError: there is none.
    """
    if not values:
        raise ValueError("described: no values")
    array = np.asarray(values, dtype=np.float64)
    sd = float(array.std(ddof=1)) if len(array) > 1 else math.nan
    low, high = _resampled(array[:, None], lambda rows: float(rows.mean()), seed=seed)
    return Described(len(array), float(array.mean()), sd, float(np.median(array)), low, high)


def compared(
    name: str, values: Mapping[str, Mapping[str, float]], *, seed: int = 0
) -> tuple[Compared, ...]:
    """Return the test of all conditions, and of every pair where there are more than two.

    Only participants who have a value under every condition count. Pairs of more than two
    conditions are corrected among themselves by Holm's method.

    Args:
        name: of the measure.
        values: by condition, by participant.
        seed: of the resampling.
    """
    conditions = tuple(values)
    if len(conditions) < 2:
        return ()
    people = sorted(set.intersection(*(set(each) for each in values.values())))
    table = np.array([[values[c][p] for c in conditions] for p in people], dtype=np.float64)
    table = table.reshape(len(people), len(conditions))
    if len(conditions) == 2:
        return (_two(name, table, conditions=conditions, seed=seed),)
    pairs = [
        _two(name, table[:, [a, b]], conditions=(conditions[a], conditions[b]), seed=seed)
        for a, b in combinations(range(len(conditions)), 2)
    ]
    return (_many(name, table, conditions=conditions, seed=seed), *with_holm(pairs))


def with_holm(family: Sequence[Compared]) -> list[Compared]:
    """Return tests of one family with p corrected for their number by Holm's method."""
    corrected = holm([each.p for each in family])
    return [replace(each, p_holm=p) for each, p in zip(family, corrected, strict=True)]


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p corrected by Holm's method; those that are NaN are no tests and stay so."""
    order = sorted((p, k) for k, p in enumerate(p_values) if not math.isnan(p))
    found, highest = [math.nan] * len(p_values), 0.0
    for rank, (p, k) in enumerate(order):
        highest = max(highest, min(1.0, (len(order) - rank) * p))
        found[k] = highest
    return found


def signed_ranks(differences: Array) -> tuple[float, float]:
    """Return rank-biserial correlation and p, two-sided, of Wilcoxon's signed ranks.

    Zeros are left out and ties share their rank; p is counted out over all signs, so it is exact
    with ties, too. Of more than `MAX_EXACT` differences it is that of the normal approximation.
    """
    from scipy.stats import norm, rankdata

    left = differences[differences != 0.0]
    if not len(left):
        return 0.0, math.nan
    ranks = rankdata(np.abs(left))
    plus, total = float(ranks[left > 0].sum()), float(ranks.sum())
    effect = (2.0 * plus - total) / total
    if len(left) > MAX_EXACT:
        spread = math.sqrt(float((ranks**2).sum()) / 4.0)
        return effect, float(2.0 * norm.sf(abs(plus - total / 2.0) / spread))
    # Ranks of ties are halves: twice each is whole.
    counts = _sums(np.rint(2.0 * ranks).astype(int).tolist())
    far = abs(2.0 * plus - total)
    away = np.abs(np.arange(len(counts)) - total)
    return effect, float(min(1.0, counts[away >= far - 1e-9].sum() / counts.sum()))


def hodges_lehmann(differences: Array) -> tuple[float, float, float, float]:
    """Return Hodges and Lehmann's median difference, its interval, and that one's confidence.

    The interval is exact: it holds the differences that the signed ranks do not reject. Of five
    participants or fewer even the widest one has less than the confidence that is wanted.
    """
    n = len(differences)
    if n == 0:
        return math.nan, math.nan, math.nan, math.nan
    first, second = np.triu_indices(n)
    walsh = np.sort(0.5 * (differences[first] + differences[second]))
    counts = _sums(list(range(1, n + 1)))
    below = np.cumsum(counts) / counts.sum()
    out = max(int(np.searchsorted(below, 0.5 * (1.0 - CONFIDENCE), side="right")), 1)
    level = 1.0 - 2.0 * float(below[out - 1])
    middle = float(np.median(walsh))
    if n == 1:
        return middle, math.nan, math.nan, math.nan
    return middle, float(walsh[out - 1]), float(walsh[-out]), level


def normality(values: Array) -> float:
    """Return p of Shapiro and Wilk's test; NaN where there are too few, or all are the same."""
    from scipy.stats import shapiro

    if len(values) < MIN_NORMALITY or np.ptp(values) < 1e-12:
        return math.nan
    return float(shapiro(values).pvalue)


def _two(name: str, table: Array, *, conditions: tuple[str, ...], seed: int) -> Compared:
    differences = table[:, 1] - table[:, 0]
    effect, p = signed_ranks(differences)
    effect_low, effect_high = _resampled(
        differences[:, None], lambda rows: signed_effect(rows[:, 0]), seed=seed
    )
    middle, low, high, level = hodges_lehmann(differences)
    return Compared(
        name,
        conditions,
        len(table),
        "Wilcoxon signed ranks",
        p,
        p,
        "r",
        effect,
        effect_low,
        effect_high,
        middle,
        low,
        high,
        level,
        normality(differences),
    )


def _many(name: str, table: Array, *, conditions: tuple[str, ...], seed: int) -> Compared:
    from scipy.stats import friedmanchisquare

    p = effect = math.nan
    if len(table) >= 2:
        p = float(friedmanchisquare(*table.T).pvalue)
        effect = concordance(table)
    low, high = _resampled(table, concordance, seed=seed)
    return Compared(name, conditions, len(table), "Friedman", p, p, "W", effect, low, high)


def signed_effect(differences: Array) -> float:
    """Return the rank-biserial correlation of differences."""
    from scipy.stats import rankdata

    left = differences[differences != 0.0]
    if not len(left):
        return 0.0
    ranks = rankdata(np.abs(left))
    return float((ranks * np.sign(left)).sum() / ranks.sum())


def concordance(table: Array) -> float:
    """Return Kendall's W of (participants, conditions) values, corrected for ties."""
    from scipy.stats import rankdata

    n, k = table.shape
    ranks = rankdata(table, axis=1)
    sums = ranks.sum(axis=0)
    ties = sum(
        float((c**3 - c).sum()) for row in ranks for c in [np.unique(row, return_counts=True)[1]]
    )
    whole = n * n * (k**3 - k) - n * ties
    apart = float(((sums - sums.mean()) ** 2).sum())
    return 12.0 * apart / whole if whole > 0 else 0.0


def _sums(ranks: Sequence[int]) -> Array:
    """Return in how many ways of choosing some of the ranks they sum to 0, to 1 and so on."""
    counts = np.zeros(sum(ranks) + 1)
    counts[0] = 1.0
    for rank in ranks:
        counts[rank:] = counts[rank:] + counts[: len(counts) - rank].copy()
    return counts


def _resampled(rows: Array, figure: Callable[[Array], float], *, seed: int) -> tuple[float, float]:
    """Return a confidence interval by bootstrap over participants; NaN of too few."""
    if len(rows) < MIN_RESAMPLED:
        return math.nan, math.nan
    rng = np.random.default_rng([seed, 3])
    picked = rng.integers(0, len(rows), (RESAMPLES, len(rows)))
    values = [figure(rows[pick]) for pick in picked]
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(values, [tail, 100.0 - tail])
    return float(low), float(high)
