"""The page in an emulated headset (iwer as a Quest 3): what is sent, pointing, jumping."""

import time

import numpy as np
import pytest

from devices.hub.protocol.messages import Immersion
from devices.hub.protocol.wire import decode_body, unpack_bodies
from scenes.mesh import CollisionMesh
from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState, reduce_state
from tests.studio.browser import until
from tests.studio.web.conftest import JOINING, READY

WEAR = """
window.headset = new IWER.XRDevice(IWER.metaQuest3);
headset.installRuntime({ forceInstall: true });
headset.position.set(0.2, 1.7, 0.1);
"""


@pytest.fixture
def inside(page, hub, iwer_source):
    """The page after *Enter VR*."""
    added = page.call("Page.addScriptToEvaluateOnNewDocument", source=iwer_source + WEAR)
    page.visit(hub.invite().url, width=320, height=240)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    page.wait_for("document.getElementById('vr').ariaDisabled === 'false'")
    page.evaluate(
        "live.control.camera.position.set(0, -0.5, 1.6); live.control.lookAt("
        "live.room.camera.position.clone().set(0, 3, 1.6))"
    )
    page.evaluate("document.getElementById('vr').click()")
    page.wait_for("live.headset.isOn")
    yield page
    page.call("Page.removeScriptToEvaluateOnNewDocument", identifier=added["identifier"])


def newest_body(guest, wanted):
    """Return the first person's bodies as another client gets them."""

    def newest():
        bodies = (
            decode_body(b) for data in guest.bodies[-5:][::-1] for _, b in unpack_bodies(data)
        )
        return next((body for body in bodies if wanted(body)), None)

    return until(bool, newest)


def test_head_and_controllers_are_sent_as_they_are_held(inside, invite_guest):
    guest = invite_guest("Grace")
    body = newest_body(guest, lambda body: None not in body.controllers)

    # The headset's floor is where one stood: 0.5 m before the middle (y up: z = 0.5).
    assert body.room_from_head.translation == pytest.approx([0.2, 1.7, 0.6], abs=2e-3)
    assert body.hands == (None, None)
    inside.evaluate("headset.controllers.right.position.set(0.3, 1.2, -0.4)")
    place = [0.3, 1.2, 0.1]

    def is_there(body):
        held = body.controllers[1]
        return held and np.allclose(held.room_from_grip.translation, place, atol=0.05)

    newest_body(guest, is_there)
    assert inside.evaluate("live.room.spark.maxStdDev") == pytest.approx(np.sqrt(5))
    assert inside.messages == []


def test_the_trigger_points_and_the_grip_draws(inside, hub, invite_guest):
    guest = invite_guest("Grace")
    inside.evaluate("headset.controllers.right.updateButtonValue('trigger', 1)")
    ray = newest_body(guest, lambda body: body.ray is not None).ray
    assert np.linalg.norm(ray[1] - ray[0]) > 0.3
    inside.evaluate("headset.controllers.right.updateButtonValue('trigger', 0)")
    newest_body(guest, lambda body: body.ray is None)

    inside.evaluate("headset.controllers.right.position.set(0.2, 1.3, -0.3)")
    inside.evaluate("headset.controllers.right.updateButtonValue('squeeze', 1)")
    inside.wait_for("live.board.own !== null")
    for x in (0.25, 0.3, 0.35):
        inside.evaluate(f"headset.controllers.right.position.set({x}, 1.3, -0.3)")
        inside.wait_for(f"live.board.own.points.at(-1)[0] > {x - 0.04}")
    inside.evaluate("headset.controllers.right.updateButtonValue('squeeze', 0)")
    inside.wait_for("live.board.own === null && live.board.lines().length === 1")
    line = whole_line(hub)
    assert line.points_in_world[:, 2] == pytest.approx(1.3, abs=0.15)
    inside.evaluate("headset.controllers.right.updateButtonValue('b-button', 1)")
    inside.wait_for("live.board.lines().length === 0")


