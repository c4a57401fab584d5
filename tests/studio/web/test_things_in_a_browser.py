"""Shapes, carried pictures and proposals in a real browser against the real hub."""

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from devices.hub.roles import Role
from scenes.state import LiveSurface, lines_now
from tests.studio.web.conftest import JOINING, READY, choose, drag, only, seen_at

PICTURES = os.environ.get("NEXUS_TEST_PICTURES")
"""Folder for pictures of the page, to be looked at."""

WALL = [[-1.0, 1.8, -1.5], [0.0, 1.8, -1.5], [0.0, 1.0, -1.5], [-1.0, 1.0, -1.5]]


def test_a_shape_is_put_carried_turned_sized_and_taken_back(inside, echo):
    choose(inside, "shape")
    at = seen_at(inside, -0.8, 0, 0.5)
    drag(inside, at, at)
    body = echo.until(lambda state: only(state.primitives))
    assert body.shape == "box"
    assert body.user_id == "p1"
    np.testing.assert_allclose(body.world_from_primitive.translation, [-0.8, -0.5, 0.0], atol=0.06)

    choose(inside, "carry")
    inside.wait_for("live.things.of('primitive').length === 1")
    start, middle, end = (seen_at(inside, x, 0.05, 0.62) for x in (-0.8, -0.2, 0.4))
    drag(inside, start, start, middle, end, end)

    def carried(state):
        found = only(state.primitives)
        return found if found and found.world_from_primitive.translation[0] > 0.3 else None

    there = echo.until(carried)
    np.testing.assert_allclose(there.world_from_primitive.translation[2], 0.0, atol=0.03)
    inside.evaluate("document.getElementById('thing-left').click()")
    inside.evaluate("document.getElementById('thing-larger').click()")
    larger = echo.until(
        lambda state: b if (b := only(state.primitives)) and b.size_m[0] > 0.33 else None
    )
    turn = larger.world_from_primitive.yaw() - there.world_from_primitive.yaw()
    assert turn == pytest.approx(np.pi / 12, abs=1e-3)

    # One undo each: the size, the turn, the whole drag, the shape.
    for wanted in (
        lambda b: b.size_m[0] == pytest.approx(0.3),
        lambda b: b.world_from_primitive.yaw() == pytest.approx(there.world_from_primitive.yaw()),
        lambda b: b.world_from_primitive.translation[0] == pytest.approx(-0.8, abs=0.06),
    ):
        inside.evaluate("document.getElementById('undo').click()")
        echo.until(lambda state, wanted=wanted: wanted(only(state.primitives)))
    inside.evaluate("document.getElementById('undo').click()")
    echo.until(lambda state: not state.primitives)
    inside.wait_for("live.bodies.meshes.size === 0")
    assert inside.messages == []


def test_an_arrow_goes_from_where_one_presses_to_where_one_lets_go(inside, echo):
    choose(inside, "shape")
    inside.evaluate("document.getElementById('shape-arrow').click()")
    places = [seen_at(inside, x, 0, 0.6) for x in (-1.0, -0.6, -0.2, -0.2)]
    drag(inside, *places)
    arrow = echo.until(
        lambda state: b if (b := only(state.primitives)) and b.size_m[0] > 0.7 else None
    )
    tip = arrow.world_from_primitive @ np.array([0.5 * arrow.size_m[0], 0, 0])
    np.testing.assert_allclose(tip, [-0.2, -0.6, 0.0], atol=0.08)


def test_a_proposal_turns_green_when_the_object_stands_there(inside, echo, hub):
    choose(inside, "propose")
    inside.wait_for("live.room.objects.get('box-1').pose !== undefined")
    start = seen_at(inside, 0.3, 0.2, 0.0)
    places = [seen_at(inside, x, 0.2, 0.0) for x in (0.3, 0.0, -0.5, -1.0, -1.0)]
    drag(inside, start, *places)

    def away(state):
        found = only(state.proposals)
        return found if found and found.world_from_object.translation[0] < -0.7 else None

    copy = echo.until(away)
    assert (copy.object_id, copy.user_name) == ("box-1", "Ada")
    assert copy.world_from_object.translation[2] == pytest.approx(0.0, abs=0.02)
    key = copy.proposal_id
    said = "[...document.querySelectorAll('#labels span')].map((it) => it.textContent).join()"
    inside.wait_for(f"/you: Box 1/.test({said})")
    assert not inside.evaluate(f"live.proposals.isMet('{key}')")
    x, y, _ = copy.world_from_object.translation
    echo.place(x + 0.03, y, yaw=0.1)
    inside.wait_for(f"live.proposals.isMet('{key}')")
    assert copy.is_met(echo.state.objects["box-1"].world_from_object)
    echo.place(x + 0.03, y, yaw=0.4)
    inside.wait_for(f"!live.proposals.isMet('{key}')")

    inside.evaluate("document.getElementById('thing-remove').click()")
    echo.until(lambda state: not state.proposals)
    inside.wait_for("live.proposals.copies.size === 0")
    assert inside.messages == []


def test_a_live_picture_is_carried_away_and_put_back(inside, echo):
    inside.evaluate(f"live.board.mark({WALL})")
    surface = echo.until(lambda state: only(state.surfaces))
    inside.wait_for("live.things.of('surface').length === 1")
    choose(inside, "carry")
    places = [seen_at(inside, x, 1.4, -1.5) for x in (-0.5, -0.5, -0.2, 0.3, 0.3)]
    drag(inside, *places)

    def carried(state):  # all the way: it is sent while it is on it, too
        found = only(state.surfaces)
        if found is None or found.carried_to is None:
            return None
        way = found.carried_to[0, 0] - found.corners_in_world[0, 0]
        return found if way == pytest.approx(0.8, abs=0.1) else None

    away = echo.until(carried)
    np.testing.assert_array_equal(away.corners_in_world, surface.corners_in_world)
    moved = away.carried_to - away.corners_in_world
    np.testing.assert_allclose(moved, np.tile(moved[0], (4, 1)), atol=1e-3)
    inside.evaluate("document.getElementById('thing-back').click()")
    echo.until(lambda state: only(state.surfaces).carried_to is None)
    assert inside.evaluate("document.getElementById('thing-back').disabled")


