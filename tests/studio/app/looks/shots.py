"""Pictures of the window, of every dock in every state: made by the program's own actions.

`python -m tests.studio.app.looks.shots OUT [--recording FILE] [--theme dark] [--size 1280x800]`
writes them all as PNG, to be looked at.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtCore import QPoint, QRect
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication, QTabWidget, QWidget

from studio.app.model.documents.document import Document
from studio.app.model.script import read_script
from studio.app.shell.main_window import MainWindow

LIMIT_S = 120.0
"""How long a state may take to come about."""


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture.

    Attributes:
        name: of the file.
        script: actions that lead to it from the shot before.
        part: whose picture: "" the window's, else a dock's id.
        tab: title of the tab of that dock that is in front, if it has tabs.
        waits: name of what is waited for, see `_READY`.
        leaves: whether what floats over the window is closed after it.
    """

    name: str
    script: str = ""
    part: str = ""
    tab: str = ""
    waits: str = ""
    leaves: bool = False


EMPTY = (
    Shot("first-page", waits="plan"),
    Shot("twin-empty", "dock.twin", "twin"),
    Shot("scenario-floor", "dock.scenario", "scenario", "Floor", "plan"),
    Shot("scenario-actions", "dock.scenario", "scenario", "Actions"),
    Shot("scenario-faults", "dock.scenario", "scenario", "Faults"),
    Shot("scenario-text", "dock.scenario", "scenario", "Text"),
    Shot("session-devices-empty", "dock.session", "session", "Devices"),
    Shot("session-checks-empty", "dock.session", "session", "Checks"),
    Shot("session-log-empty", "dock.session", "session", "Log"),
    Shot("session-report-empty", "dock.session", "session", "Report"),
    Shot("live-camera", "dock.live", "live", "Camera"),
    Shot("live-checks-empty", "dock.live", "live", "Checks"),
    Shot("live-delay-empty", "dock.live", "live", "Delay"),
    Shot("live-tracker", "dock.live", "live", "Tracker"),
    Shot("live-report-empty", "dock.live", "live", "Report"),
    Shot("people-empty", "dock.people", "people"),
    Shot("preparation-room", "dock.preparation", "preparation", "Room"),
    Shot("preparation-objects", "dock.preparation", "preparation", "Objects"),
    Shot("preparation-scale", "dock.preparation", "preparation", "Scale"),
    Shot("timeline-empty", "dock.timeline", "timeline"),
    Shot("keys", "dock.keys", "keys"),
    Shot("palette", "palette.open", leaves=True),
    Shot("cheat-sheet", "help.keys", leaves=True),
)
"""Before anything was done."""

BUSY = (
    Shot("faults-on", "dock.scenario\nscenario.add_fault name=delay_ms", "scenario", "Faults"),
    Shot("action-form", "dock.scenario", "scenario", "Actions", "form"),
    Shot("session-log", "dock.session", "session", "Log"),
    Shot("timeline", "dock.timeline\nselect.object", "timeline", waits="recording"),
    Shot("twin", "dock.twin", "twin"),
    Shot("session-report", "dock.session", "session", "Report"),
    Shot("window", "dock.scenario", "", "", "plan"),
)
"""With a recording open and an object selected."""


