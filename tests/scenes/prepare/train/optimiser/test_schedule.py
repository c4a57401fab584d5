"""What changes on the way."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.prepare.train.optimiser import schedule
from scenes.prepare.train.optimiser.rows import LOGIT, MEAN, SH


@given(start=st.integers(1, 10**6), budget=st.integers(1, 10**6))
def test_the_number_of_splats_grows_to_the_budget_and_stays(start, budget):
    wanted = [schedule.splats_wanted(done, start, budget) for done in np.linspace(0, 1, 21)]
    assert wanted == sorted(wanted)
    assert wanted[0] == min(start, budget)
    assert wanted[-1] == wanted[10] == budget


def test_rates_fall_each_in_its_own_way():
    early, late, end = (schedule.rates(done, 2.0, 23) for done in (0.0, 0.6, 1.0))
    assert early[MEAN][0] == np.float32(2 * schedule.MEAN_RATE)
    assert np.isclose(end[MEAN][0] / early[MEAN][0], schedule.MEAN_DECAY)
    assert early[LOGIT] == late[LOGIT]
    assert np.isclose(end[LOGIT] / early[LOGIT], schedule.OTHER_DECAY)
    assert (early[SH.start : SH.start + 3] > early[SH.start + 3]).all()


def test_photos_grow_from_a_quarter_to_full_size():
    sizes = [schedule.shrink(done) for done in np.linspace(0, 1, 101)]
    assert sizes == sorted(sizes, reverse=True)
    assert sorted(set(sizes)) == [1, 2, 4]


def test_long_trainings_densify_every_hundred_steps_and_short_ones_more_often():
    assert schedule.densify_after(0.1, 1000) == 100
    assert schedule.densify_after(0.5, 1000) == 50
    assert schedule.densify_after(0.5, 100) == 20
    assert schedule.densify_after(0.0, 1) == 100


def test_the_price_of_depth_falls_late():
    assert schedule.depth_price(0.0) == schedule.depth_price(0.5)
    late = [schedule.depth_price(done) for done in (0.5, 0.75, 1.0)]
    assert late[0] > late[1] > late[2] > 0


def test_splats_are_put_back_every_few_densifications():
    since = 50
    rounds = [schedule.puts_back(k * since, since) for k in range(1, 41)]
    assert sum(rounds) == 40 // schedule.PUT_BACK_EVERY
