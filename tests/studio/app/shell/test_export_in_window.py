"""Splats are exported by menu and file dialog: all, or one object, turned as the format wants."""

import numpy as np
import pytest

from benchmarks.studio.tasks.clicking import Hand
from scenes.formats.registry import is_in_world_frame, read_splats
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


def exported(desk, line, path):
    """The file that the menu's line has written, under the name that was typed."""
    hand, bench = Hand(desk.window, desk.until), desk.window.bench
    hand.will_choose(path)
    hand.menu("File", "Export splats", line)
    desk.until(lambda: not bench.busy)
    return bench.log.lines()[-1]


def test_the_room_as_it_is_arranged_is_written(desk, tmp_path):
    scene = desk.window.bench.scene
    assert desk.drag_object("chair-1")
    said = exported(desk, "All, as it is shown …", tmp_path / "all")
    cloud = read_splats(tmp_path / "all.ply")
    assert is_in_world_frame(tmp_path / "all.ply")
    assert f"{len(cloud):,} splats" in said.text
    count = len(scene.room)
    assert len(cloud) == count + sum(len(item.splats) for item in scene.objects)
    np.testing.assert_allclose(cloud.means[:count], scene.room.means, atol=1e-5)
    chair = scene.objects[0]
    pose = desk.window.bench.document.twin.poses["chair-1"]
    placed = pose @ chair.splats.means.astype(float)
    np.testing.assert_allclose(cloud.means[count : count + len(chair.splats)], placed, atol=1e-5)


def test_one_object_is_written_as_spz_in_its_own_frame(desk, tmp_path):
    chair = desk.window.bench.scene.objects[0]
    exported(desk, "Chair 1 …", tmp_path / "chair.spz")
    cloud = turned(read_splats(tmp_path / "chair.spz"), WORLD_FROM_FORWARD_CAMERA)
    np.testing.assert_allclose(cloud.means, chair.splats.means, atol=2e-3)


def test_a_file_is_replaced_only_after_a_question(desk, tmp_path):
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication, QMessageBox

    path = tmp_path / "mine.ply"
    path.write_text("mine")
    asked = []

    def refuse():
        box = QApplication.activeModalWidget()
        if isinstance(box, QMessageBox):
            asked.append(box.text())
            box.button(QMessageBox.StandardButton.No).click()
        elif not asked:
            QTimer.singleShot(20, refuse)

    QTimer.singleShot(20, refuse)
    hand = Hand(desk.window, desk.until)
    hand.will_choose(tmp_path / "mine")  # the ending is added before the question
    hand.menu("File", "Export splats", "The room without its objects …")
    assert "mine.ply" in asked[0]
    assert path.read_text() == "mine"


def test_a_name_of_no_format_is_said_with_those_that_there_are(desk, tmp_path):
    bench = desk.window.bench
    assert not bench.do("file.export_splats", path=str(tmp_path / "room.docx"))
    assert ".spz" in bench.notice.text
    assert not bench.do("file.export_splats", what="nobody", path=str(tmp_path / "a.ply"))
    assert "wanted one of all, room, chair-1" in bench.log.lines()[-1].text
    assert list(tmp_path.glob("*.ply")) == []
