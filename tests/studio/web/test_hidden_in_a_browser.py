"""Surfaces that a headset alone sees, on the page: they hide what is behind, and rays end there."""

import base64
import os
from pathlib import Path

import numpy as np
import pytest

from devices.hub.protocol.mesh import MeshChannel
from scenes.mesh import CollisionMesh
from tests.studio.browser import until
from tests.studio.web.conftest import JOINING, READY, join_as_ada

PICTURES = os.environ.get("NEXUS_TEST_PICTURES")
"""Folder for pictures of the page, to be looked at."""

NOTHING = CollisionMesh(np.zeros((0, 3)), np.zeros((0, 3)))


def board(y, *, low=-0.6, high=0.6):
    """An upright square across the room, from 0.2 to 1.4 m, in cells as a hub takes it."""
    corners = np.array([[low, y, 0.2], [high, y, 0.2], [high, y, 1.4], [low, y, 1.4]])
    return {(0, 0, 0): CollisionMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))}


@pytest.fixture
def joined(page, hub):
    join_as_ada(page, hub, width=400, height=300)
    page.evaluate(
        "live.control.camera.position.set(0, -1.4, 0.8);"
        "live.control.lookAt(live.room.camera.position.clone().set(0, 1.4, 0.8))"
    )
    # A ball before the back wall, as somebody may have put it there.
    page.evaluate(
        "live.bodies.show('ball', { shape: 'sphere', size: [0.5, 0.5, 0.5], colour: [0.1, 0.3, 1],"
        " pose: [0, 0.55, -0.9, 0, 0, 0, 1] })"
    )
    return page


def seen_of(page):
    """Percent of the room's picture that is blue as the ball, and the mean colour in its middle.

    A share, not pixels: the page draws fewer of them on a slow machine.
    """
    return page.evaluate(
        "(() => { live.room.render(); const { canvas } = live.tools; "
        "const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d');"
        "copy.drawImage(canvas, 0, 0); const { width, height } = canvas;"
        "const { data } = copy.getImageData(0, 0, width, height); let blue = 0;"
        "for (let i = 0; i < data.length; i += 4) {"
        " if (data[i + 2] > 90 && data[i + 2] > 2 * data[i]) blue += 100 / (width * height); }"
        "const far = Math.round(0.03 * height); const n = (2 * far + 1) ** 2;"
        "const middle = [0, 0, 0];"
        "for (let y = -far; y <= far; y++) for (let x = -far; x <= far; x++) {"
        " const at = 4 * (Math.round(height / 2 + y) * width + Math.round(width / 2 + x));"
        " for (let k = 0; k < 3; k++) middle[k] += data[at + k] / n; }"
        "return [blue, middle]; })()"
    )


def ray_end(page):
    """Place (y up) where a ray of the eye, straight ahead, ends."""
    return page.evaluate("live.tools.pick(innerWidth / 2, innerHeight / 2)")


def test_it_hides_what_is_behind_it_and_nothing_of_the_room(joined, hub):
    page = joined
    page.wait_for("live.bodies.meshes.size === 1")
    page.rest()
    seen, ball = seen_of(page)
    assert seen > 0.5
    # Without any, nothing is drawn for it.
    assert page.evaluate("live.room.hidden.parts.map((part) => part.visible)") == [False] * 4
    # The wall behind: splats of the room, with the ball taken away.
    page.evaluate("live.bodies.show('ball', null)")
    page.rest()
    wall = seen_of(page)[1]
    assert min(wall) > 100
    assert np.abs(np.subtract(wall, ball)).max() > 40
    page.evaluate(
        "live.bodies.show('ball', { shape: 'sphere', size: [0.5, 0.5, 0.5], colour: [0.1, 0.3, 1],"
        " pose: [0, 0.55, -0.9, 0, 0, 0, 1] })"
    )

    hub.hide_behind(board(0.3))
    page.wait_for("live.room.hidden.cells.size === 1 && live.room.hidden.parts[0].visible")
    page.rest()
    blue, middle = seen_of(page)
    assert blue < 0.02 * seen
    assert np.abs(np.subtract(middle, wall)).max() < 4, "the wall is seen, not a hole"

    # What stands before it is seen.
    hub.hide_behind({(0, 0, 0): NOTHING, **{(0, 0, 1): board(1.3)[0, 0, 0]}})
    page.wait_for("live.room.hidden.cells.has('0 0 1') && !live.room.hidden.cells.has('0 0 0')")
    page.wait_for("!live.room.hidden.isOld")  # the cells have come; the next picture has them
    assert seen_of(page)[0] > 0.9 * seen
    assert page.messages == []


def test_rays_end_on_it(joined, hub):
    page = joined
    page.evaluate("live.bodies.show('ball', null)")
    assert ray_end(page)[2] < -1.3
    hub.hide_behind(board(0.3))
    page.wait_for("live.room.hidden.cells.size === 1")
    assert ray_end(page)[2] == pytest.approx(-0.29, abs=0.02)
    hub.hide_behind({(0, 0, 0): NOTHING})
    page.wait_for("live.room.hidden.cells.size === 0")
    assert ray_end(page)[2] < -1.3
    page.wait_for("!live.room.hidden.parts[0].visible")


def test_who_comes_later_or_again_gets_all_that_is_there(page, hub):
    hub.hide_behind(board(0.3))
    hub.hide_behind({(0, 0, 1): NOTHING, (0, 1, 0): board(0.5)[0, 0, 0]})
    page.visit(hub.invite().url, width=400, height=300)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    page.wait_for("live.room.hidden.cells.size === 2")
    page.evaluate("live.room.hidden.cells.clear(); live.link.socket.close()")
    page.wait_for("live.link.isOpen")
    page.wait_for("live.room.hidden.cells.size === 2 && !live.room.hidden.isOld")


