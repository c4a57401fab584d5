"""The page over the real room, in an emulated Quest 3: how it is laid by marks, what is seen."""

import json
import re
import time
from dataclasses import replace

import numpy as np
import pytest

from devices.hub.protocol.wire import decode_body, unpack_bodies
from scenes.frames import WORLD_FROM_GLTF
from scenes.pose import Pose
from scenes.state import Proposal, SceneState, TrackedObject, TrackState, reduce_state
from tests.studio.browser import until
from tests.studio.web.conftest import JOINING, READY

WEAR = """
window.headset = new IWER.XRDevice(IWER.metaQuest3);
headset.installRuntime({ forceInstall: true });
"""
CORRECT_SPACE = """
const posed = XRFrame.prototype.getPose;
XRFrame.prototype.getPose = function (space, base) {
  const pose = posed.call(this, space, base);
  if (!pose || space !== live.headset.passthrough.kept.anchor?.anchorSpace) return pose;
  const { position: { x, y, z }, orientation } = pose.transform;
  return { transform: { position: { x: x + window.shift, y, z }, orientation } };
};
window.shift = 0.2;
headset.position.x += 0.2;
"""
"""The emulator's own `recenter` leaves anchors where they are in its space."""

YAW, PLACE = 0.7, np.array([0.3, 0.02, -0.2])
"""Where the headset's space truly lies in the room, Y up."""

CODES = WORLD_FROM_GLTF.inverse() @ np.array([(0.5, 1.5, 1.2), (2.0, -0.5, 1.3), (-1.0, 1.5, 1.4)])
HEAD = np.array([0.0, 1.6, 0.4])
"""In the room."""


def in_headset(place):
    """A place of the room in the headset's space."""
    c, s = np.cos(YAW), np.sin(YAW)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T @ (np.asarray(place) - PLACE)


def put_head(page, place=HEAD):
    x, y, z = in_headset(place)
    page.evaluate(f"headset.position.set({x}, {y}, {z})")


@pytest.fixture
def joined(page, hub, iwer_source):
    """The page of somebody who has joined, with the emulated headset."""
    added = page.call("Page.addScriptToEvaluateOnNewDocument", source=iwer_source + WEAR)
    page.visit(hub.invite().url, width=480, height=360)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    page.wait_for("live.isWhole()")
    put_head(page)
    yield page
    page.evaluate("live.headset.leave()")
    page.call("Page.removeScriptToEvaluateOnNewDocument", identifier=added["identifier"])


def enter(page):
    page.wait_for("document.getElementById('ar').ariaDisabled === 'false'")
    page.evaluate("document.getElementById('ar').click()")
    page.wait_for("live.headset.isOn && live.headset.passthrough.marking.group.visible")


def words(page):
    return page.evaluate("live.headset.passthrough.marking.words.text")


def mark(page, place):
    """Hold the dot of the right hand to a place of the room, and press."""
    right, tip = "headset.controllers.right", "live.headset.passthrough.marking.tips[1].position"
    wanted = in_headset(place)
    at = wanted
    for _ in range(2):
        page.evaluate(f"{right}.position.set({at[0]}, {at[1]}, {at[2]})")
        page.pass_frames()
        at = at + wanted - page.evaluate(f"{tip}.toArray()")
    before = words(page)
    page.evaluate(f"{right}.updateButtonValue('trigger', 1)")
    page.wait_for(f"live.headset.passthrough.marking.words.text !== {json.dumps(before)}")
    page.evaluate(f"{right}.updateButtonValue('trigger', 0)")
    page.wait_for("!live.headset.sides[1].select && !live.headset.sides[1].marked")


def lay(page, codes=CODES):
    for code in codes:
        mark(page, code)


def laying(page):
    found = page.evaluate("live.headset.passthrough.laying")
    return None if found is None else (found["yaw"], np.array(found["place"]))


def body_with_controller(guest):
    """The newest body that has a right controller: one has none before one enters."""

    def newest():
        bodies = (decode_body(b) for data in guest.bodies[-3:] for _, b in unpack_bodies(data))
        return next((body for body in bodies if body.controllers[1] is not None), None)

    return until(bool, newest)


COUNT_SENT = """
const send = live.link.sendBody.bind(live.link);
window.sentBodies = 0;
live.link.sendBody = (bytes) => { window.sentBodies += 1; return send(bytes); };
"""


