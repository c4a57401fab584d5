"""An object that the mouse drags passes few files on its way to the saved project."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.opening import open_scene
from scenes.pose import Pose
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench
from studio.app.twin.edits import Stance
from studio.app.viewport.drawing.scene_drawing import Drawings
from studio.app.viewport.layers import Layers
from studio.console.display import why_no_window
from tests.passing import Passing
from tests.studio.app.viewport.test_view import drag

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]

MAX_FILES = 9
"""Files that a dragged pose passes. Lower it with every file less; never raise it."""

BESIDE = (
    "studio/app/viewport/seen_twin",
    "studio/app/viewport/drawing/",
    "studio/app/viewport/view_overlay",
    "studio/app/model/names",  # the step's label
    "scenes/state",
)
"""Beginnings of files that show the room while the object is dragged."""


@pytest.fixture
def view(qapp):
    from studio.app.shell.history import QtHistory
    from studio.app.viewport.view import TwinView

    bench = Workbench(Document("desk"), Settings(), QtHistory(lambda _document: None))
    bench.show_scene(open_scene("desk"))
    drawings = Drawings()
    made = TwinView(bench, layers=Layers(bench), drawings=drawings, finished=lambda _hand: None)
    made.resize(640, 480)
    made.show()
    yield made
    made.close()
    made.deleteLater()
    drawings.close()


def test_a_dragged_object_passes_few_files_to_the_saved_project(view, tmp_path):
    from studio.app.shell.actions.files import FileActions

    bench = view.bench
    item = bench.scene.objects[0]
    before = bench.document
    bench.select(item.object_id)
    view.frame()
    line = view._handles().gizmo.lines()["x"]
    start = np.asarray(line)[-1]

    def is_dragged(value):
        if isinstance(value, Pose):
            return (
                0.0 < np.linalg.norm(value.translation - item.world_from_object.translation) < 0.3
            )
        if isinstance(value, str):
            return len(value) > 60 and item.object_id in value
        return isinstance(value, Stance) or (isinstance(value, Document) and value is not before)

    passing = Passing(is_dragged, ends_in=BESIDE)
    with passing.watching():
        passing.is_on = True
        drag(view, start, start + np.array([12.0, 6.0]))
        FileActions(bench, None, None, None).save(str(tmp_path / "room.nexus"))
    assert bench.document is not before
    assert (tmp_path / "room.nexus").is_file()
    print(f"files that a drag passes: {len(passing.files)}")
    print(*(f"{file}: {name}" for file, name in sorted(passing.files.items())), sep="\n")
    assert len(passing.files) <= MAX_FILES, passing.files
