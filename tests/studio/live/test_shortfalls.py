"""Reasons for what was not tracked, in words that name a cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import TrackedObject, TrackState
from studio.live.shortfalls import Losses, drop_words, loss_words

S = 1_000_000_000
CHAIR = TrackedObject(
    "chair-1", 0, Pose.identity(), np.eye(4), 1.0, TrackState.TRACKED, 0.9, source_seq=1
)


def test_few_drops_need_no_words():
    assert drop_words(came_hz=30, tracked_hz=28) == ""
    assert drop_words(came_hz=0, tracked_hz=0) == ""
    words = drop_words(came_hz=30, tracked_hz=12)
    assert "too slow for 30 pictures a second: it tracks 12." in words
    assert "fewer or smaller" in words
    assert "0.4." in drop_words(came_hz=30, tracked_hz=0.4)
    assert "simulated camera" in drop_words(came_hz=30, tracked_hz=12, is_simulated=True)


@pytest.mark.parametrize(
    ("before", "gap_s", "more", "said"),
    [
        (None, 0.0, {}, "not where the scan has it"),
        (CHAIR, 0.1, {"is_camera_lost": True}, "camera was moved"),
        (CHAIR, 1.2, {"is_dropped": True}, "within 1.2 s in which this computer was too slow"),
        (CHAIR, 1.2, {}, "no pictures came"),
        (replace(CHAIR, visible_fraction=0.2), 0.1, {}, "something hid it"),
        (replace(CHAIR, state=TrackState.OCCLUDED), 0.1, {}, "something hid it"),
        (CHAIR, 0.1, {}, "moved too fast"),
        (replace(CHAIR, state=TrackState.STATIC), 0.1, {}, "taken away"),
    ],
)
def test_a_loss_says_a_reason(before, gap_s, more, said):
    asked = {"is_camera_lost": False, "is_dropped": False, **more}
    assert said in loss_words(before, gap_s=gap_s, **asked)


def test_a_loss_is_said_once_and_forgotten_when_it_is_found(tiny):
    losses = Losses(tiny.scene)
    assert losses.notice([CHAIR], dropped=0, is_camera_lost=False) == []
    lost = replace(CHAIR, state=TrackState.LOST, t_ns=2 * S)
    (said,) = losses.notice([lost], dropped=5, is_camera_lost=False)
    assert said.startswith("Chair 1 is lost: it moved within 2.0 s in which this computer")
    again = replace(lost, t_ns=3 * S)
    assert losses.notice([again], dropped=5, is_camera_lost=False) == []
    assert "too slow" in losses.lost["chair-1"]
    losses.notice([CHAIR], dropped=5, is_camera_lost=False)
    assert losses.lost == {}
