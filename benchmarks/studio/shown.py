"""A window of a measurement: shown, with a scene, and waited for by the events it handles."""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.workers.task import Task

if TYPE_CHECKING:  # takes a second to import: not before a measurement has begun
    from studio.app.shell.main_window import MainWindow

LIMIT_S = 240.0
"""After so long something hangs."""

POST_S = 0.05
"""Between two inputs of `asked_for_answers`: faster than a hand, seconds."""

Wait = Callable[..., None]
"""`wait(condition, limit_s=…)` handles events until the condition holds."""


def shown_window(scene: Any, home: Path | None = None) -> tuple[MainWindow, Wait]:
    """The studio's window with a scene, and what waits for it.

    Args:
        scene: name or path of a scene, or a document.
        home: folder of settings; None for an empty one, which goes with the temporary folder of
            the measurement's process. Rehearsals go to its `out`.
    """
    from PySide6.QtWidgets import QApplication

    from studio.app.model.documents.document import Document
    from studio.app.window import SWITCH_S, make_window

    sys.setswitchinterval(SWITCH_S)
    application = QApplication.instance() or QApplication(["nexus"])
    document = Document(scene) if isinstance(scene, str) else scene
    home = home or Path(tempfile.mkdtemp(prefix="home-"))
    window = make_window(document, rehearse_to=home / "out", home=home)
    window.show()
    window.run.open_scene(document.scene)

    def wait(condition: Callable[[], bool], limit_s: float = LIMIT_S) -> None:
        end = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f"the window did not get there in {limit_s:.0f} s")
            application.processEvents()
            time.sleep(0.001)

    wait(lambda: window.isVisible())
    application.processEvents()
    return window, wait


def has_picture(window: MainWindow) -> bool:
    """Whether the view has drawn the scene."""
    grid: Any = window.view
    return grid is not None and grid.active.painted is not None


def rest(wait: Wait, seconds: float) -> None:
    """Handle events for so long."""
    end = time.monotonic() + seconds
    wait(lambda: time.monotonic() >= end)


@contextmanager
def asked_for_answers(window: MainWindow, took_ms: Callable[[float], object]) -> Iterator[None]:
    """Meanwhile another thread turns the view again and again, as a hand would.

    Args:
        window: with a picture.
        took_ms: is given the milliseconds from each input to the view drawn anew.
    """
    from PySide6.QtCore import QObject, Qt, Signal

    class Poster(QObject):
        posted = Signal(float)

    grid: Any = window.view

    def answer(posted_s: float) -> None:
        grid.active.set_viewer(grid.active.viewer.dragged(1.0, 0.0))
        grid.active.repaint()
        took_ms(1e3 * (time.monotonic() - posted_s))

    poster = Poster()
    poster.posted.connect(answer, Qt.ConnectionType.QueuedConnection)

    def post(task: Task[None]) -> None:
        while not task.pause(POST_S):
            poster.posted.emit(time.monotonic())

    posting = Task("posting", post).start()
    try:
        yield
    finally:
        posting.cancel()
        posting.join()


def resident_mb() -> float:
    """Memory of this process that is in RAM, MB."""
    for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
