"""What a film may be, and which instants are in it."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.app.film.plan import MAX_S, FilmPlan

FILM = Path("film.mp4")


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"width_px": 641}, "width = 641"),
        ({"height_px": 16}, "height = 16"),
        ({"width_px": 4000}, "width = 4000"),
        ({"fps": 0.5}, "fps = 0.5"),
        ({"path": Path("film.avi")}, "film.avi"),
    ],
)
def test_figures_out_of_bounds_are_named(wrong, says):
    with pytest.raises(ValueError, match=says):
        FilmPlan(**{"path": FILM, **wrong})


@given(
    st.integers(0, 10**10),
    st.integers(0, 60 * 10**9),
    st.sampled_from([1.0, 7.0, 10.0, 29.97, 60.0]),
)
def test_pictures_are_evenly_apart_from_the_first_instant_on(start_ns, length_ns, fps):
    times = FilmPlan(FILM, fps=fps).times_ns(start_ns, start_ns + length_ns)
    assert times[0] == start_ns
    assert start_ns + length_ns - times[-1] < 1e9 / fps + 1
    assert len(times) == pytest.approx(length_ns / 1e9 * fps, abs=1.01)


def test_a_part_of_a_recording():
    plan = FilmPlan(FILM, fps=10.0, from_s=2.0, to_s=3.0)
    assert [t / 1e9 for t in plan.times_ns(0, 10 * 10**9)][:2] == [2.0, 2.1]
    assert len(plan.times_ns(0, 10 * 10**9)) == 11
    with pytest.raises(ValueError, match="wanted a part of 5 to 10 s"):
        plan.times_ns(5 * 10**9, 10 * 10**9)
    with pytest.raises(ValueError, match="limit 14400 s"):
        FilmPlan(FILM).times_ns(0, round(1e9 * (MAX_S + 1)))