def test_what_is_anothers_stays_where_it_is(inside, echo, invite_guest):
    guest = invite_guest("Grace")
    pose = [-0.8, 0, 0.5, 0, 0, 0, 1]
    guest.do(op="primitive", primitive="b", shape="box", size=[0.3] * 3, pose=pose)
    echo.until(lambda state: only(state.primitives))
    inside.wait_for("live.things.of('primitive').length === 1")
    choose(inside, "carry")
    start = seen_at(inside, -0.8, 0.15, 0.64)
    drag(inside, start, start, seen_at(inside, 0.2, 0.15, 0.64), seen_at(inside, 0.2, 0.15, 0.64))
    assert "only they" in inside.evaluate("document.getElementById('notice').textContent")
    inside.evaluate(
        "live.things.change('primitive', 'p2/b', {...live.things.get('primitive',"
        "'p2/b'), pose: [1, 0, 0, 0, 0, 0, 1]}, 1)"
    )
    inside.wait_for("live.things.get('primitive', 'p2/b').pose[0] === -0.8")
    assert only(echo.state.primitives).world_from_primitive.translation[0] == pytest.approx(-0.8)


def test_who_has_not_the_pen_has_no_tools(inside, hub, invite_guest):
    guest = invite_guest("Grace")
    assert guest is not None
    inside.wait_for("live.people.byId.size === 1")
    hub.give_pen("p2")
    inside.wait_for("document.getElementById('tool-shape').hidden")
    assert inside.evaluate("document.getElementById('undo').hidden")
    said = "[...document.querySelectorAll('#people .state')].map((it) => it.textContent).join('; ')"
    inside.wait_for(f"{said} === 'you, elsewhere; elsewhere, has the pen'")  # another message
    hub.give_pen(None)
    inside.wait_for("!document.getElementById('tool-shape').hidden")
    hub.set_role("p1", Role.SPECTATOR)
    inside.wait_for("document.getElementById('tool-carry').hidden")


def test_what_was_there_before_is_shown(page, hub, echo, invite_guest):
    guest = invite_guest("Grace")
    guest.do(
        op="primitive", primitive="b", shape="sphere", size=[0.3] * 3, pose=[0, 0, 0, 0, 0, 0, 1]
    )
    guest.do(op="propose", proposal="c", object="box-1", pose=[-1, 0, 0, 0, 0, 0, 1])
    guest.do(op="surface", surface="s", corners=WALL, seen=[[x + 1, y, z] for x, y, z in WALL])
    echo.until(lambda state: state.surfaces and state.proposals and state.primitives)
    assert isinstance(only(echo.state.surfaces), LiveSurface)
    page.visit(hub.invite().url, width=400, height=300)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    assert page.evaluate("live.bodies.meshes.size") == 1
    assert page.evaluate("live.proposals.copies.size") == 1
    assert page.evaluate("live.things.of('surface')[0][1].seen[0][0]") == 0
    drawn = page.evaluate("[...live.board.drawn.keys()].sort()")
    assert drawn == ["filmed:p1/s", "surface:p1/s"]
    # Nobody has clicked anything here, so that the browser lets no sound begin.
    assert [words for words in page.messages if "AudioContext" not in words] == []


def test_a_line_on_an_object_goes_along_and_who_points_has_a_ring(inside, echo, invite_guest):
    inside.wait_for("live.room.objects.get('box-1').pose !== undefined")
    choose(inside, "draw")
    inside.evaluate("document.querySelectorAll('#inks button')[1].click()")
    places = [seen_at(inside, x, 0.3, 0.0) for x in (0.2, 0.25, 0.3, 0.4, 0.4)]
    drag(inside, places[0], *places)
    line = echo.until(lambda state: only(state.annotations))
    assert line.object_id == "box-1"
    before = line.points_in_world.mean(axis=0)
    echo.place(-0.6, 0.2, yaw=0.5)
    inside.wait_for("Math.abs(live.place('box-1')[0] + 0.6) < 1e-3")
    (now,) = lines_now(echo.state)
    assert now.points_in_world.mean(axis=0)[0] < before[0] - 0.7
    group = "[...live.board.drawn.values()][0].group"
    inside.wait_for(f"{group}.position.length() > 0.5")
    # Of the page and of the session, the line's first place is the same one.
    x, y, z = line.points_in_world[0]
    seen = inside.evaluate(
        "((group) => { group.updateWorldMatrix(true, false);"
        f"return group.localToWorld(group.position.clone().set({x}, {z}, {-y})).toArray();"
        f"}})({group})"
    )
    np.testing.assert_allclose(seen, now.points_in_world[0], atol=0.02)

    guest = invite_guest("Grace")
    tools = invite_guest.tools
    head = tools.facing((0.0, 1.6, 1.0), 0.0)
    guest.keep(room_from_head=head, ray=np.array([[0.0, 1.4, 1.0], [-0.6, 0.2, -0.2]]))
    inside.wait_for("live.attention.shown().join() === 'p2,box-1'")
    if PICTURES:
        inside.pass_frames()
        Image.fromarray(inside.picture()).save(Path(PICTURES) / "attention.png")
    guest.keep(room_from_head=head)
    inside.wait_for("live.attention.shown().length === 0")
    assert inside.messages == []
