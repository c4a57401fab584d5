"""The live page by finger, by keyboard alone, and for who reads it aloud or sees little of it."""

import time

import numpy as np
import pytest

from tests.studio.web.conftest import JOINING, READY

CONTRASTS = """
(() => {
  const linear = (v) => (v <= 10 ? v / 3294 : ((v / 255 + 0.055) / 1.055) ** 2.4);
  const light = ([r, g, b]) => 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
  const numbers = (text) => text.match(/[\\d.]+/g).map(Number);
  const over = (front, back) => { const a = front[3] ?? 1;
    return [0, 1, 2].map((i) => a * front[i] + (1 - a) * back[i]); };
  const behind = (element) => { const layers = [];
    for (let e = element; e; e = e.parentElement) {
      layers.push(numbers(getComputedStyle(e).backgroundColor));
    }
    // A sheet lies over the picture, which may be as bright as paper.
    return layers.reverse().reduce((back, layer) => over(layer, back), [255, 255, 255]); };
  const found = [];
  for (const e of document.querySelectorAll('body *')) {
    const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!own || !e.checkVisibility() || e.closest('script,style,[aria-hidden]')) continue;
    const [a, b] = [numbers(getComputedStyle(e).color), behind(e)].map(light);
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) found.push([e.tagName, e.id, e.textContent.slice(0, 30), ratio]);
  }
  return found;
})()
"""


def join(page, hub, **size):
    page.visit(hub.invite().url, **size)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    page.wait_for("live.isWhole()")


def unnamed(page):
    """Return the elements that a screen reader can reach and has no name for."""
    nodes = page.call("Accessibility.getFullAXTree")["nodes"]
    wanted = {"button", "radio", "textbox", "link", "combobox", "Canvas", "application"}
    return [
        node
        for node in nodes
        if not node.get("ignored")
        and node["role"]["value"] in wanted
        and not node.get("name", {}).get("value", "").strip()
    ]


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)], ids=["desktop", "phone"])
def test_everything_has_a_name_enough_contrast_and_room(page, hub, size):
    width, height = size
    is_phone = width < 500
    page.visit(f"{hub.url}check", width=width, height=height, is_phone=is_phone)
    page.wait_for(READY)
    assert unnamed(page) == []
    assert page.evaluate(CONTRASTS) == []
    page.visit(hub.url, width=width, height=height, is_phone=is_phone)
    page.wait_for(JOINING)
    assert unnamed(page) == []
    assert page.evaluate(CONTRASTS) == []

    join(page, hub, width=width, height=height, is_phone=is_phone)
    page.evaluate(
        "document.getElementById('tool-draw').click();"
        " document.getElementById('mode-walk').click();"
        " if (document.getElementById('panel').hidden) document.getElementById('side').click()"
    )
    assert unnamed(page) == []
    assert page.evaluate(CONTRASTS) == []
    # The measure itself: a word that is too faint is found.
    page.evaluate("document.getElementById('room-name').style.color = '#666'")
    assert [found[1] for found in page.evaluate(CONTRASTS)] == ["room-name"]
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    small = page.evaluate(
        "[...document.querySelectorAll('button')].filter((b) => b.checkVisibility())"
        ".map((b) => [b.id || b.ariaLabel || b.title, b.getBoundingClientRect()])"
        ".filter(([, r]) => r.height < " + ("44" if is_phone else "24") + " || r.width < 24"
        " || r.right > innerWidth || r.bottom > innerHeight && !r.top > innerHeight)"
        ".map(([name]) => name)"
    )
    inside_list = page.evaluate(
        "[...document.querySelectorAll('aside button')].map((b) => b.title)"
    )
    assert set(small) <= set(inside_list) | {""}
    assert page.messages == []


def test_by_keyboard_alone_one_joins_chooses_a_tool_and_a_way_to_move(page, hub):
    code = hub.invite().code
    page.visit(hub.url, width=640, height=480)
    page.wait_for(JOINING)
    page.call("Input.insertText", text="Ada")
    page.press("Tab", "Tab")
    page.call("Input.insertText", text=code)
    page.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", text="\r")
    page.wait_for(READY)
    assert page.evaluate("document.activeElement.id") == "room"

    page.press("l", "KeyL")
    assert page.evaluate("live.tools.tool") == "draw"
    page.press("Escape", "Escape")
    assert page.evaluate("live.tools.tool") == "look"
    page.evaluate("document.getElementById('mode-orbit').focus()")
    page.press("ArrowRight", "ArrowRight")
    assert page.evaluate("document.activeElement.id") == "mode-walk"
    assert page.evaluate("live.control.mode") == "walk"
    order = page.evaluate(
        "[...document.querySelectorAll('button, canvas')]"
        ".filter((e) => e.checkVisibility() && e.tabIndex >= 0).map((e) => e.id)"
    )
    assert order.index("mode-walk") < order.index("room") < order.index("tool-look")


def test_on_a_phone_a_finger_draws_two_fingers_move_and_buttons_walk(page, hub):
    join(page, hub, width=390, height=600, is_phone=True)
    page.evaluate("document.getElementById('mode-walk').click()")
    page.evaluate(
        "live.control.camera.position.set(-1, -0.8, 1.6); live.control.lookAt("
        "live.room.camera.position.clone().set(0.5, 0.5, 0.2))"
    )
    page.evaluate("document.getElementById('tool-draw').click()")

    def touch(kind, *places):
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
        page.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        time.sleep(0.03)

    touch("touchStart", (150, 300))
    for step in range(1, 5):
        touch("touchMove", (150 + 20 * step, 300))
    touch("touchEnd")
    page.wait_for("live.board.lines().length === 1 && live.board.waiting.size === 0")

    before = page.evaluate("live.eye()")
    touch("touchStart", (150, 300), (200, 300))
    for step in range(1, 6):
        touch("touchMove", (150 - 8 * step, 300), (200 + 8 * step, 300))
    touch("touchEnd")
    page.wait_for(f"Math.hypot(...live.eye().map((v, i) => v - {before}[i])) > 0.2")
    assert page.evaluate("live.eye()[2]") == pytest.approx(1.6)
    assert page.evaluate("live.board.lines().length") == 1

    before = page.evaluate("live.eye()")
    x, y = page.evaluate(
        "(({x, y, width, height}) => [x + width / 2, y + height / 2])"
        "(document.querySelector('#pad [data-key=KeyS]').getBoundingClientRect())"
    )
    touch("touchStart", (x, y))
    time.sleep(0.4)
    touch("touchEnd")
    page.wait_for(f"Math.hypot(...live.eye().map((v, i) => v - {before}[i])) > 0.3")
    gone = np.subtract(page.evaluate("live.eye()"), before)
    assert abs(gone[2]) < 1e-6
    assert page.messages == []
