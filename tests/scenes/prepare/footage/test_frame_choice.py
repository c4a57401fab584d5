from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenes.prepare.footage.frame_choice import StepLimits, choose_frames

STEPS = StepLimits(smallest=0.02, largest=0.15)


def choose(motion, blur=None, usable=None, wanted=20):
    motion = np.asarray(motion, dtype=np.float64)
    blur = np.full(len(motion), 0.3) if blur is None else np.asarray(blur)
    usable = np.ones(len(motion), dtype=np.bool_) if usable is None else np.asarray(usable)
    return choose_frames(motion, blur, usable, wanted=wanted, steps=STEPS)


@given(
    st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1), st.booleans()), min_size=1, max_size=200),
    st.integers(3, 60),
)
def test_only_usable_frames_in_order_and_never_too_many(looks, wanted):
    motion, blur, usable = (np.array(column) for column in zip(*looks, strict=True))
    chosen = choose(motion, blur, usable, wanted)
    assert np.all(np.diff(chosen) > 0)
    assert usable[chosen].all()
    assert len(chosen) <= 2 * wanted


def test_frames_follow_the_motion_not_the_time():
    slow, fast = np.full(300, 0.002), np.full(100, 0.03)
    chosen = choose(np.concatenate([slow, fast]), wanted=36)
    assert 4 <= (chosen < 300).sum() <= 8
    assert 28 <= (chosen >= 300).sum() <= 32


def test_a_camera_that_stands_still_gives_a_single_frame():
    assert len(choose(np.zeros(100))) == 1


def test_a_long_sweep_gives_more_than_wanted_so_that_neighbours_overlap():
    motion = np.full(200, 0.05)
    chosen = choose(motion, wanted=40)
    assert len(chosen) > 60
    assert np.diff(np.cumsum(motion)[chosen]).max() < 2 * STEPS.largest


def test_the_sharpest_of_each_step_is_taken():
    rng = np.random.default_rng(2)
    blur = rng.uniform(0.3, 0.6, 400)
    chosen = choose(np.full(400, 0.01), blur, wanted=40)
    assert len(chosen) == 40
    assert blur[chosen].mean() < 0.36
