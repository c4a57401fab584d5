"""Filming as its user does it: by action, with a bar, and by script without a display."""

import os
import subprocess
import sys

import av
import pytest

from studio.app.model.documents.document import Document
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.fixture
def window(qapp, tmp_path, until):
    from studio.app.window import dispose, make_window

    made = make_window(Document("desk"), rehearse_to=tmp_path / "out", home=tmp_path / "home")
    made.bench.set(has_started=True)
    made.show()
    made.run.open_scene("desk")
    until(lambda: made.is_filled and made.bench.scene is not None and not made.run.is_busy)
    until(lambda: made.view.active.painted is not None)
    yield made
    made.close()
    dispose(made)


def films_of(window):
    from studio.app.film.view_films import ViewFilms

    return window.view.findChild(ViewFilms)


def length_s(path):
    with av.open(str(path)) as container:
        return float(container.duration) / av.time_base


def test_a_view_is_filmed_until_it_is_ended_by_the_button(window, until, tmp_path):
    path, bench = tmp_path / "film.mp4", window.bench
    films = films_of(window)
    assert not films.isVisible()
    assert bench.do("view.film", path=str(path), width=320, height=180, fps=5)
    assert films.isVisible()
    assert not bench.do("view.film", path=str(path))
    until(lambda: films._ticks >= 5)
    bench.do("view.orbit", yaw_deg=20)
    until(lambda: films._ticks >= 8)
    assert "filming the view, 320 × 180" in films.words.text()
    films.end_button.click()
    until(lambda: not films.is_filming)
    assert not films.isVisible()
    assert path.is_file()
    assert 0.9 < length_s(path) < 4.0
    assert f"saved {path}" in bench.log.lines()[-1].text


def test_each_of_four_views_and_a_small_picture_is_filmed(window, until, tmp_path):
    bench = window.bench
    bench.do("view.four")
    film_choices = {c.title: c.values for c in bench.actions.get("view.film").choices()}
    assert {"View 1", "View 4", "360° camera", bench.scene.objects[0].name} <= set(film_choices)
    for name in ("View 4", bench.scene.objects[0].name):
        path = tmp_path / "film.mp4"
        path.unlink(missing_ok=True)
        values = {"path": str(path), "width": 160, "height": 90, "seconds": 0.5}
        assert bench.do("view.film", **values, **film_choices[name])
        assert bench.busy  # a script that waits for idle waits for it
        until(lambda: not bench.busy)
        assert path.is_file()


def test_a_cancelled_film_leaves_nothing_and_wrong_wishes_are_named(window, tmp_path):
    bench = window.bench
    path = tmp_path / "film.mp4"
    for wrong, says in (
        ({"source": "7"}, "view 7: wanted 1 to 1"),
        ({"source": "nobody"}, "nobody sees that"),
        ({"width": 321}, "width = 321"),
        ({"from_s": 1.0}, "no recording is open"),
    ):
        assert not bench.do("view.film", path=str(path), **wrong)
        assert says in bench.log.lines()[-1].text
    assert bench.do("view.film", path=str(path))
    assert bench.do("view.film_cancel")
    assert "cancelled" in bench.log.lines()[-1].text
    assert list(tmp_path.glob("film*")) == []


def test_a_script_films_a_recording_without_a_display(tmp_path, recording):
    """The tiny room's recording, shown in the lab: the same way on a machine with no screen."""
    script = tmp_path / "film.txt"
    script.write_text(
        "wait.scene\n"
        f"timeline.open path={recording}\n"
        f"view.film path={tmp_path / 'view.mp4'} width=320 height=180\n"
        "wait.idle\n"
        f"view.film path={tmp_path / 'maya.mp4'} source=maya width=320 height=180 to_s=0.5\n"
        "wait.idle\n"
    )
    no_display = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-m", "studio.cli", "studio", "desk", "--script", str(script)],
        env={**no_display, "QT_QPA_PLATFORM": "offscreen", "NEXUS_HOME": str(tmp_path / "home")},
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert length_s(tmp_path / "view.mp4") == pytest.approx(1.2, abs=0.21)
    assert length_s(tmp_path / "maya.mp4") == pytest.approx(0.6, abs=0.11)
