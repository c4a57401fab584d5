from types import MappingProxyType

import numpy as np
import pytest

from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.takes import TakeCache
from benchmarks.evaluate.protocols.ten_objects import scanned_poses, ten_objects
from benchmarks.evaluate.tables.latency import FRAMES, MOVING, paced, shots
from devices.clock import WallClock
from devices.messages import Frame
from scenes.pose import Pose
from scenes.samples import sample_room
from tracking.output import TrackOutput

WHERE = Pose.from_yaw(0.1, (0.0, -0.3, 1.1))


class Slow:
    """Takes a given time for each frame."""

    def __init__(self, busy_ns):
        self.busy_ns = busy_ns
        self.seen: list[Frame] = []

    def start(self):
        return 0

    def step(self, state, frame, now_ns):
        self.seen.append(frame)
        if state:
            clock = WallClock()
            clock.sleep_until(self.busy_ns)
        return state + 1, TrackOutput((), MappingProxyType({"pose": self.busy_ns}), None)


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    desk = sample_room("desk")
    poses = standing({item.object_id: item.world_from_object for item in desk.objects})
    taken = [Shot(k * 50_000_000, poses) for k in range(12)]
    cache = TakeCache(tmp_path_factory.mktemp("takes"))
    with FilmSet(desk, cache=cache) as film_set:
        conditions = Conditions(lens_size_px=64, bitrate_mbps=1.0)
        return film_set.film(taken, conditions, seed=0, advance=lambda _share: None)


def test_every_frame_is_published_or_dropped_and_none_is_seen_before_its_time(take):
    method = Slow(busy_ns=120_000_000)
    run = paced(method, take, WHERE)
    assert len(run.latency_ms) + run.dropped == 11
    assert run.dropped > 0
    assert min(run.latency_ms) >= 120.0
    assert run.stage_ms == {"pose": 120.0}
    seqs = [frame.seq for frame in method.seen]
    assert seqs[0] == 0
    assert seqs == sorted(set(seqs))
    assert all(np.array_equal(f.world_from_rig.matrix(), WHERE.matrix()) for f in method.seen)


def test_two_of_ten_objects_move_to_and_fro():
    room, _ = ten_objects()
    scanned = scanned_poses(room)
    taken = shots(scanned)
    assert len(taken) == FRAMES
    for name, pose in scanned.items():
        places = [shot.placements[name].world_from_part[0].translation for shot in taken]
        span = np.linalg.norm(np.ptp(places, axis=0))
        assert (span > 0.3) == (name in MOVING)
        assert np.allclose(places[0], pose.translation)
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        assert steps.max() < 0.02
