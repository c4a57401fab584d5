"""The HoloLens in the panel."""

from types import SimpleNamespace

import numpy as np
import pytest

from studio.app.model.runs.live_run import LiveChoice
from studio.console.display import why_no_window
from studio.live.hololens.anchoring import OriginStatus
from studio.live.hololens.worn import WornStatus

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


class Live:
    def __init__(self):
        self.choice, self.is_running = LiveChoice(), False

    def choose(self, choice):
        self.choice = choice


@pytest.fixture
def page(qapp):
    from studio.app.live.headset_page import HeadsetPage

    bench = SimpleNamespace(settings=SimpleNamespace(theme="dark"))
    made = HeadsetPage(bench, Live())
    made.show()
    yield made
    made.close()


def test_an_address_is_asked_for_once_one_is_worn(page):
    assert not page.address.isVisible()
    assert "Nobody" in page.sentence.text()
    page.is_worn.click()
    assert page.address.isVisible()
    assert page._live.choice.wears
    page.address.setText("10.0.0.2")
    page.address.textEdited.emit("10.0.0.2")
    assert page._live.choice.headset == "10.0.0.2"


def test_a_session_shows_view_figures_and_a_sentence(page):
    from devices.hololens.values import HeadsetStatus

    status = SimpleNamespace(headset=WornStatus(HeadsetStatus("10.0.0.2"), OriginStatus()))
    worn = SimpleNamespace(
        anchoring=SimpleNamespace(picture=SimpleNamespace(seq=3)),
        view=lambda: np.full((428, 760, 3), 90, np.uint8),
    )
    page._live.is_running = True
    page.show_session(SimpleNamespace(worn=worn), status)
    assert not page.picture.pixmap().isNull()
    assert "look at one" in page.sentence.text()
    assert "no code" in page.values["Origin"].text()
    page.show_session(SimpleNamespace(worn=None), SimpleNamespace(headset=None))
    assert "Nobody" in page.sentence.text()
