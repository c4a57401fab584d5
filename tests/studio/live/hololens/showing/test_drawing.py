"""What changed only, and not before there is an origin."""

import numpy as np

from devices.clock import ManualClock
from scenes.pose import Pose
from scenes.state import Annotation, SceneState, SharedPrimitive
from studio.live.hololens.showing.drawing import PASSED_NS, Drawing


def drawing(headset, pose, *, in_hand=lambda _now_ns: None, clock=None):
    return Drawing(
        headset.draw,
        device_from_world=lambda: pose["now"],
        eye=lambda: None,
        hub=lambda: None,
        in_hand=in_hand,
        models={},
        wearer="hololens",
        clock=clock or ManualClock(),
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


def box(user_id, x=0.0):
    pose = Pose.from_yaw(0.0, (x, 0, 0))
    return SharedPrimitive("p1/a", user_id, "box", (0.2, 0.2, 0.2), (1, 0, 0), pose)


def words(headset):
    return {k: i.text for k, i in headset.drawn[-1].items() if k.endswith(":words")}


def test_whose_a_shape_has_become_is_said_for_a_while_and_the_wearers_always(headset):
    clock = ManualClock()
    made = drawing(headset, {"now": Pose.identity()}, clock=clock)

    def show(user_id):
        made.publish(SceneState(primitives={"p1/a": box(user_id)}))
        made.once()
        return words(headset)

    assert show("p1") == {}
    assert show("hololens") == {"primitive:p1/a:words": "yours"}
    clock.sleep_until(clock.now_ns() + 3 * PASSED_NS)
    assert show("hololens") == {"primitive:p1/a:words": "yours"}
    assert show("p2") == {"primitive:p1/a:words": "somebody else has it"}
    clock.sleep_until(clock.now_ns() + PASSED_NS - 1)
    assert show("p2") != {}
    clock.sleep_until(clock.now_ns() + 1)
    assert show("p2") == {}


def test_a_shape_in_the_wearers_hand_is_where_the_hand_has_it(headset):
    held = {"now": box("hololens", 1.0)}
    made = drawing(headset, {"now": Pose.identity()}, in_hand=lambda _now_ns: held["now"])

    def at(state):
        made.publish(state)
        made.once()
        return headset.drawn[-1]["primitive:p1/a:body"].world_from_item.translation[0]

    assert at(SceneState(primitives={"p1/a": box("hololens")})) == 1.0
    assert at(SceneState(primitives={"p1/a": box("p2")})) == 0.0, "it is somebody else's meanwhile"
    held["now"] = None
    assert at(SceneState(primitives={"p1/a": box("hololens", 0.5)})) == 0.5
