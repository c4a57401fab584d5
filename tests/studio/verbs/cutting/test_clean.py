"""`nexus cut --clean`: marks of the command line, by view."""

import pytest

from scenes.prepare.cutout.marks.drawn import Drawn, Stroke
from studio.verbs.cutting.clean import drawn_of


def test_marks_of_a_view_are_put_together():
    found = drawn_of(
        [["a", "1", "2", "3", "4"]],
        [["b", "0", "0", "9", "0", "9", "9"], ["a", "0", "0", "5", "0", "5", "5"]],
        [["b", "2.5", "1", "1", "4", "4"]],
    )
    assert found == {
        "a": Drawn((1.0, 2.0, 3.0, 4.0), (((0.0, 0.0), (5.0, 0.0), (5.0, 5.0)),)),
        "b": Drawn(
            None,
            (((0.0, 0.0), (9.0, 0.0), (9.0, 9.0)),),
            (Stroke(2.5, ((1.0, 1.0), (4.0, 4.0))),),
        ),
    }


@pytest.mark.parametrize(
    ("marks", "message"),
    [
        (([], [], []), "nothing is marked; give --box, --lasso or --brush"),
        (([], [["a", "1", "2", "3"]], []), "--lasso: 3 numbers, wanted X Y"),
        (([], [], [["a", "wide", "2", "3"]]), "'wide 2 3' are not pixels"),
        (([], [], [["a"]]), "are not pixels"),
        (([], [], [["a", "-3", "2", "3"]]), "radius -3.0 px"),
    ],
)
def test_what_is_no_mark_is_refused(marks, message):
    with pytest.raises(ValueError, match=message):
        drawn_of(*marks)