def test_the_room_is_laid_by_marks_and_others_see_where_one_stands(joined, invite_guest):
    page, guest = joined, invite_guest("Grace")
    enter(page)
    assert "1 of 3: touch the middle of the code “box:1”" in words(page)
    page.evaluate(COUNT_SENT)
    page.pass_frames(20)
    assert page.evaluate("sentBodies") == 0, "nobody knows where one stands before"
    lay(page, CODES[:2])
    assert laying(page) is None
    mark(page, CODES[2] + np.array([0.01, 0.0, 0.0]))  # a hand is not exact

    assert re.search(r"The room is laid: 3 marks, 0\.[345] cm off", words(page))
    yaw, place = laying(page)
    assert yaw == pytest.approx(YAW, abs=0.01)
    assert place == pytest.approx(PLACE, abs=0.015)
    body = body_with_controller(guest)
    assert body.room_from_head.translation == pytest.approx(HEAD, abs=0.02)
    # Neither thumbstick nor button moves one who walks by themselves.
    page.evaluate("headset.controllers.right.updateAxes('thumbstick', 1, -1)")
    page.pass_frames(5)
    assert laying(page)[1] == pytest.approx(place, abs=1e-4)
    page.evaluate("headset.controllers.right.updateAxes('thumbstick', 0, 0)")
    assert page.messages == []


def test_pinches_of_a_hand_mark_as_well(joined):
    page = joined
    enter(page)
    page.evaluate("headset.primaryInputMode = 'hand'")
    page.wait_for("live.headset.passthrough.marking.tips[0].visible")
    page.evaluate("headset.hands.left.poseId = 'pinch'; headset.hands.left.updatePinchValue(1)")
    page.wait_for("live.headset.passthrough.marking.marks.length === 1")
    tip = page.evaluate("live.headset.passthrough.marking.marks[0].seen")
    assert np.linalg.norm(np.subtract(tip, in_headset(HEAD))) < 1.0
    assert "2 of 3" in words(page)
    assert page.messages == []


@pytest.mark.parametrize(
    ("places", "said"),
    [
        ((CODES[0], CODES[0] + [0.1, 0, 0], CODES[0] - [0.1, 0, 0]), "apart, wanted 1.0 m or more"),
        ((CODES[0], CODES[1], CODES[2] + [0.0, 0.5, 0.0]), "off, wanted 5.0 cm or less"),
        ((CODES[0], None, CODES[2]), "2 marks, 0.0 cm off"),
        ((None, None, CODES[2]), "1 marked, wanted 2 or more"),
    ],
    ids=["close", "off", "two", "one"],
)
def test_bad_marks_are_one_line_and_begin_anew(joined, places, said):
    page = joined
    enter(page)
    for place in places:
        if place is None:
            before = words(page)
            page.evaluate("headset.controllers.right.updateButtonValue('squeeze', 1)")
            page.wait_for(f"live.headset.passthrough.marking.words.text !== {json.dumps(before)}")
            page.evaluate("headset.controllers.right.updateButtonValue('squeeze', 0)")
            page.wait_for("!live.headset.sides[1].squeeze && !live.headset.sides[1].grips")
        else:
            mark(page, place)
    assert said in words(page)
    assert (laying(page) is not None) == ("0.0 cm" in said)
    assert page.evaluate("live.headset.passthrough.isMarking") == (laying(page) is None)
    assert page.evaluate("live.board.drawn.size") == 0
    assert page.messages == []


def test_codes_that_are_taken_for_each_other_are_noticed(joined):
    page = joined
    put_head(page, (-1.0, 1.6, 0.8))
    enter(page)
    # Both heights are right: a code that hangs as high as another one is there.
    mark(page, [CODES[1][0], CODES[0][1], CODES[1][2]])
    mark(page, [CODES[0][0], CODES[1][1], CODES[0][2]])
    page.evaluate("headset.controllers.right.updateButtonValue('squeeze', 1)")
    page.wait_for("/outside of the room/.test(live.headset.passthrough.marking.words.text)")
    assert laying(page) is None


def test_it_stays_laid_by_its_anchor_and_lies_there_the_next_time(joined):
    page = joined
    enter(page)
    lay(page)
    page.wait_for("live.headset.passthrough.kept.isStored")
    _yaw, place = laying(page)

    def head():
        return np.array(
            page.evaluate(
                "live.room.upright.worldToLocal(live.room.camera.getWorldPosition("
                "live.room.camera.position.clone())).toArray()"
            )
        )

    before = head()
    # The headset corrects its space by 20 cm, the anchor with it: the room stays where it is.
    page.evaluate(CORRECT_SPACE)
    page.wait_for(f"Math.abs(live.headset.passthrough.laying.place[0] - {place[0]}) > 0.1")
    page.pass_frames()
    assert head() == pytest.approx(before, abs=0.005)
    page.evaluate("window.shift = 0; headset.position.x -= 0.2")

    page.evaluate("live.headset.leave()")
    page.wait_for("!live.headset.isOn")
    enter(page)
    page.wait_for("live.headset.passthrough.isLaid")
    assert "lies as last time" in words(page)
    assert head() == pytest.approx(before, abs=0.02)
    # Laid anew by the tile at the left hand.
    page.evaluate("live.headset.palette.redo()")
    page.wait_for("live.headset.passthrough.isMarking && !live.headset.passthrough.isLaid")
    assert "1 of 3" in words(page)
    assert page.messages == []