def test_a_damaged_message_changes_nothing(joined):
    page = joined
    channel = MeshChannel()
    channel.take(board(0.3))
    _, whole = channel.next_after(0)
    far, wrong = bytearray(whole), bytearray(whole)
    far[14:18] = np.float32(1e9).tobytes()
    wrong[-2:] = (77).to_bytes(2, "little")
    for data in (whole[:-1], whole + b"\0", bytes(far), bytes(wrong), whole[:4]):
        text = base64.b64encode(data).decode()
        page.evaluate(
            f"live.room.hidden.take(Uint8Array.from(atob('{text}'), (c) => c.charCodeAt(0)).buffer)"
        )
    assert page.evaluate("[live.room.hidden.damaged, live.room.hidden.cells.size]") == [5, 0]
    assert page.messages == []


def share_of(page, colour, before="", *, above=1.0):
    """Percent of the picture's upper part whose red, green and blue are so, drawn this moment.

    Args:
        page: the page.
        colour: a condition on r, g and b.
        before: done just before it is drawn, so that no other picture comes between.
        above: share of the height that counts, from the top.
    """
    return page.evaluate(
        f"(() => {{ {before}; live.room.render(); const {{ canvas }} = live.tools;"
        "const { width, height } = canvas;"
        "const copy = new OffscreenCanvas(width, height).getContext('2d');"
        f"copy.drawImage(canvas, 0, 0); const rows = Math.round({above} * height);"
        "const { data } = copy.getImageData(0, 0, width, rows); let found = 0;"
        "for (let i = 0; i < data.length; i += 4) {"
        f" const [r, g, b] = data.subarray(i, i + 3); if ({colour}) found += 100; }}"
        "return found / (width * rows); })()"
    )


def save_room(page, name):
    """Write the room's picture, without what is written over it."""
    url = page.evaluate("(live.room.render(), live.tools.canvas.toDataURL())")
    (Path(PICTURES) / name).write_bytes(base64.b64decode(url.partition(",")[2]))


def copy_seen(page):
    """Percent of the picture's upper half, where the wall is, in the colour of the box's copy."""
    return share_of(page, "r > 90 && r > 1.25 * b", above=0.5)


def put_copy(page):
    page.evaluate("live.bodies.show('ball', null)")
    until(lambda share: share < 0.05, lambda: copy_seen(page))
    page.evaluate(
        "live.proposals.show('p', { by: 'p9', name: 'Grace', object: 'box-1',"
        " pose: [0, 0.85, -0.9, 0, 0, 0, 1] })"
    )
    page.rest()
    return copy_seen(page)


def test_a_copy_of_an_object_is_hidden_behind_it_and_seen_before_it(joined, hub):
    page = joined
    page.rest()
    seen = put_copy(page)
    assert seen > 0.5
    if PICTURES:
        save_room(page, "copy-seen.png")
    hub.hide_behind(board(0.3))
    page.wait_for("live.room.hidden.cells.size === 1 && live.room.hidden.parts[0].visible")
    until(lambda share: share < 0.05 * seen, lambda: copy_seen(page))
    if PICTURES:
        save_room(page, "copy-hidden.png")
    # Half of it is seen beside a smaller board.
    hub.hide_behind({(0, 0, 0): board(0.3, low=-0.6, high=0.0)[0, 0, 0]})
    until(lambda share: 0.25 * seen < share < 0.75 * seen, lambda: copy_seen(page))
    # What stands before the surface is seen, and all of it once there is none.
    hub.hide_behind({(0, 0, 0): board(1.3)[0, 0, 0]})
    until(lambda share: share > 0.9 * seen, lambda: copy_seen(page))
    hub.hide_behind(board(0.3))
    until(lambda share: share < 0.05 * seen, lambda: copy_seen(page))
    # From behind the board it is before it.
    page.evaluate("live.control.camera.position.set(0, 0.35, 0.8)")
    until(lambda share: share > seen, lambda: copy_seen(page))
    page.evaluate("live.control.camera.position.set(0, -1.4, 0.8)")
    until(lambda share: share < 0.05 * seen, lambda: copy_seen(page))
    hub.hide_behind({(0, 0, 0): NOTHING})
    until(lambda share: share > 0.9 * seen, lambda: copy_seen(page))
    assert page.messages == []


POINTING = (
    "live.attention.step({ byId: new Map([['p9', { person: { index: 2 },"
    " figure: { group: { visible: true } }, shown: { ray: [0, 1.4, 1, 0.3, 0.2, -0.2] } }]]) },"
    " 'me')"
)
"""Somebody points at the box, for one picture: the next one has those who are here."""


def test_a_ring_of_light_is_hidden_behind_it_and_seen_before_it(joined, hub):
    page = joined
    page.evaluate("live.bodies.show('ball', null)")
    page.wait_for("live.room.objects.get('box-1').placed")
    page.rest()

    def ring(before=POINTING):
        return share_of(page, "g > 90 && g > 1.5 * r", before)

    assert ring("") < 0.01
    seen = ring()
    assert seen > 0.1
    hub.hide_behind(board(-0.7))
    page.wait_for("live.room.hidden.cells.size === 1 && live.room.hidden.parts[0].visible")
    assert ring() < 0.02 * seen
    hub.hide_behind({(0, 0, 0): board(1.3)[0, 0, 0]})
    page.wait_for("live.room.hidden.version > 1 && !live.room.hidden.isOld")
    assert ring() > 0.9 * seen
    assert page.messages == []
