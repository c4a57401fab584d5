"""A room of the wrong size in a real window: measured by two clicks, given its length, scaled."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt

from scenes.package import load_package
from studio.app.model.documents.document import Document
from studio.app.model.measured_line import MeasuredLine
from studio.app.preparation.preparation_job import rescaling_words
from studio.app.preparation.scale_page import NOT_MEASURED
from studio.console.display import why_no_window

WHY_NOT = why_no_window()


def test_a_splat_file_and_a_scene_are_scaled_by_the_same_command(tmp_path):
    for name, out in (("room.ply", "room.gnx"), ("hall.gnx", "hall-scaled.gnx")):
        path = tmp_path / name
        path.touch() if name.endswith("ply") else path.mkdir()
        words, made = rescaling_words(MeasuredLine(str(path), 4.0), 3.0)
        assert made == tmp_path / out
        assert words == [
            "convert", str(path), str(made), "--json", "--metres-per-unit", "0.75",
        ]  # fmt: skip


def test_a_built_in_room_keeps_its_scale():
    with pytest.raises(ValueError, match="lab is a built-in room"):
        rescaling_words(MeasuredLine("lab", 4.0), 3.0)


@pytest.fixture
def opened(scene, tmp_path, until):
    from studio.app.window import dispose, make_window

    document = Document(str(scene))
    window = make_window(document, rehearse_to=tmp_path / "out", home=tmp_path / "home")
    window.bench.set(has_started=True)
    window.resize(1100, 750)
    window.show()
    window.run.open_scene(document.scene)

    until(lambda: window.is_filled and window.bench.scene is not None)
    until(lambda: window.view.active.painted is not None)
    yield window, until
    window.close()
    dispose(window)


def clicked(qtbot, until, view, places):
    """Click where places of the floor are seen."""
    # A picture from before the window took its place is of another shape.
    until(
        lambda: view.painted is not None and view.painted.is_full
        and view.painted.view.camera.width_px * view.height()
        == pytest.approx(view.painted.view.camera.height_px * view.width(), rel=0.02)
    )  # fmt: skip
    shown = view.painted.view
    pixels, seen = shown.camera.project(shown.world_from_camera.inverse() @ places)
    assert seen.all()
    sizes = view.width() / shown.camera.width_px, view.height() / shown.camera.height_px
    for x, y in np.rint(pixels * sizes).astype(int).tolist():
        qtbot.mouseClick(view, Qt.MouseButton.LeftButton, pos=QPoint(x, y))


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_two_clicks_and_a_number_make_the_ruler_right(opened, qtbot, scene):
    window, until = opened
    bench, page = window.bench, window.content("preparation").scale
    before = sorted((f.name, f.stat().st_mtime_ns) for f in scene.rglob("*"))
    assert not page.button.isEnabled()
    assert page.line.text() == NOT_MEASURED
    assert not bench.do("preparation.set_scale", metres=2.0)
    assert "nothing was measured" in bench.log.lines("error")[-1].text

    ends = np.array([[0.6, 0.0, 0.0], [0.0, 0.6, 0.0]])
    assert bench.do("view.tool_measure")
    clicked(qtbot, until, window.view.active, ends)
    page.refresh()
    length = float(np.linalg.norm(ends[1] - ends[0]))
    assert bench.shared(MeasuredLine).length_m == pytest.approx(length, rel=0.02)
    assert f"{bench.shared(MeasuredLine).length_m:.3f} m" in page.line.text()
    page.metres.setValue(2 * length)
    page.refresh()
    assert page.button.isEnabled()
    qtbot.mouseClick(page.button, Qt.MouseButton.LeftButton)

    made = scene.with_name("crate-scaled.gnx")
    until(lambda: bench.document.scene == str(made) and bench.scene is not None)
    assert page.verdict.text().startswith("● crate-scaled.gnx is ready")
    until(lambda: window.view.active.painted is not None)
    page.refresh()
    assert not page.button.isEnabled()
    # The ruler in the new room, on another length.
    other = 2 * np.array([[0.7, 0.3, 0.0], [0.3, 0.7, 0.0]])
    assert bench.do("view.tool_measure")
    clicked(qtbot, until, window.view.active, other)
    ruler_m = bench.shared(MeasuredLine).length_m
    assert ruler_m == pytest.approx(np.linalg.norm(other[1] - other[0]), rel=0.02)
    assert sorted((f.name, f.stat().st_mtime_ns) for f in scene.rglob("*")) == before
    ratio = np.ptp(load_package(made).room.means, axis=0) / np.ptp(
        load_package(scene).room.means, axis=0
    )
    np.testing.assert_allclose(ratio, 2.0, rtol=0.03)


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_what_was_changed_by_hand_is_saved_first(opened):
    window, _ = opened
    bench = window.bench
    bench.share(MeasuredLine(bench.document.scene, 2.0))
    assert bench.do("twin.add_avatar", role="local", place=[0.0, 0.0, 0.0])
    assert not bench.do("preparation.set_scale", metres=1.0)
    assert "save this one first" in bench.log.lines("error")[-1].text


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_what_is_changed_while_it_runs_stays_open(opened, scene):
    window, until = opened
    bench, page = window.bench, window.content("preparation").scale
    bench.share(MeasuredLine(bench.document.scene, 2.0))
    assert bench.do("preparation.set_scale", metres=1.0)
    assert bench.do("twin.add_avatar", role="local", place=[0.0, 0.0, 0.0])
    until(lambda: page.job is None)
    assert bench.document.scene == str(scene)
    assert len(bench.document.twin.avatars) == 1
    assert page.verdict.text().startswith("● crate-scaled.gnx is ready: open it when")


@pytest.mark.gui
@pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}")
def test_a_cancelled_one_says_so_and_opens_nothing(opened, scene):
    window, until = opened
    bench, page = window.bench, window.content("preparation").scale
    bench.share(MeasuredLine(bench.document.scene, 2.0))
    assert bench.do("preparation.set_scale", metres=1.0)
    page.cancel()
    until(lambda: page.job is None)
    assert "the room keeps its scale" in page.verdict.text()
    assert bench.document.scene == str(scene)
    assert not scene.with_name("crate-scaled.gnx").exists()