def test_without_an_anchor_a_moved_space_has_to_be_marked_again(joined):
    page = joined
    page.evaluate("XRFrame.prototype.createAnchor = undefined")
    enter(page)
    lay(page)
    assert laying(page) is not None
    page.evaluate("headset.recenter()")
    page.wait_for("live.headset.passthrough.isMarking")
    assert "The headset has moved its space." in words(page)
    assert laying(page) is None


def test_no_splats_are_drawn_but_outlines_people_and_proposals(joined, hub, invite_guest):
    page = joined
    invite_guest("Grace")
    now = time.monotonic_ns()
    pose = Pose.from_yaw(0.0, (0.3, 0.2, 0.0))
    cov = np.zeros((4, 4))
    box = TrackedObject("box-1", now, pose, cov, 1.0, TrackState.TRACKED, 1.0, 0)
    state = reduce_state(SceneState(), box, now)
    there = Proposal("g/1", "p2", "Grace", "box-1", Pose.from_yaw(0.0, (-0.6, 0.3, 0.0)))
    state = reduce_state(state, there, now)
    hub.publish(state)
    page.wait_for("live.proposals.copies.size === 1")
    enter(page)
    lay(page)
    assert page.evaluate("live.room.spark.visible") is False
    assert page.evaluate("live.surfaces.group.visible") is False
    page.wait_for("live.headset.passthrough.outlines.size === 1")
    # The outline of a proposal is the whole box; it turns green when the box stands there.
    points = page.evaluate("[...live.proposals.copies.values()][0].edge.group.children[1].count")
    assert points == 16
    assert page.evaluate("[...live.proposals.copies.values()][0].isMet") is False
    now = time.monotonic_ns()
    moved = TrackedObject(
        "box-1", now, there.world_from_object, cov, 1.0, TrackState.TRACKED, 1.0, 0
    )
    hub.publish(reduce_state(state, moved, now))
    page.wait_for("[...live.proposals.copies.values()][0].isMet")
    colour = page.evaluate(
        "[...live.proposals.copies.values()][0].edge.group.children[0].material.color.toArray()"
    )
    assert colour[1] > max(colour[0], colour[2])

    page.evaluate("live.headset.leave()")
    page.wait_for("!live.headset.isOn")
    assert page.evaluate("live.room.spark.visible") is True
    points = page.evaluate("[...live.proposals.copies.values()][0].edge.group.children[1].count")
    assert points == 5
    assert page.messages == []


def test_the_camera_is_a_place_as_well_and_a_room_needs_two(joined, hub):
    page = joined
    page.evaluate("live.room.manifest.codes = live.room.manifest.codes.slice(0, 1)")
    page.evaluate("document.getElementById('ar').click()")
    page.wait_for("!document.getElementById('notice').hidden")
    assert page.evaluate("document.getElementById('notice').textContent").endswith(
        "here 1 are known: hang up codes and prepare the room with them."
    )
    hub.publish(replace(SceneState(), world_from_rig=Pose.from_yaw(0.3, (-1.2, -0.4, 1.3))))
    page.wait_for("live.room.cameraPlace !== null")
    enter(page)
    mark(page, CODES[0])
    assert "2 of 2: touch the 360° camera, between its lenses" in words(page)
    mark(page, (-1.2, 1.3, 0.4))
    assert laying(page)[0] == pytest.approx(YAW, abs=0.01)
    assert page.messages == []


def test_a_device_without_ar_says_so_in_a_line(page, hub):
    page.visit(hub.invite().url, width=480, height=360)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    page.wait_for("document.getElementById('ar').ariaDisabled === 'true'")
    page.evaluate("document.getElementById('ar').click()")
    page.wait_for("!document.getElementById('notice').hidden")
    assert page.evaluate("document.getElementById('notice').textContent") == (
        "This device has no AR (WebXR). In a Quest 3, open this page in its own browser."
    )
    assert page.evaluate("live.headset.isOn") is False
