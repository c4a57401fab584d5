"""When other yaws are compared, and how often."""

from types import SimpleNamespace

import numpy as np
import pytest

import tracking.audit
from scenes.pose import Pose
from scenes.state import TrackState
from tracking.audit import PERIOD_NS, audited, told_confidence, was_audited
from tracking.beliefs import LOST_CONFIDENCE
from tracking.recover import Guess
from tracking.track import Audit, Track

SHARP = Pose.from_yaw(0.0)
FLIPPED = Pose.from_yaw(3.1)


def a_fit(pose, support, *, visible=0.95):
    return SimpleNamespace(
        world_from_object=pose,
        support=support,
        quality=support,
        visible_fraction=visible,
        covered_fraction=0.0,
        textured=False,
        likeness=0.5,
        sketch=SimpleNamespace(contour=range(240)),
    )


def a_track(audit, state=TrackState.TRACKED):
    fields = {name: None for name in Track.__dataclass_fields__}
    return Track(**{**fields, "audit": audit, "state": state})


@pytest.fixture
def task(monkeypatch):
    """A task whose object stands turned by half from what it is taken for."""

    def found(*_):
        return [Guess(a_fit(FLIPPED, 0.95), None), Guess(a_fit(SHARP, 0.6), None)]

    monkeypatch.setattr(tracking.audit, "turned", found)
    templates = SimpleNamespace(are_alike=lambda turns: np.zeros(len(turns), bool))
    model = SimpleNamespace(symmetry=1, radius_m=0.5, templates=templates)

    def make(audit, *, now_ns=0, state=TrackState.TRACKED):
        scene = SimpleNamespace(frame=SimpleNamespace(t_ns=now_ns))
        return tracking.audit.Task(
            scene, model, a_track(audit, state), (), (0.0,), False, False, True, True
        )

    return make


def test_a_doubtful_yaw_is_given_up_for_a_clearly_better_one(task):
    after, fit = audited(task(None), None, a_fit(SHARP, 0.65))
    assert fit.world_from_object is FLIPPED
    assert after.track.audit == Audit(0, 0, True)
    assert was_audited(after.track, 0)


def test_a_good_fit_and_what_never_moved_are_left_alone(task):
    good = a_fit(SHARP, 0.9)
    assert audited(task(None), None, good)[1] is good
    doubtful = a_fit(SHARP, 0.65)
    assert audited(task(None, state=TrackState.STATIC), None, doubtful)[1] is doubtful


def test_after_an_audit_in_vain_the_next_waits_twice_as_long(task):
    doubtful, before = a_fit(SHARP, 0.65), Audit(0, 2, False)
    early = task(before, now_ns=4 * PERIOD_NS - 1)
    assert audited(early, None, doubtful)[0].track.audit is before
    assert audited(task(before, now_ns=4 * PERIOD_NS), None, doubtful)[1] is not doubtful


def test_a_yaw_that_is_one_of_several_is_told_as_a_guess():
    doubtful = a_fit(SHARP, 0.75)
    assert told_confidence(a_track(Audit(0, 1, False)), doubtful) <= LOST_CONFIDENCE
    assert told_confidence(a_track(Audit(0, 1, True)), doubtful) > LOST_CONFIDENCE