class Stage:
    """A window in which shots are taken.

    Args:
        window: open and filled, with a scene.
        recording: what the busy shots show; None leaves them out.
    """

    def __init__(self, window: MainWindow, recording: Path | None) -> None:
        self.window = window
        self._recording = recording

    def hide_room(self) -> None:
        """Leave the room out of the pictures: other machines draw it a little differently."""
        view: Any = self.window.view
        for each in view.views:
            each.hide()
        view.insets.hide()

    def close(self) -> None:
        """Close the window, and delete it: a theme is put on every window that there is."""
        from studio.app.window import dispose

        self.window.close()
        dispose(self.window)

    def take(self, shots: Sequence[Shot]) -> Iterator[tuple[Shot, QImage]]:
        """The shots one after the other."""
        for shot in shots:
            self._play(shot)
            yield shot, self._picture(shot)
            if shot.leaves:
                self.window.palette_bar.hide()
                self.window.cheat_sheet.hide()

    def _play(self, shot: Shot) -> None:
        bench = self.window.bench
        for step in read_script(shot.script, source=shot.name):
            if step.action_id == "select.object":
                assert bench.scene is not None
                bench.select(bench.scene.objects[0].object_id)
            else:
                bench.perform(step.action_id, **step.values)
        if shot.tab:
            self._show_tab(self.window.content(shot.part), shot.tab)
        self._wait_for(shot.waits)
        settle()

    def _show_tab(self, content: QWidget, title: str) -> None:
        tabs = content.findChild(QTabWidget)
        assert isinstance(tabs, QTabWidget)
        titles = [tabs.tabText(place) for place in range(tabs.count())]
        tabs.setCurrentIndex(titles.index(title))

    def _wait_for(self, what: str) -> None:
        bench, window = self.window.bench, self.window
        if what == "plan":
            dock: Any = window.content("scenario")
            until(lambda: dock.floor._picture is not None)
        elif what == "form":
            dock: Any = window.content("scenario")
            people = dock.editing.scenario.people
            dock.edit_action((people[0].person_id, 1))
        elif what == "recording":
            assert self._recording is not None
            dock: Any = window.content("timeline")
            bench.perform("timeline.open", path=str(self._recording))
            until(lambda: dock.is_open)
            half_s = dock.shown.index.duration_s / 2
            bench.perform("timeline.seek", t_s=round(half_s, 2))

    def _picture(self, shot: Shot) -> QImage:
        whole = self.window.grab().toImage()
        if not shot.part:
            return whole
        area = self.window.docks[shot.part].dockAreaWidget()
        corner = area.mapTo(self.window, QPoint(0, 0))
        return whole.copy(QRect(corner, area.size()))


def until(condition: Callable[[], bool], limit_s: float = LIMIT_S) -> None:
    """Let Qt work until something is so."""
    deadline = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < deadline, f"not there in {limit_s} s"
        QApplication.processEvents()
        time.sleep(0.002)


def settle(seconds: float = 0.4) -> None:
    """Let timers and layouts do what they have to."""
    end = time.monotonic() + seconds
    until(lambda: time.monotonic() > end)


def open_stage(
    home: Path, *, theme: str, size_px: tuple[int, int], recording: Path | None = None
) -> Stage:
    """A window on the built-in lab as a new user finds it.

    Args:
        home: empty folder for settings.
        theme: of the window.
        size_px: width and height of it.
        recording: for the busy shots.
    """
    from studio.app.window import make_window

    window = make_window(Document("lab"), rehearse_to=home / "out", home=home)
    window.bench.set(theme=theme)
    window.resize(*size_px)
    window.run.open_scene("lab")
    window.show()
    until(lambda: window.is_filled and window.bench.scene is not None and not window.run.is_busy)
    window.resize(*size_px)
    view: Any = window.view
    until(lambda: view.active.painted is not None)
    settle()
    return Stage(window, recording)


def main() -> None:
    """Write pictures."""
    import tempfile

    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401

    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("--recording", type=Path)
    parser.add_argument("--theme", default="dark")
    parser.add_argument("--size", default="1280x800")
    asked = parser.parse_args()
    width, height = (int(part) for part in asked.size.split("x"))
    application = QApplication([])
    asked.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as home:
        stage = open_stage(
            Path(home), theme=asked.theme, size_px=(width, height), recording=asked.recording
        )
        for shot, picture in stage.take((*EMPTY, *(BUSY if asked.recording else ()))):
            picture.save(str(asked.out / f"{shot.name}.png"))
        stage.close()
    del application


if __name__ == "__main__":
    main()
