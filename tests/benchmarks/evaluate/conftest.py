"""Answers of trackers with a known error, without any tracker."""

from types import MappingProxyType

import numpy as np
import pytest

from benchmarks.evaluate.filmed.trial import Answer
from devices.recording_codec import RecordedTruth
from scenes.pose import Pose
from scenes.state import TrackedObject, TrackState


def tracked(object_id, pose, *, t_ns=0, state=TrackState.TRACKED, confidence=1.0, sigma=0.01):
    return TrackedObject(
        object_id=object_id,
        t_ns=t_ns,
        world_from_object=pose,
        covariance=np.diag([sigma**2] * 4),
        visible_fraction=1.0,
        state=state,
        confidence=confidence,
        source_seq=0,
    )


@pytest.fixture
def answer():
    """Makes an answer: where each object is, and how far off (x in metres, yaw) it is seen."""

    def make(true, *, off=None, t_ns=0, seq=0, visible=None, states=None, camera=None):
        off, states = off or {}, states or {}
        tracks = {}
        for name, pose in true.items():
            shift, turn = off.get(name, (0.0, 0.0))
            seen = Pose.from_yaw(pose.yaw() + turn, pose.translation + np.array([shift, 0, 0]))
            tracks[name] = tracked(
                name, seen, t_ns=t_ns, state=states.get(name, TrackState.TRACKED)
            )
        truth = RecordedTruth(
            seq, t_ns, MappingProxyType(dict(true)), visible or {}, frozenset(), Pose.identity()
        )
        return Answer(seq, t_ns, tracks, camera, truth)

    return make
