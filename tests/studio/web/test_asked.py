"""A study's questions on the live page in a real browser: consent, a questionnaire, the task."""

from __future__ import annotations

import os
from collections import ChainMap
from pathlib import Path

import pytest
from PIL import Image

from devices.clock import WallClock
from devices.hub.contract import HubSettings
from devices.hub.server import Hub
from studio.study.asking import NOW, Asking, Step, StepKind
from studio.study.questionnaires import ABOUT, PAPER_PRESENCE, TLX
from studio.web.live_page import live_page

JOINING = "document.documentElement?.dataset.state === 'join'"
SHOWN = "document.querySelector('#asked h1')?.textContent === '{}'"
PICTURES = os.environ.get("NEXUS_TEST_PICTURES")
"""Folder for pictures of the page, to be looked at."""


@pytest.fixture
def asked():
    """Steps of a participant; what they answer is in `given`."""
    given = []
    steps = (
        Step(StepKind.CONSENT, "A study", ("You take part of your own will.",), "I agree"),
        Step(StepKind.FORM, PAPER_PRESENCE.title, (PAPER_PRESENCE.lead,), "Send", PAPER_PRESENCE),
        Step(StepKind.FORM, TLX.title, (TLX.lead,), "Send", TLX),
        Step(StepKind.FORM, ABOUT.title, (ABOUT.lead,), "Send", ABOUT),
        Step(StepKind.READY, "Set up the room", ("For four people.",), "Begin"),
        Step(StepKind.TASK, "Set up the room", ("For four people.",), "I am satisfied"),
        Step(StepKind.THANKS, "Thank you", ("That was all.",)),
    )
    asking = Asking(steps, lambda step, answers: given.append((step.kind, dict(answers))))
    asking.given = given
    return asking


@pytest.fixture
def hub(box_room, modules, tmp_path, asked):
    page = live_page(box_room, tmp_path, modules=modules, asks=NOW)
    hub = Hub(HubSettings(), ChainMap(asked.assets, page), clock=WallClock())
    hub.start()
    yield hub
    hub.close()


def picture(page, name):
    if PICTURES:
        Image.fromarray(page.picture()).save(Path(PICTURES) / f"{name}.png")


def press(page):
    page.evaluate("document.querySelector('#asked button.main').click()")


def test_a_participant_answers_on_the_page(page, hub, asked):
    page.visit(hub.invite().url, width=1000, height=760)
    page.wait_for(JOINING)
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(SHOWN.format("A study"))
    picture(page, "consent")
    press(page)

    page.wait_for(SHOWN.format("Presence"))
    press(page)
    why = "document.querySelector('#asked .why').textContent"
    page.wait_for(f"{why} === '6 not answered yet; they are marked.'")
    for k in range(1, 7):
        page.evaluate(
            f"document.querySelector('[name=asked-PQ{k}][value=\"{min(k, 5)}\"]').click()"
        )
    picture(page, "presence")
    press(page)

    page.wait_for(SHOWN.format(TLX.title))
    page.evaluate(
        "document.querySelectorAll('#asked [type=range]').forEach((slider, i) => {"
        "slider.value = 10 * i; slider.dispatchEvent(new Event('input')); })"
    )
    picture(page, "tlx")
    press(page)

    page.wait_for(SHOWN.format("About you"))
    page.evaluate("document.querySelector('[name=asked-age]').value = 'old'")
    press(page)
    page.wait_for(f"{why}.includes('wanted a whole number')")
    page.evaluate("document.querySelector('[name=asked-age]').value = '31'")
    # A key that is typed into a field chooses no tool.
    page.evaluate(
        "document.querySelector('[name=asked-gender]').dispatchEvent("
        "new KeyboardEvent('keydown', { code: 'KeyL', bubbles: true }))"
    )
    assert page.evaluate("live.tools.tool") == "look"
    press(page)

    page.wait_for(SHOWN.format("Set up the room"))
    press(page)
    page.wait_for("document.getElementById('asked').className === 'task'")
    picture(page, "task")
    assert asked.step.kind is StepKind.TASK
    asked.end_task()
    page.wait_for(SHOWN.format("Thank you"))

    kinds = [kind for kind, _ in asked.given]
    assert kinds == [StepKind.CONSENT, *[StepKind.FORM] * 3, StepKind.READY]
    assert asked.given[1][1] == {f"PQ{k}": str(min(k, 5)) for k in range(1, 7)}
    assert list(asked.given[2][1].values()) == ["0", "10", "20", "30", "40", "50"]
    assert asked.given[3][1]["age"] == "31"
    assert not [m for m in page.messages if "error" in str(m).lower()]
