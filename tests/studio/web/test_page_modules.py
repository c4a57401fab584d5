"""Modules of the page that draw nothing, in the browser: bodies, moments, the self-test."""

import json

import numpy as np
import pytest

from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.protocol.wire import Body, decode_body, encode_body, pack_bodies
from devices.hub.server import Hub

READY = "document.documentElement?.dataset.state === 'ready'"


@pytest.fixture(scope="module")
def hub(assets):
    """One for all of this file: nobody changes anything."""
    hub = Hub(HubSettings(), assets, clock=WallClock())
    hub.start()
    yield hub
    hub.close()


@pytest.fixture
def checked(page, hub):
    """The self-test, from which modules can be imported by their addresses."""
    page.visit(f"{hub.url}check", width=800, height=900)
    page.wait_for(READY)
    return page


@pytest.fixture
def imports(assets):
    """A function that gives the script that imports a module of the page."""

    def script(name):
        address = next(path for path in assets if path.startswith(f"/assets/live/{name}-"))
        return f"(await import('{address}'))"

    return script


@pytest.fixture
def whole_body(invite_guest):
    """A body with everything in it."""
    tools = invite_guest.tools
    return Body(
        seq=4_000_000_000,
        t_us=1_234_567_890_123,
        room_from_head=tools.facing((0.3, 1.6, -0.8), 0.5),
        controllers=(
            tools.controller((-1.0, 1.0, 0.5), 0.2),
            tools.controller((1, 1.25, 0.5), -2.0),
        ),
        hands=(
            tools.open_hand((-0.2, 1.1, 0.3), side=-1),
            tools.open_hand((0.2, 1.1, 0.3), side=1),
        ),
        ray=np.array([[0.1, 1.2, 0.3], [-2.0, 0.0, 1.5]]),
    )


def run(page, body):
    return page.evaluate(f"(async () => {{ {body} }})()")


@pytest.mark.parametrize("kept", ["all", "head", "hands", "nothing"])
def test_a_body_of_the_page_is_the_same_for_the_hub(checked, imports, whole_body, kept):
    whole = whole_body
    parts = {"seq": whole.seq, "t_us": whole.t_us, "room_from_head": None}
    if kept in ("all", "head"):
        parts["room_from_head"] = whole.room_from_head
    if kept in ("all", "hands"):
        parts["hands"] = whole.hands if kept == "all" else (None, whole.hands[1])
    if kept == "all":
        parts |= {"controllers": whole.controllers, "ray": whole.ray}
    data = encode_body(Body(**parts))

    back = run(
        checked,
        f"const w = {imports('wire')}; const bytes = new Uint8Array({list(data)});"
        "return [...w.encodeBody(w.decodeBody(bytes))];",
    )

    body, again = decode_body(bytes(back)), decode_body(data)
    assert len(back) == len(data)
    assert (body.seq, body.t_us) == (whole.seq, whole.t_us)
    for one, other in zip(body.hands, again.hands, strict=True):
        assert (one is None) == (other is None)
        if one is not None:
            np.testing.assert_allclose(one.joints, other.joints, atol=1.1e-3)
            np.testing.assert_array_equal(one.radii_m, other.radii_m)
    if kept == "all":
        np.testing.assert_array_equal(body.ray, again.ray)
        np.testing.assert_array_equal(
            body.controllers[1].room_from_aim.matrix(), again.controllers[1].room_from_aim.matrix()
        )


def test_bodies_of_others_are_read_and_rubbish_is_none(checked, imports, whole_body):
    data = encode_body(whole_body)
    packed = pack_bodies([(7, data), (9, encode_body(Body(1, 2, whole_body.room_from_head)))])
    found = run(
        checked,
        f"const w = {imports('wire')}; const all = new Uint8Array({list(packed)});"
        "const read = (n) => w.decodeBodies(all.slice(0, n).buffer)"
        ".map(([i, b]) => [i, b.seq, b.head]);"
        "const cut = []; for (let n = 0; n < all.length; n++) cut.push(read(n).length);"
        "return [read(all.length), Math.max(...cut), w.decodeBody(new Uint8Array(40))];",
    )

    (first, second), most, rubbish = found
    assert first[:2] == [7, whole_body.seq]
    assert second[2][:3] == pytest.approx(whole_body.room_from_head.translation, abs=1e-6)
    assert most == 1
    assert rubbish is None


def test_what_moves_is_shown_two_moments_late_and_what_rests_does_not_slide(checked, imports):
    shown = run(
        checked,
        f"const {{ Pacer, Timeline }} = {imports('timeline')};"
        "const pacer = new Pacer(), line = new Timeline(pacer);"
        "const at = (now) => { const f = line.at(now); return f && f[0] + f[2] * (f[1] - f[0]); };"
        # The sender's clock is 5 s behind; every 30 ms it moves by 1.
        "for (let i = 0; i < 60; i++) { pacer.note(30 * i, 5010 + 30 * i); line.push(30 * i, i); }"
        "const lag = 59 - at(5010 + 30 * 59); const held = at(9999);"
        # It rests for a second, then moves on: nothing of that second slides.
        "pacer.note(2800, 7810); line.push(2800, 70);"
        "return [lag, held, at(7800), line.at(7810 + 200)[0], line.isMoving(7810),"
        " line.isMoving(8100)];",
    )

    lag, held, resting, after, *moving = shown
    assert lag == pytest.approx(2.0, abs=0.1)
    assert held == 59
    assert resting == 59
    assert after == 70
    assert moving == [True, False]


def test_the_self_test_says_what_blocks_and_what_to_do(checked, hub):
    assert checked.evaluate("document.getElementById('verdict').textContent") == (
        "Nothing stands in the way of joining."
    )
    rows = json.loads(
        checked.evaluate(
            "JSON.stringify([...document.querySelectorAll('#checks li')].map((row) =>"
            " [row.querySelector('h2').textContent, row.className,"
            " row.querySelector('.remedy').textContent]))"
        )
    )
    found = {name: (kind, remedy) for name, kind, remedy in rows}
    assert found["Connection (WebSocket)"] == ("fine", "")
    assert found["VR headset (WebXR)"][0] == "without"
    assert "Quest" in found["VR headset (WebXR)"][1]
    assert checked.messages == []

    blocked = checked.call(
        "Page.addScriptToEvaluateOnNewDocument",
        source="HTMLCanvasElement.prototype.getContext = () => null;"
        " window.WebSocket = class { constructor() { this.l = {};"
        " setTimeout(() => this.l.error?.({}), 10); }"
        " addEventListener(kind, f) { this.l[kind] = f; } close() {} };",
    )
    checked.reload()
    checked.wait_for("/stand in the way/.test(document.getElementById('verdict')?.textContent)")
    assert checked.evaluate("document.querySelectorAll('#checks .blocked').length") == 2
    assert "acceleration" in checked.evaluate("document.getElementById('checks').textContent")
    # The page itself says so, too, before anybody types a code.
    checked.visit(hub.url)
    checked.wait_for("/3D graphics/.test(document.getElementById('join-state')?.textContent)")
    assert checked.evaluate("document.getElementById('join-button').disabled")
    checked.call("Page.removeScriptToEvaluateOnNewDocument", identifier=blocked["identifier"])