def whole_line(hub):
    """The line that was drawn from x = 0.2 to 0.35, once its end has come, too."""

    def newest():
        ways = [(line, np.ptp(line.points_in_world[:, 0])) for line in hub.take().lines]
        return next((line for line, way in ways if way > 0.1), None)

    return until(bool, newest)


def placed(hub, wanted):
    """Return the newest primitive or proposal that is as wanted, publishing what has come."""
    return until(bool, lambda: next((it for it in hub.take().placed if wanted(it)), None))


def test_a_shape_is_chosen_at_the_left_hand_put_and_carried(inside, hub):
    left, right = "headset.controllers.left", "headset.controllers.right"
    # One looks at one's left hand: the palette is over it.
    inside.evaluate(f"{left}.position.set(0.1, 1.55, -0.35)")
    inside.wait_for("live.headset.palette.group.visible")
    x, y, z = inside.evaluate(
        "(() => { const { group, tiles } = live.headset.palette;"
        " group.updateWorldMatrix(true, true);"
        " const at = live.room.upright.worldToLocal(tiles.find((it) => it.name === 'box')"
        ".getWorldPosition(live.room.camera.position.clone()));"
        " return live.headset.rig.worldToLocal(live.room.upright.localToWorld(at)).toArray(); })()"
    )
    inside.evaluate(f"{right}.position.set({x}, {y}, {z + 0.06})")
    inside.wait_for("live.tools.tool === 'shape'")
    inside.evaluate(f"{left}.position.set(-0.3, 1.0, 0.2)")
    inside.wait_for("!live.headset.palette.group.visible")

    inside.evaluate(f"{right}.position.set(0.3, 1.2, -0.4)")
    inside.wait_for("!live.headset.sides[1].grips")
    inside.evaluate(f"{right}.updateButtonValue('squeeze', 1)")
    body = placed(hub, lambda body: body.shape == "box")
    inside.evaluate(f"{right}.updateButtonValue('squeeze', 0)")
    inside.wait_for("live.things.held === null")
    assert body.size_m == pytest.approx((0.3, 0.3, 0.3))

    # Gripped again it comes along, turned as the hand is.
    inside.evaluate(f"{right}.updateButtonValue('squeeze', 1)")
    inside.wait_for("live.headset.grab.holds(1)")
    inside.evaluate(f"{right}.position.set(0.6, 1.4, -0.4)")

    def carried(thing):
        way = thing.world_from_primitive.translation - body.world_from_primitive.translation
        return np.allclose(way, [0.3, 0.0, 0.2], atol=0.02)

    placed(hub, carried)
    inside.evaluate(f"{right}.updateButtonValue('b-button', 1)")
    placed(hub, lambda body: body.shape is None)
    inside.evaluate(f"{right}.updateButtonValue('b-button', 0)")
    inside.evaluate(f"{right}.updateButtonValue('squeeze', 0)")
    inside.wait_for("live.bodies.meshes.size === 0 && !live.headset.sides[1].grips")
    assert inside.messages == []


