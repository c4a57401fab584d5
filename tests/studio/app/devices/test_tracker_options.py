"""Our tracker's settings in the window: tried beside the session, applied, undone."""

import threading
import time

import pytest

from studio import rehearsal
from studio.app.model.documents.document import Document
from studio.console.display import why_no_window
from studio.session.trackers.settings import is_settings
from tests.studio.session.trackers.test_settings import Adjusted
from tracking.options import TrackerOptions, options_from_text

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def opened(tiny, tmp_path, qapp, monkeypatch):
    """A window with the settings' form, and steps that let the camera go on by a frame."""
    from studio.app.window import dispose, make_window

    frames = threading.Semaphore(0)

    def inputs():
        for message in tiny.inputs():
            frames.acquire(timeout=60)
            yield message

    def open_tiny(plan, **given):
        return tiny.session(plan, methods={"own": Adjusted(tiny)}, inputs=inputs, **given)

    monkeypatch.setattr(rehearsal, "open_session", open_tiny)
    window = make_window(Document("tiny"), rehearse_to=tmp_path / "demo", home=tmp_path / "home")
    window.show()

    def until(condition):
        deadline = time.monotonic() + 120
        while not condition():
            assert time.monotonic() < deadline, window.bench.log.lines()
            qapp.processEvents()
            time.sleep(0.002)

    def go_on(count=1):
        seen = window.run.output
        seq = -1 if seen is None else seen.input.frame.seq
        for k in range(count):
            frames.release()
            until(lambda want=seq + 1 + k: shown_seq(window) == want)

    until(lambda: window.is_filled)
    window.bench.show_scene(tiny.scene)
    yield window, window.content("session").tracker.options, go_on
    frames.release(tiny.frames)
    window.close()
    dispose(window)


def shown_seq(window):
    return -1 if window.run.output is None else window.run.output.input.frame.seq


def settings_in(output):
    return [options_from_text(e.text) for e in output.input.events if is_settings(e)]


def test_settings_are_tried_applied_and_undone_while_the_session_plays(opened):
    window, form, go_on = opened
    bench, run = window.bench, window.run
    assert not form.trying.isEnabled()
    assert bench.do("session.rehearse")
    go_on(2)
    assert form.trying.isEnabled()
    assert not form.apply.isEnabled()
    form.boxes["texture"].click()
    form.trying.click()
    go_on(2)
    assert "Chair 1 5.0 cm, 0.0°" in form.line.text()
    assert "7 ms for this frame instead of 7 ms" in form.line.text()
    assert bench.document.tracker.options == TrackerOptions()

    form.apply.click()
    assert bench.document.tracker.options == TrackerOptions(texture=False)
    assert not form.trying.isChecked()
    window._poll()
    go_on()
    assert settings_in(run.output) == [TrackerOptions(texture=False)]
    assert run.output.trial is None
    assert bench.do("edit.undo")
    assert form.boxes["texture"].isChecked()
    window._poll()
    go_on()
    assert settings_in(run.output) == [TrackerOptions()]
    said = [line.text for line in bench.log.lines() if "the tracker goes on" in line.text]
    assert len(said) == 2


def test_a_wrong_value_is_refused_in_words_and_reset_shows_what_holds(opened):
    window, form, _ = opened
    bench = window.bench
    assert not bench.do("tracker.set", search_ms=0)
    assert "wanted 1 to 1000 ms" in bench.log.lines("error")[-1].text
    assert not bench.do("tracker.set", texture="no")
    assert "wanted true or false" in bench.log.lines("error")[-1].text
    assert not bench.do("tracker.try", texture=False)
    form.search_ms.setValue(200)
    assert form.apply.isEnabled()
    form.reset.click()
    assert form.search_ms.value() == TrackerOptions().search_ms
    assert not form.apply.isEnabled()
    assert bench.do("tracker.set", search_ms=200)
    assert form.search_ms.value() == 200
