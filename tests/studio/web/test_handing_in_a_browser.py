"""Shapes pass from one person to another on the page, in a real browser against the real hub."""

import os
import time
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from devices.hub.elsewhere import Elsewhere
from devices.hub.entities.board import HOLD_NS
from devices.hub.entities.drawn import drawn_entity
from devices.hub.protocol.messages import Do
from devices.hub.roles import Op, Person, Role
from scenes.pose import Pose
from tests.studio.browser import until
from tests.studio.web.conftest import choose, drag, only, seen_at

PICTURES = os.environ.get("NEXUS_TEST_PICTURES")
"""Folder for pictures of the page, to be looked at."""


def taken_by(who):
    return lambda state: body if (body := only(state.primitives)) and body.user_id == who else None


def draw_shape(page, echo):
    """The shape that the page's person put on the floor."""
    choose(page, "shape")
    at = seen_at(page, -0.8, 0, 0.5)
    drag(page, at, at)
    return echo.until(lambda state: only(state.primitives))


def ask(page, operation):
    """Ask the hub for an operation, once there is a connection: a busy machine may have lost it."""
    page.wait_for(f"live.link.do({operation}) !== null")


def test_a_shape_is_handed_over_and_handed_back(inside, echo, invite_guest):
    guest = invite_guest("Grace")
    body = draw_shape(inside, echo)
    key = body.primitive_id
    inside.wait_for("document.getElementById('thing-give').textContent === 'Give to Grace'")
    assert not inside.evaluate("document.getElementById('thing-give').hidden")
    assert inside.evaluate("document.getElementById('thing-taker').hidden"), "one person, no choice"
    inside.evaluate("document.getElementById('thing-give').click()")
    given = echo.until(taken_by("p2"))
    assert given.primitive_id == key
    inside.wait_for(f"live.handing.shown().join() === '{key},Grace has it'")
    assert "Grace has" in inside.evaluate("document.getElementById('notice').textContent")
    inside.wait_for("document.getElementById('thing-bar').hidden")
    if PICTURES:
        inside.rest()
        Image.fromarray(inside.picture()).save(Path(PICTURES) / "handed-over.png")

    # It is no longer the page's to move, also where the studio's word comes later.
    choose(inside, "carry")
    start = seen_at(inside, -0.8, 0.15, 0.64)
    drag(inside, start, start, seen_at(inside, 0.2, 0.15, 0.64), seen_at(inside, 0.2, 0.15, 0.64))
    assert "Grace’s" in inside.evaluate("document.getElementById('notice').textContent")
    ask(
        inside,
        f"'primitive', {{primitive: '{key}', shape: 'box', size: [1, 1, 1],"
        "pose: [1, 0, 0, 0, 0, 0, 1]}",
    )
    inside.wait_for("/Grace has it/.test(document.getElementById('notice').textContent)")

    guest.do(op="give", primitive=key, to="p1")
    back = echo.until(taken_by("p1"))
    assert back.world_from_primitive.translation[0] == pytest.approx(
        body.world_from_primitive.translation[0]
    )
    inside.wait_for("/Grace gave you/.test(document.getElementById('notice').textContent)")
    inside.wait_for(f"live.handing.shown().join() === '{key},yours'")
    start, end = (seen_at(inside, x, 0.15, 0.64) for x in (-0.8, 0.2))  # the view has turned
    drag(inside, start, start, end, end)
    echo.until(
        lambda state: only(state.primitives).world_from_primitive.translation[0] > 0.1 or None
    )
    inside.wait_for("live.handing.shown().length === 0")
    assert inside.messages == []


def test_one_of_several_people_is_chosen(inside, echo, invite_guest):
    for name in ("Grace", "Ivan"):
        invite_guest(name)
    choose(inside, "shape")
    at = seen_at(inside, -0.8, 0, 0.5)
    drag(inside, at, at)
    echo.until(lambda state: only(state.primitives))
    inside.wait_for("document.getElementById('thing-taker').options.length === 2")
    assert not inside.evaluate("document.getElementById('thing-taker').hidden")
    if PICTURES:
        Image.fromarray(inside.picture()).save(Path(PICTURES) / "whom-to-give.png")
    inside.evaluate("document.getElementById('thing-taker').value = 'p3'")
    inside.evaluate("document.getElementById('thing-give').click()")
    echo.until(taken_by("p3"))
    inside.wait_for("live.handing.shown()[0]?.[1] === 'Ivan has it'")


