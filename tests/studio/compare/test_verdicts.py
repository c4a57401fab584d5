"""Which differences count as worse."""

import pytest

from studio.compare.verdicts import as_values, compare_rows, lower_is_better
from studio.console.rows import Row, at_least, at_most


def verdict(a, b, tolerance=0.1):
    (row,) = compare_rows([a], [b], tolerance=tolerance)
    return row.verdict, row.worse


@pytest.mark.parametrize(
    ("was", "now", "wanted"),
    [
        (5.0, 5.0, ("same", False)),
        (5.0, 4.0, ("better", False)),
        (5.0, 5.49, ("worse, within the tolerance", False)),
        (5.0, 5.51, ("worse", True)),
        (0.2, 0.29, ("worse, too little to count", False)),
        (0.2, 0.31, ("worse", True)),
        (0.0, 0.11, ("worse", True)),
    ],
)
def test_errors_may_be_worse_by_the_tolerance_or_a_millimetre(was, now, wanted):
    assert verdict(Row("e", was, "cm"), Row("e", now, "cm")) == wanted


def test_a_bar_says_which_way_is_better():
    def speed(fps):
        return at_least("fps", fps, "fps", bar=10.0)

    assert verdict(speed(20.0), speed(15.0)) == ("worse", True)
    assert verdict(speed(5.0), speed(8.0)) == ("better", False)
    assert lower_is_better(speed(20.0)) is False
    assert lower_is_better(at_most("n", 3, "", bar=0)) is True
    assert lower_is_better(Row("n", 3.0, "")) is None


def test_one_dropped_frame_is_worse_than_none():
    none, one = (at_most("dropped", n, "", bar=0) for n in (0, 1))
    assert verdict(none, one) == ("worse", True)
    assert verdict(one, none) == ("better", False)


def test_durations_and_counts_are_not_judged():
    assert verdict(Row("t", 1.0, "ms"), Row("t", 9.0, "ms")) == (
        "not judged: depends on the machine",
        False,
    )
    assert verdict(Row("frames", 30.0, ""), Row("frames", 10.0, "")) == ("differs", False)


def test_figures_of_one_run_only_are_shown_in_order():
    a = [Row("x", 1.0, "cm"), Row("gone", 2.0, "cm"), Row("none", None, "cm")]
    b = [Row("new", 3.0, "cm"), Row("x", 1.0, "cm"), Row("none", None, "cm")]
    rows = compare_rows(a, b, tolerance=0.1)
    assert [(row.name, row.verdict) for row in rows] == [
        ("x", "same"),
        ("gone", "only in A"),
        ("none", "not measured"),
        ("new", "only in B"),
    ]
    assert not any(row.worse for row in rows)
    assert as_values(rows)[0] == {
        "name": "x",
        "unit": "cm",
        "a": 1.0,
        "b": 1.0,
        "difference": 0.0,
        "verdict": "same",
        "worse": False,
    }
