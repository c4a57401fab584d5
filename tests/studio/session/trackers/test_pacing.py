"""What paces searches, and that a recording says enough to repeat it."""

import time
from functools import partial

import numpy as np
import pytest

from devices.messages import Frame
from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from studio.session.trackers.pacing import AsRecorded, InFrames, Live, stamp_of
from tests.tracking.beside.orders import doubled
from tracking.hypotheses.budget import NOMINAL_COSTS, Step
from tracking.hypotheses.search_runner import BEGUN

RIG = Rig((Fisheye.from_fov(8, 3.0),), (Pose.identity(),))
PICTURE = np.zeros((8, 8, 3), np.uint8)
FRAME = Frame("camera-360", 4, 400, 410, (PICTURE,), RIG, Pose.identity())


@pytest.fixture
def live():
    made = Live()
    yield made
    made.close()


def test_in_frames_nothing_has_to_be_recorded():
    pacing = InFrames()
    pacing.begin(None)
    assert pacing.costs is NOMINAL_COSTS
    assert pacing.stamp(FRAME) is None
    pacing.close()


def test_a_live_session_says_its_steps_and_the_frame_in_which_a_search_ended(live):
    live.begin(None)
    live.costs.timed(Step.ALIGN, lambda: time.sleep(0.002))
    stamp = live.stamp(FRAME)
    assert (stamp.seq, stamp.search_ended) == (4, False)
    assert stamp.steps_ms[0] >= 2.0
    progress, result = BEGUN, None
    while result is None:
        live.begin(None)
        work = partial(doubled, np.ones(2))
        progress, result = live.searches.advance(progress, work, budget_ms=1.0)
        assert live.stamp(FRAME).search_ended == (result is not None)
        time.sleep(0.01)


def test_a_live_session_says_the_frame_in_which_a_look_ended(live):
    live.begin(None)
    progress, result = BEGUN, None
    while result is None:
        live.begin(None)
        work = partial(doubled, np.ones(2))
        progress, result = live.looks.advance(progress, work, budget_ms=1.0)
        stamp = live.stamp(FRAME)
        assert (stamp.search_ended, stamp.look_ended) == (False, result is not None)
        time.sleep(0.01)


def test_what_settings_took_that_are_tried_beside_is_not_recorded(live):
    live.costs.timed(Step.ALIGN, lambda: None)
    live.begin(None)
    assert live.stamp(FRAME).steps_ms == ()


def test_a_recording_is_repeated():
    pacing = AsRecorded()
    work = partial(doubled, np.ones(2))
    for ended in (False, True):
        pacing.begin(stamp_of(FRAME, (5.0,), search_ended=ended, look_ended=not ended))
        assert pacing.costs.timed(Step.ALIGN, lambda: None)[1] == 5.0
        _, result = pacing.searches.advance(BEGUN, work, budget_ms=1.0)
        assert (result is not None) == ended
        _, result = pacing.looks.advance(BEGUN, work, budget_ms=1.0)
        assert (result is not None) != ended
    pacing.begin(None)
    assert pacing.stamp(FRAME) is None
    pacing.close()
