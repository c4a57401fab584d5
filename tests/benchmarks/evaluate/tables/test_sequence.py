from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.evaluate.tables.sequence import HAND_HELD, PUSHED, every, good_share, way
from devices.messages import EncodedFrame, Frame
from scenes.pose import Pose
from scenes.samples import sample_room
from studio.session.pipeline import SessionInput, SessionMessage
from tests.studio.conftest import RIG

TRUE = {"chair-1": Pose.identity()}


@pytest.mark.parametrize("motion", [PUSHED, HAND_HELD], ids=["chair", "book"])
@pytest.mark.parametrize("seed", range(4))
def test_a_way_begins_at_the_start_stays_in_reach_and_never_leaps(motion, seed):
    start = sample_room(motion.scene).object_by_id(motion.object_id).world_from_object
    seconds = np.arange(120) / 30
    poses = way(motion, start, seconds, np.random.default_rng([seed, 30]))
    assert np.allclose(poses[0].matrix(), start.matrix())
    places = np.array([pose.translation for pose in poses])
    reach = np.array(motion.reach_m) + np.abs(start.translation - motion.centre_m) + 1e-9
    assert (np.abs(places - motion.centre_m) <= reach).all()
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() < 0.08
    turns = np.diff(np.unwrap([pose.yaw() for pose in poses]))
    assert np.degrees(np.abs(turns).max()) < 8
    assert np.ptp(places, axis=0)[:2].min() > 0.03


def test_every_third_frame_as_if_the_camera_were_that_slow():
    messages = []
    for seq in range(7):
        frame = Frame("s", seq, seq * 300, seq * 300, (), RIG, None)
        packet = EncodedFrame("s", seq, seq * 300, b"", True)
        messages.append(SessionMessage(SessionInput(frame, packet)))
    kept = [message.frame for message in every(messages, 3)]
    assert [(f.seq, f.t_ns, f.received_ns) for f in kept] == [
        (0, 0, 0), (1, 300, 300), (2, 600, 600),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("off", "share"), [((0.049, 0.0), 1.0), ((0.051, 0.0), 0.0), ((0.0, np.radians(5.1)), 0.0)]
)
def test_good_is_within_five_centimetres_and_five_degrees(answer, off, share):
    motion = SimpleNamespace(object_id="chair-1", kind="chair")
    assert good_share([[answer(TRUE, off={"chair-1": off})]], motion) == share