def test_what_somebody_has_left_is_taken_by_a_click(inside, echo, hub, invite_guest):
    guest = invite_guest("Grace")
    pose = [-0.8, 0, 0.5, 0, 0, 0, 1]
    guest.do(op="primitive", primitive="b", shape="box", size=[0.3] * 3, pose=pose)
    echo.until(lambda state: only(state.primitives))
    inside.wait_for("live.things.of('primitive').length === 1")
    hub.remove("p2")
    inside.wait_for("live.people.byId.size === 0")
    choose(inside, "carry")
    at = seen_at(inside, -0.8, 0.15, 0.64)
    drag(inside, at, at)
    echo.until(taken_by("p1"))
    inside.wait_for("/yours now/.test(document.getElementById('notice').textContent)")
    drag(inside, at, at, seen_at(inside, 0.2, 0.15, 0.64), seen_at(inside, 0.2, 0.15, 0.64))
    echo.until(
        lambda state: only(state.primitives).world_from_primitive.translation[0] > 0.1 or None
    )


def test_somebody_at_another_site_is_given_a_shape_and_gives_it_back(inside, echo, hub):
    hub.meet([Elsewhere(Person("north.p1", 0, "Nils", Role.REMOTE), b"")])
    body = draw_shape(inside, echo)
    inside.wait_for("document.getElementById('thing-give').textContent === 'Give to Nils'")
    inside.evaluate("document.getElementById('thing-give').click()")
    echo.until(taken_by("north.p1"))
    inside.wait_for(f"live.handing.shown().join() === '{body.primitive_id},Nils has it'")
    pose = Pose.from_yaw(0.0, (-0.8, -0.5, 0.0))
    moved = drawn_entity(replace(body, world_from_primitive=pose))
    hub.act("north.p1", Do(1, Op.PRIMITIVE, moved))
    hub.act("north.p1", Do(2, Op.GIVE, moved, to="p1"))
    echo.until(taken_by("p1"))
    inside.wait_for("/Nils gave you/.test(document.getElementById('notice').textContent)")
    assert inside.messages == []


def test_a_headsets_wearer_is_given_a_shape_and_whoever_clicks_it_gets_it_back(inside, echo, hub):
    wearer = Person("hololens", 0, "Ana", Role.LOCAL, is_yielding=True)
    hub.meet([Elsewhere(wearer, b"")], way="hololens")
    body = draw_shape(inside, echo)
    key = body.primitive_id
    inside.wait_for("document.getElementById('thing-give').textContent === 'Give to Ana'")
    inside.evaluate("document.getElementById('thing-give').click()")
    echo.until(taken_by("hololens"))
    inside.wait_for(f"live.handing.shown().join() === '{key},Ana has it'")
    if PICTURES:
        inside.rest()
        Image.fromarray(inside.picture()).save(Path(PICTURES) / "given-to-the-wearer.png")

    # The wearer's hand moves it, and has it still: as long as it is moved, and a moment longer.
    pose = Pose.from_yaw(0.0, (-0.8, -0.5, 0.0))
    moved = drawn_entity(replace(body, world_from_primitive=pose))

    def notice_while_it_is_moved():
        hub.act("hololens", Do(1, Op.PRIMITIVE, moved))
        return inside.evaluate("document.getElementById('notice').textContent")

    hub.act("hololens", Do(1, Op.PRIMITIVE, moved))
    ask(inside, f"'give', {{primitive: '{key}', to: live.you()}}")
    until(lambda notice: "Ana is moving it" in notice, notice_while_it_is_moved)
    time.sleep(HOLD_NS / 1e9)
    choose(inside, "carry")
    at = seen_at(inside, -0.8, 0.15, 0.64)
    drag(inside, at, at)
    echo.until(taken_by("p1"))
    inside.wait_for("/yours now/.test(document.getElementById('notice').textContent)")

    # Given to the page by the wearer's hand, it is said so.
    inside.evaluate(f"live.things.give('{key}', 'hololens')")
    echo.until(taken_by("hololens"))
    hub.act("hololens", Do(2, Op.GIVE, moved, to="p1"))
    echo.until(taken_by("p1"))
    inside.wait_for("/Ana gave you/.test(document.getElementById('notice').textContent)")
    assert inside.messages == []
