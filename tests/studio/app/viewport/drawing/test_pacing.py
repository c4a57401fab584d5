from hypothesis import given
from hypothesis import strategies as st

from studio.app.viewport.drawing.pacing import FRAME_NS, FULL, GRADES, REST_NS, Pacing

SLOW, QUICK = 3 * FRAME_NS, FRAME_NS // 2


def after_moving(*times_ns):
    """A pacing that has drawn pictures of a moving view, one per time."""
    pacing = Pacing()
    for took_ns in times_ns:
        pacing.moved(0)
        pacing.drew(pacing.choose(0), took_ns)
    return pacing


def test_the_first_picture_is_drawn_in_full_and_nothing_follows():
    pacing = Pacing()
    assert pacing.choose(0) == FULL
    pacing.drew(FULL, SLOW)
    assert pacing.refine_after_s(10**12) is None


def test_a_quick_scene_stays_full_while_moving():
    pacing = after_moving(QUICK, QUICK)
    assert pacing.choose(1) == FULL
    assert pacing.refine_after_s(1) is None


def test_a_slow_scene_gets_coarser_picture_by_picture():
    assert after_moving(SLOW).choose(1) == GRADES[1]
    assert after_moving(SLOW, QUICK).choose(1) == GRADES[1]
    assert after_moving(SLOW, SLOW).choose(1) == GRADES[2]
    assert after_moving(SLOW, SLOW, SLOW).choose(1) == GRADES[2]


def test_a_resting_view_is_refined_once():
    pacing = after_moving(SLOW, QUICK)
    assert pacing.refine_after_s(0) == REST_NS / 1e9
    assert pacing.refine_after_s(REST_NS + 5) == 0
    assert pacing.choose(REST_NS - 1) != FULL
    assert pacing.choose(REST_NS) == FULL
    pacing.drew(FULL, SLOW)
    assert pacing.refine_after_s(REST_NS) is None


def test_moving_on_puts_the_refinement_off():
    pacing = after_moving(SLOW, QUICK)
    pacing.moved(REST_NS - 1)
    assert pacing.choose(REST_NS) == GRADES[1]
    assert pacing.refine_after_s(REST_NS) == (REST_NS - 1) / 1e9


def test_finer_grades_are_tried_again():
    pacing = after_moving(*[SLOW, *[QUICK] * 200])
    seen = set()
    for _ in range(100):
        pacing.moved(0)
        grade = pacing.choose(0)
        seen.add(grade)
        pacing.drew(grade, QUICK)
    assert FULL in seen


@given(st.lists(st.tuples(st.integers(0, 3 * REST_NS), st.integers(0, 10**9), st.booleans())))
def test_whatever_happens_a_view_at_rest_ends_in_full(steps):
    pacing, now_ns = Pacing(), 0
    for later_ns, took_ns, moves in steps:
        now_ns += later_ns
        if moves:
            pacing.moved(now_ns)
        pacing.drew(pacing.choose(now_ns), took_ns)
        now_ns += took_ns
    wait_s = pacing.refine_after_s(now_ns)
    if wait_s is not None:
        assert pacing.choose(now_ns + round(wait_s * 1e9)) == FULL
