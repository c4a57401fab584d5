"""A room with one crate in it, and marks on the crate."""

import pytest

from studio.app.preparation.cut_job import Mark
from tests.crate_room import boxes_around_crate, save_crate_room


@pytest.fixture
def scene(tmp_path):
    """The folder of a scene with one crate and three views of it."""
    return save_crate_room(tmp_path)


@pytest.fixture
def marks(scene):
    """A box around the crate in every view."""
    return [
        Mark(name, (*low.tolist(), *high.tolist()))
        for name, low, high in boxes_around_crate(scene, pad_px=5)
    ]


@pytest.fixture
def objects_page(tmp_path, qapp, until):
    """Opens the window on a scene, and the page on which its objects are cut out; gives both."""
    from studio.app.model.documents.document import Document
    from studio.app.window import dispose, make_window

    opened = []

    def show(scene):
        out, home = tmp_path / "out", tmp_path / "home"
        window = make_window(Document(str(scene)), rehearse_to=out, home=home)
        opened.append(window)
        window.bench.set(has_started=True)
        window.run.open_scene(str(scene))
        window.show()
        until(lambda: window.is_filled and window.bench.scene is not None)
        window.bench.do("dock.preparation")
        dock = window.content("preparation")
        dock.tabs.setCurrentWidget(dock.cut)
        return window, dock.cut

    yield show
    for window in opened:
        window.close()
        dispose(window)
