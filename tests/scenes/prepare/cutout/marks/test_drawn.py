"""Marks of a hand as masks: what lies in any of them is meant."""

import numpy as np
import pytest

from scenes.prepare.cutout.marks.drawn import Drawn, Stroke

TRIANGLE = ((10.0, 10.0), (40.0, 10.0), (10.0, 40.0))


def test_a_box_and_an_outline_hold_what_is_inside():
    box = Drawn(box=(5.0, 6.0, 15.0, 26.0)).mask(60, 50)
    assert box.shape == (50, 60)
    assert 10 * 20 <= box.sum() <= 11 * 21, "edges belong to it"
    assert box[7:25, 6:14].all()
    lasso = Drawn(outlines=(TRIANGLE,)).mask(60, 50)
    assert lasso.sum() == pytest.approx(480, rel=0.05)
    assert lasso[15, 15]
    assert not lasso[35, 35]


def test_a_stroke_is_as_wide_as_its_brush_and_round_at_its_ends():
    mask = Drawn(strokes=(Stroke(4.0, ((20.0, 20.0), (40.0, 20.0))),)).mask(60, 50)
    assert mask[17:24, 20:41].all()
    assert mask[20, 17]
    assert not mask[28, 30]
    assert Drawn(strokes=(Stroke(3.0, ((9.0, 9.0),)),)).mask(20, 20).sum() > 20


def test_all_that_was_drawn_is_meant():
    both = Drawn((0.0, 0.0, 5.0, 5.0), (TRIANGLE,)).mask(60, 50)
    assert both[2, 2]
    assert both[15, 15]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Drawn(outlines=(((1.0, 1.0), (2.0, 2.0)),)).mask(9, 9), "2 corners, wanted three"),
        (lambda: Drawn((70.0, 70.0, 80.0, 80.0)).mask(60, 50), "outside the 60×50 px picture"),
        (lambda: Drawn().mask(60, 50), "outside the 60×50 px picture"),
        (lambda: Stroke(0.0, ((1.0, 1.0),)), "radius 0.0 px, limits 0 to 500"),
        (lambda: Stroke(2.0, ()), "without points"),
        (lambda: Stroke(2.0, ((np.nan, 1.0),)), "wanted finite"),
    ],
)
def test_what_is_no_mark_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