def test_a_shape_is_let_go_at_somebodys_hand_and_is_theirs(inside, hub, invite_guest):
    guest, tools = invite_guest("Grace"), invite_guest.tools
    inside.evaluate("live.tools.choose('shape')")
    right = "headset.controllers.right"
    inside.evaluate(f"{right}.position.set(0.3, 1.2, -0.4)")
    inside.pass_frames()

    def grip_and_let_go():
        inside.evaluate(f"{right}.updateButtonValue('squeeze', 1)")
        inside.wait_for("live.headset.grab.holds(1)")
        inside.evaluate(f"{right}.updateButtonValue('squeeze', 0)")
        inside.wait_for("live.things.held === null && !live.headset.sides[1].grips")

    def reach(place):
        """Let Grace hold a hand somewhere until the page shows it there."""
        head = tools.facing((0.3, 1.6, -1.2), np.pi)
        guest.keep(room_from_head=head, hands=(None, tools.open_hand(place, side=1.0)))
        shown = "live.people.byId.get('p2').shown?.hands?.[1]?.joints[0] ?? -9"
        inside.wait_for(f"Math.abs(({shown}) - ({place[0]})) <= 0.01")

    # Her hand is at the other end of the room: the shape stays Ada's.
    reach((-1.5, 1.2, 0.0))
    grip_and_let_go()
    body = placed(hub, lambda body: body.shape == "box")
    time.sleep(0.5)
    assert {body.user_id for body in hub.take().placed} <= {"p1"}

    # At the shape's far side: it is hers, where it was let go.
    x, y, z = body.world_from_primitive.translation
    reach((float(x), float(z) + 0.15, float(-y) - 0.1))
    grip_and_let_go()
    hers = placed(hub, lambda body: body.user_id == "p2")
    assert hers.primitive_id == body.primitive_id
    inside.wait_for("live.handing.shown()[0]?.[1] === 'Grace has it'")
    assert not inside.evaluate(f"live.things.isOwn('primitive', '{body.primitive_id}')")

    # She removes it, and the page shows none.
    guest.do(op="primitive", primitive=hers.primitive_id, shape=None)
    placed(hub, lambda body: body.shape is None)
    inside.wait_for("live.bodies.meshes.size === 0 && live.handing.shown().length === 0")
    assert inside.messages == []


def test_a_copy_of_an_object_slides_where_the_hand_points_and_turns_by_the_stick(inside, hub):
    now = time.monotonic_ns()
    box = TrackedObject(
        "box-1",
        now,
        Pose.from_yaw(0.0, (0.3, 0.2, 0.0)),
        np.zeros((4, 4)),
        1.0,
        TrackState.TRACKED,
        1.0,
        0,
    )
    hub.publish(reduce_state(SceneState(), box, now))
    inside.wait_for("live.room.objects.get('box-1').state === 'tracked'")
    inside.evaluate("live.tools.choose('propose')")
    right = "headset.controllers.right"
    # In the box: 0.2 m over the floor; the headset's floor is where one stands.
    inside.evaluate(f"{right}.position.set(0.3, 0.25, -0.64)")
    inside.pass_frames()
    inside.evaluate(f"{right}.updateButtonValue('squeeze', 1)")
    copy = placed(hub, lambda thing: getattr(thing, "object_id", "") == "box-1")
    assert copy.user_name == "Ada"
    # Held up, pointing down and ahead.
    inside.evaluate(
        f"{right}.quaternion.set(-0.3826834, 0, 0, 0.9238795);{right}.position.set(-0.2, 1.2, -0.2)"
    )
    there = placed(hub, lambda body: body.world_from_object.translation[0] < 0.0)
    assert there.world_from_object.translation[2] == pytest.approx(0.0, abs=0.03)
    inside.evaluate(f"{right}.updateAxes('thumbstick', 1, 0)")
    placed(hub, lambda thing: abs(thing.world_from_object.yaw()) > 0.3)
    assert inside.evaluate("Math.abs(live.headset.rig.rotation.y)") < 1e-6
    inside.evaluate(f"{right}.updateAxes('thumbstick', 0, 0)")
    inside.evaluate(f"{right}.updateButtonValue('squeeze', 0)")
    inside.wait_for("live.things.held === null")
    assert inside.evaluate("live.proposals.copies.size") == 1
    # A headset's surfaces hide copies for whoever is in VR, too, whose pictures go on.
    corners = np.array([[-0.6, 0.0, 0.2], [0.6, 0.0, 0.2], [0.6, 0.0, 1.4], [-0.6, 0.0, 1.4]])
    hub.hide_behind({(0, 0, 0): CollisionMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))})
    inside.wait_for("live.proposals.behind.depths.value.z === 1")
    drawn = inside.evaluate("live.drawn()")
    inside.wait_for(f"live.drawn() > {drawn} + 2 && live.room.renderer.xr.isPresenting")
    assert inside.evaluate("live.room.renderer.xr.enabled")
    assert inside.messages == []


