"""When other yaws are compared, and how often."""

from types import SimpleNamespace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackState
from tracking.follow import yaw_review
from tracking.follow.posterior import LOST_CONFIDENCE
from tracking.follow.track import Audit, Track
from tracking.follow.yaw_review import (
    PERIOD_NS,
    REFINED_NS,
    audited,
    is_under_review,
    told_confidence,
    was_audited,
)
from tracking.hypotheses.hypothesis import Guess

SHARP = Pose.from_yaw(0.0)
FLIPPED = Pose.from_yaw(3.1)
RIG = Pose.identity()
LONG_NS = 10 * REFINED_NS


def a_fit(pose, support, *, visible=0.95):
    return SimpleNamespace(
        world_from_object=pose,
        support=support,
        quality=support,
        visible_fraction=visible,
        covered_fraction=0.0,
        textured=False,
        likeness=0.5,
        sketch=SimpleNamespace(contour=range(240), portrait=None),
    )


def a_track(audit, state=TrackState.TRACKED, looked_ns=0):
    fields = {name: None for name in Track.__dataclass_fields__}
    return Track(**{**fields, "audit": audit, "state": state, "looked_ns": looked_ns})


@pytest.fixture
def task(monkeypatch):
    """A task whose object stands turned by half from what it is taken for."""

    def refined(_scene, _model, start, _evidence, *, quickly=False):
        assert not quickly
        return Guess(a_fit(start, 0.95 if abs(start.yaw()) > 3.0 else 0.6), None)

    monkeypatch.setattr(yaw_review, "turned", lambda *_: [SHARP, FLIPPED])
    monkeypatch.setattr(yaw_review, "refined", refined)
    templates = SimpleNamespace(are_alike=lambda turns: np.zeros(len(turns), bool))
    model = SimpleNamespace(symmetry=1, radius_m=0.5, templates=templates)

    def make(audit, *, now_ns=0, since_ns=LONG_NS, state=TrackState.TRACKED, rig=RIG):
        frame = SimpleNamespace(t_ns=now_ns)
        scene = SimpleNamespace(frame=frame, holds=lambda _pose: True, world_from_rig=rig)
        track = a_track(audit, state, looked_ns=now_ns - since_ns)
        return yaw_review.Task(scene, model, track, (), (0.0,), False, False, True, True)

    return make


def test_a_doubtful_yaw_is_given_up_for_a_clearly_better_one(task):
    after, fit = audited(task(None), None, a_fit(SHARP, 0.65))
    assert fit.world_from_object is FLIPPED
    assert after.track.audit == Audit(0, 0, True)
    assert was_audited(after.track, 0)


def test_an_audit_is_spread_over_frames_and_its_object_moves_on_meanwhile(task):
    first = task(None, since_ns=REFINED_NS)
    begun, fit = audited(first, "then", a_fit(SHARP, 0.65))
    assert is_under_review(begun.track)
    assert was_audited(begun.track, 0)
    assert fit.world_from_object is SHARP
    second = task(begun.track.audit, now_ns=REFINED_NS, since_ns=2 * REFINED_NS)
    moved = Pose.from_yaw(0.1, [0.2, 0.0, 0.0])
    done, fit = audited(second, "now", a_fit(moved, 0.65))
    assert not is_under_review(done.track)
    np.testing.assert_allclose(fit.world_from_object.matrix(), (moved @ FLIPPED).matrix())


def test_a_yaw_that_was_right_is_kept_though_it_moved_meanwhile(task):
    begun, _ = audited(task(None, since_ns=REFINED_NS), "then", a_fit(SHARP, 0.99, visible=0.5))
    fit = a_fit(Pose.from_yaw(0.1), 0.65)
    second = task(begun.track.audit, now_ns=REFINED_NS, since_ns=2 * REFINED_NS)
    done, after = audited(second, "now", fit)
    assert after is fit
    assert done.track.audit.in_vain == 1


def test_an_audit_begins_anew_when_the_camera_was_moved(task):
    begun, _ = audited(task(None, since_ns=REFINED_NS), "then", a_fit(SHARP, 0.65))
    moved = task(begun.track.audit, now_ns=PERIOD_NS, since_ns=REFINED_NS, rig=Pose.identity())
    again, fit = audited(moved, "now", a_fit(SHARP, 0.65))
    assert again.track.audit.review.evidence == "now"
    assert fit.world_from_object is SHARP


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


def test_a_clearly_better_place_at_the_same_yaw_is_taken(task, monkeypatch):
    better = a_fit(Pose.from_yaw(0.05), 0.9)
    doubtful = task(None)
    monkeypatch.setattr(yaw_review, "turned", lambda *_: [SHARP])
    monkeypatch.setattr(yaw_review, "refined", lambda *_, **_quickly: Guess(better, None))
    after, fit = audited(doubtful, None, a_fit(SHARP, 0.5))
    assert fit is better
    assert after.track.audit.is_clear


def test_what_looks_like_its_portrait_of_a_known_yaw_is_left_alone(task):
    seen = a_fit(SHARP, 0.5)
    seen.textured = True
    seen.sketch = SimpleNamespace(
        contour=range(240),
        camera_from_object=None,
        portrait=SimpleNamespace(worth=lambda _: 1.0),
    )
    assert audited(task(None), None, seen)[1] is seen
    doubted = task(Audit(0, 0, False), now_ns=10 * PERIOD_NS)
    assert audited(doubted, None, seen)[1] is not seen
