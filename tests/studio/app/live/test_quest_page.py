"""Headsets that have joined by the page, in the panel."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from devices.hub.attendance import PageHeadset
from devices.hub.protocol.messages import DeviceSaid, Immersion
from devices.hub.roles import Person, Role
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]

ADA = PageHeadset(
    Person("p1", 1, "<b>Ada", Role.REMOTE, latency_ms=12.0),
    DeviceSaid("Quest 3", Immersion.VR, True, 72.0, 80.0, False),
    1.0,
    0.02,
)


@pytest.fixture
def page(qapp):
    from studio.app.live.quest_page import QuestPage

    found = []
    job = SimpleNamespace(running=True, headsets=lambda: tuple(found))
    bench = SimpleNamespace(settings=SimpleNamespace(theme="dark"))
    made = QuestPage(bench, SimpleNamespace(job=job))
    made.show()
    made.found, made.job = found, job
    yield made
    made.close()


def test_without_a_headset_it_says_how_one_joins(page):
    page.refresh()
    assert page.sentence.isVisible()
    assert "Enter VR" in page.sentence.text()
    assert page.blocks == {}


def test_each_headset_has_figures_and_a_sentence(page):
    page.found.append(ADA)
    page.refresh()
    block = page.blocks["p1"]
    assert not page.sentence.isVisible()
    assert block.title.text() == "<b>Ada"
    assert block.title.textFormat().name == "PlainText", "a name is no markup"
    assert block.values["State"].text() == "Quest 3, in VR"
    assert block.values["Battery"].text() == "80 %"
    assert "is in the room" in block.sentence.text()
    page.found[0] = replace(ADA, said=replace(ADA.said, battery_percent=9.0))
    page.refresh()
    assert page.blocks["p1"] is block
    assert block.values["Battery"].text().endswith("9 %")
    assert block.sentence.text().endswith("Charge it, or wear it with a power bank.")
    page.found.append(replace(ADA, person=replace(ADA.person, person_id="p2", name="Ben")))
    page.refresh()
    assert list(page.blocks) == ["p1", "p2"]
    del page.found[0]
    page.refresh()
    assert list(page.blocks) == ["p2"]
    page.job.running = False
    page.refresh()
    assert page.blocks == {}
    assert page.sentence.isVisible()
