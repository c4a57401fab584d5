"""What changed only, and not before there is an origin."""

import numpy as np

from devices.clock import ManualClock
from scenes.pose import Pose
from scenes.state import Annotation, SceneState
from studio.live.hololens.drawing import Drawing


def drawing(headset, pose):
    return Drawing(
        headset.draw,
        device_from_world=lambda: pose["now"],
        eye=lambda: None,
        hub=lambda: None,
        models={},
        wearer="hololens",
        clock=ManualClock(),
    )


def test_a_list_is_sent_when_something_has_changed(headset):
    pose = {"now": None}
    made = drawing(headset, pose)
    line = Annotation("l", "p1", np.array([[0.0, 0, 1], [1, 0, 1]]), (1, 0, 0))
    made.publish(SceneState(annotations={"l": line}))
    assert not made.once()
    assert headset.drawn == []
    pose["now"] = Pose.identity()
    assert made.once()
    assert not made.once()
    assert list(headset.drawn[0]) == ["line:l:part0"]
    assert made.count == 1
    pose["now"] = Pose.from_yaw(0.0, (0.1, 0.0, 0.0))
    assert made.once()
    made.publish(SceneState())
    assert made.once()
    assert headset.drawn[-1] == {}
