import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.wire.film.film import Film, FilmFormat

FORM = FilmFormat(320, 160, 25, "side_by_side")


def film(count=6, *, step_ns=40, **changes):
    values = {
        "data": bytes(range(count)),
        "offsets": np.arange(count + 1),
        "t_ns": np.arange(count) * step_ns,
        "duration_ns": count * step_ns,
        "keyframes": np.array([k in (0, 3) for k in range(count)]),
        "shows": np.arange(count),
    }
    return Film("numbers", FORM, **{**values, **changes})


@given(st.integers(0, 10_000))
def test_played_over_and_over_its_times_go_on(number):
    made = film()
    unit = made.unit(number)
    assert unit.t_ns == made.time_ns(number) == 40 * number
    assert unit.data == bytes([number % 6])
    assert made.number_at(unit.t_ns) == made.number_at(unit.t_ns + 39) == number
    assert number - 3 < made.keyframe_before(number) <= number
    assert made.unit(made.keyframe_before(number)).keyframe


def test_a_film_without_truth_knows_nothing():
    assert film().truth_of(3) is None


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"keyframes": np.zeros(6, bool)}, "keyframe first"),
        ({"offsets": np.arange(6)}, "as many"),
        ({"offsets": np.array([0, 1, 2, 2, 3, 4, 5])}, "lead beyond"),
        ({"offsets": np.arange(1, 8)}, "lead beyond"),
        ({"t_ns": np.zeros(6, np.int64)}, "grow"),
        ({"duration_ns": 200}, "grow"),
    ],
)
def test_what_does_not_belong_together_is_refused(changes, why):
    with pytest.raises(ValueError, match=why):
        film(**changes)


def test_there_is_no_unit_before_the_first():
    with pytest.raises(ValueError, match="-1"):
        film().unit(-1)