def test_the_thumbstick_jumps_to_where_the_arc_ends_and_turns(inside):
    before = inside.evaluate("live.headset.rig.position.toArray()")
    inside.evaluate("headset.controllers.right.updateAxes('thumbstick', 0, -1)")
    inside.wait_for("live.headset.arc.isShown && live.headset.landing !== null")
    landing = inside.evaluate("live.headset.landing.toArray()")
    inside.evaluate("headset.controllers.right.updateAxes('thumbstick', 0, 0)")
    inside.wait_for("!live.headset.arc.isShown")

    head = inside.evaluate(
        "live.headset.rig.position.toArray().map((v, i) => v + [0.2, 0, 0.1][i])"
    )
    assert head == pytest.approx(landing, abs=1e-3)
    assert np.linalg.norm(np.subtract(landing, before)) > 0.3
    inside.evaluate("headset.controllers.right.updateAxes('thumbstick', 1, 0)")
    inside.wait_for("Math.abs(live.headset.rig.rotation.y + Math.PI / 6) < 1e-3")


def test_hands_arrive_with_all_their_joints(inside, invite_guest):
    guest = invite_guest("Grace")
    inside.evaluate("headset.primaryInputMode = 'hand'")
    body = newest_body(guest, lambda body: None not in body.hands)

    for hand in body.hands:
        assert hand.joints.shape == (25, 3)
        spread = np.linalg.norm(hand.joints - hand.joints[0], axis=1)
        assert 0.12 < spread.max() < 0.25
        assert (hand.radii_m > 0.003).all()
    # One sees one's own hands.
    assert inside.evaluate("live.headset.figure.hands.map((hand) => hand.group.visible)") == [
        True,
        True,
    ]


def test_leaving_vr_leads_back_to_the_page(inside):
    inside.evaluate("live.headset.leave()")
    inside.wait_for("!live.headset.isOn")

    assert inside.evaluate("live.eye()") == pytest.approx([0, -0.5, 1.6], abs=1e-3)
    assert inside.evaluate("live.room.spark.maxStdDev") == pytest.approx(np.sqrt(8))
    drawn = inside.evaluate("live.drawn()")
    inside.evaluate("live.control.go('corner')")
    inside.wait_for(f"live.drawn() > {drawn}")


def test_the_page_says_how_the_headset_is_doing(inside, hub):
    def newest(wanted):
        return until(bool, lambda: next(filter(wanted, hub.headsets()), None))

    # Worn: of pictures that come a second late a page says that it is not.
    found = newest(lambda each: each.said.rate_hz is not None and each.said.is_worn)
    assert found.person.name == "Ada"
    assert found.said.immersion is Immersion.VR
    assert found.said.rate_hz > 0
    newest(lambda each: each.body_age_s is not None and each.body_age_s < 2.0)
    inside.evaluate("live.device.battery = { level: 0.42, charging: true }")
    found = newest(lambda each: each.said.battery_percent == 42.0)
    assert found.said.is_charging
    # Without a battery that the browser knows, none is made up.
    inside.evaluate("live.device.battery = null")
    assert not newest(lambda each: each.said.battery_percent is None).said.is_charging
    inside.evaluate("headset.updateVisibilityState('hidden')")
    assert newest(lambda each: not each.said.is_worn).said.immersion is Immersion.VR
    inside.evaluate("headset.updateVisibilityState('visible')")
    newest(lambda each: each.said.is_worn)
    inside.evaluate("live.headset.leave()")
    assert not newest(lambda each: each.said.immersion is Immersion.NONE).said.is_worn
    assert inside.messages == []


def test_a_browser_without_a_headset_says_nothing(page, hub):
    page.visit(hub.invite().url, width=320, height=240)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    page.wait_for("performance.now() - live.device.saidAt > 2500")
    assert hub.headsets() == ()
    assert page.messages == []
