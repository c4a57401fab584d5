import json
from dataclasses import replace

import numpy as np
import pytest

from devices.recording_codec import track_to_json
from scenes.pose import Pose
from scenes.state import TrackedObject, TrackState
from studio.reports.tracks_file import TracksFile
from studio.session.plan import SessionPlan


def track(object_id, seq):
    pose = Pose.from_yaw(0.1 * seq, (0.1 * seq, 0.0, 0.0))
    covariance = np.eye(4) * 1e-4
    state = TrackState.TRACKED
    return TrackedObject(object_id, seq * 100, pose, covariance, 1.0, state, 0.9, seq)


@pytest.fixture
def info(tiny):
    return replace(tiny.session(SessionPlan(methods=("own",))).info, scenario_name='a "name"')


def test_the_file_is_what_all_frames_at_once_would_give(tmp_path, info):
    frames = [(track("chair-1", seq), track("stool-1", seq)) for seq in range(3)]
    path = tmp_path / "tracks.json"
    with TracksFile(path, info, ["own", "paper"]) as file:
        for frame in frames:
            file.add("own", frame)
            file.add("paper", ())
    written = {
        "format": "gaussiannexus tracks",
        "version": 1,
        "units": {"length": "m", "time": "ns"},
        "scene": info.scene,
        "scenario": info.scenario_name,
        "seed": info.seed,
        "methods": {
            "own": [
                {
                    "seq": frame[0].source_seq,
                    "t_ns": frame[0].t_ns,
                    "objects": [track_to_json(one) for one in frame],
                }
                for frame in frames
            ],
            "paper": [],
        },
    }
    assert path.read_text() == json.dumps(written, allow_nan=False) + "\n"
    assert [item.name for item in tmp_path.iterdir()] == ["tracks.json"]


def test_a_session_that_fails_leaves_nothing(tmp_path, info):
    def fail():
        with TracksFile(tmp_path / "tracks.json", info, ["own"]) as file:
            file.add("own", (track("chair-1", 1),))
            raise RuntimeError("the tracker fell over")

    with pytest.raises(RuntimeError, match="fell over"):
        fail()
    assert not list(tmp_path.iterdir())
