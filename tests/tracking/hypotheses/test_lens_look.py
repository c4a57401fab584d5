"""A whole lens is compared with the room in several steps, which give what one gives."""

import numpy as np
import pytest

from tracking.hypotheses.budget import BudgetExhausted, FrameBudget
from tracking.hypotheses.lens_look import LEVELS, SEARCH_SIZE_PX, look_through


def test_what_is_looked_for_differs_from_the_room_where_it_is(table, mug_elsewhere):
    scene, now = mug_elsewhere
    model = table.models["mug-1"]
    look = look_through(scene, 0, model, table.neighbours("mug-1"))
    assert len(look.levels) == LEVELS
    assert abs(look.camera.width_px - SEARCH_SIZE_PX) < 0.5 * SEARCH_SIZE_PX
    centre = look.world_from_lens.inverse() @ model.centre_at(now)
    (x, y), _ = (found[0] for found in look.camera.project(centre))
    changed = look.picture[..., 4]
    there = changed[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2]
    assert there.mean() > 0.5 > 5 * changed.mean()


def test_a_look_goes_on_in_the_next_frame_where_the_budget_ended(table, mug_elsewhere):
    scene, _ = mug_elsewhere
    asked = scene, 0, table.models["mug-1"], table.neighbours("mug-1")
    at_once = look_through(*asked)
    done, frames = (), 0
    while True:
        budget = FrameBudget(0.1, done)
        try:
            look = look_through(*asked, budget=budget)
            break
        except BudgetExhausted:
            done, frames = budget.done(), frames + 1
    assert frames == 3
    np.testing.assert_array_equal(look.picture, at_once.picture)
    with pytest.raises(BudgetExhausted):
        look_through(*asked, budget=FrameBudget(0.1))
