"""The page in Chromium and Firefox, on desk and phone: one joins, things move, no error."""

import time

import numpy as np
import pytest

from scenes.pose import Pose
from scenes.state import SceneState, TrackedObject, TrackState, reduce_state
from tests.studio.browser import until
from tests.studio.web.conftest import JOINING, READY

SIZES = {"desk": (1280, 800), "phone": (390, 844)}


@pytest.fixture(params=["chromium", "firefox"])
def anywhere(request, hub):
    """A tab of one browser after the other, that has forgotten earlier visits."""
    page = request.getfixturevalue(request.param)
    page.visit(f"{hub.url}check")
    page.wait_for(READY)
    page.evaluate("(sessionStorage.clear(), localStorage.clear(), 1)")
    page.messages.clear()
    yield page
    page.visit("about:blank")


@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES)
def test_one_joins_sees_things_and_people_move_and_nothing_is_wrong(
    anywhere, hub, invite_guest, size
):
    page, (width, height) = anywhere, size
    page.visit(hub.invite().url, width=width, height=height)
    page.wait_for(JOINING)
    page.evaluate("(document.getElementById('name').value = 'Ada')")
    page.evaluate("document.getElementById('join-button').click() ?? 1")
    page.wait_for(READY)
    page.wait_for("live.isWhole()")
    assert page.evaluate("[innerWidth, innerHeight]") == [width, height]
    assert [person.name for person in hub.people()] == ["Ada"]

    now, state = time.monotonic_ns(), SceneState()
    for x in np.linspace(0.3, 1.0, 8):
        pose = Pose.from_yaw(0.0, (x, 0.2, 0.0))
        track = TrackedObject("box-1", now, pose, np.zeros((4, 4)), 1.0, TrackState.TRACKED, 1.0, 0)
        now += 33_000_000
        state = reduce_state(state, track, now)
        hub.publish(state)
        time.sleep(0.033)
    page.wait_for("Math.abs(live.place('box-1')[0] - 1.0) < 1e-3")

    guest, tools = invite_guest("Grace"), invite_guest.tools
    page.wait_for("live.people.byId.size === 1")
    shown = "[...live.people.byId.values()][0].figure.bodies.some((body) => body.visible)"
    guest.keep(
        room_from_head=tools.facing((-0.4, 1.6, -0.5), 0.5),
        hands=(tools.open_hand((-0.7, 1.2, -0.9), side=-1), None),
    )
    page.wait_for(shown)
    # A room, not a blank page: a floor and walls of their colours, once their splats are sorted.
    picture = until(lambda it: it[height // 3 : 2 * height // 3].std() > 15, page.picture)
    assert picture.shape == (height, width, 3)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.messages == []
