"""One measurement in a process of its own: `python -m studio.app.measure.child WHAT`, JSON out."""

from __future__ import annotations

import json
import os
import resource
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from studio.app.shell.main_window import MainWindow

BEGIN = "NEXUS_MEASURE_BEGIN"
"""Variable with the parent's monotonic clock when it started this process, seconds."""

LIMIT_S = 240.0
"""After so long something hangs."""

ORBIT_S, INPUT_S = 6.0, 12.0
"""How long is orbited and clicked: some hundred pictures and answers."""

SPLATS = 300_000
"""Of the room that is orbited, as the bar has it."""


def main() -> None:
    """Measure what the command line names, and print one JSON line."""
    what, *rest = sys.argv[1:]
    print(json.dumps(MEASURES[what](*rest)), flush=True)


def opening() -> dict[str, Any]:
    """Seconds from the process's start to the window, and to the first picture of the lab."""
    window, wait = _window("lab")
    shown = _since_begin()
    wait(lambda: _has_picture(window))
    picture = _since_begin()
    window.close()
    return {"window_s": shown, "first_picture_s": picture}


def orbiting() -> dict[str, Any]:
    """Pictures a second while orbiting 300 k splats at 960 × 540, and the time to a full one."""
    import numpy as np

    from scenes.frames import look_at
    from scenes.state import Avatar

    window, wait = _window("lab")
    wait(lambda: _has_picture(window))
    bench, scene = window.bench, window.bench.scene
    assert scene is not None
    bench.show_scene(replace(scene, room=_denser(scene.room, SPLATS)))
    for name, x in (("ana", 0.5), ("ben", -0.5)):
        head = look_at(np.array([x, 1.0, 1.65]), np.array([0.0, 0.0, 1.0]))
        twin = bench.document.twin
        avatars = {**twin.avatars, name: Avatar(name, "remote", head)}
        bench.show_document(replace(bench.document, twin=replace(twin, avatars=avatars)))
    grid: Any = window.view
    view = grid.active
    view.setFixedSize(960, 540)
    wait(lambda: view.painted is not None and view.painted.is_full)
    _rest(wait, 4.0)  # the thinned room is made meanwhile
    pictures, begin = [], time.monotonic()
    while time.monotonic() - begin < ORBIT_S:
        before = view.painted
        bench.do("view.orbit", yaw_deg=0.6)
        wait(lambda before=before: view.painted is not before)
        pictures.append(time.monotonic())
    stopped = time.monotonic()
    wait(lambda: view.painted.is_full)
    refined = time.monotonic() - stopped
    window.close()
    return {"fps": len(pictures) / (pictures[-1] - begin), "refined_ms": 1e3 * refined}


def answering() -> dict[str, Any]:
    """Milliseconds until the window has answered an input while a session plays."""
    from PySide6.QtCore import QObject, Qt, Signal

    class Poster(QObject):
        posted = Signal(float)

    window, wait = _window("lab")
    wait(lambda: window.is_filled and _has_picture(window))
    window.bench.perform("session.rehearse")
    wait(lambda: window.run.output is not None)
    grid: Any = window.view
    took: list[float] = []

    def answer(posted_s: float) -> None:
        grid.active.set_viewer(grid.active.viewer.dragged(1.0, 0.0))
        grid.active.repaint()
        took.append(1e3 * (time.monotonic() - posted_s))

    poster = Poster()
    poster.posted.connect(answer, Qt.ConnectionType.QueuedConnection)
    ended = threading.Event()

    def post() -> None:
        while not ended.wait(0.05):
            poster.posted.emit(time.monotonic())

    thread = threading.Thread(target=post, daemon=True)
    thread.start()
    _rest(wait, INPUT_S)
    ended.set()
    thread.join()
    window.close()
    return {"input_ms": took}


def open_close(rounds: str) -> dict[str, Any]:
    """Resident memory after each round of open, rehearse, close; in MB."""
    from studio.app.model.document import Document

    resident: list[float] = []
    scenario = SHORT.read_text(encoding="utf-8")
    for _ in range(int(rounds)):
        document = Document("lab", scenario_name="short", scenario=scenario)
        window, wait = _window(document)
        wait(lambda window=window: window.is_filled and _has_picture(window))
        window.bench.perform("session.rehearse")
        wait(lambda window=window: not window.run.is_busy)
        window.close()
        window.deleteLater()
        _rest(wait, 0.3)
        resident.append(_resident_mb())
    return {"resident_mb": resident}


def editing(home: str) -> dict[str, Any]:
    """Edit without end, printing each edit's number: whoever reads it kills this process."""
    from studio.app.model.document import Document, Marker

    window, wait = _window("lab", home=Path(home))
    print("ready", flush=True)
    for number in range(100_000):
        markers = (Marker(number, "edit"),)
        window.bench.change("Mark", Document("lab", markers=markers))
        print(f"{number} {time.monotonic()}", flush=True)
        _rest(wait, 0.03)
    return {}


SHORT = Path(__file__).with_name("short.toml")
"""A rehearsal of a second: what is repeated fifty times."""

MEASURES: dict[str, Callable[..., dict[str, Any]]] = {
    "opening": opening,
    "orbiting": orbiting,
    "answering": answering,
    "open_close": open_close,
    "editing": editing,
}


def _window(scene: Any, home: Path | None = None) -> tuple[MainWindow, Callable[..., None]]:
    from PySide6.QtWidgets import QApplication

    from studio.app.model.document import Document
    from studio.app.window import SWITCH_S, make_window

    sys.setswitchinterval(SWITCH_S)
    application = QApplication.instance() or QApplication(["nexus"])
    document = Document(scene) if isinstance(scene, str) else scene
    folder = Path(tempfile.mkdtemp(prefix="nexus-measure-"))
    window = make_window(document, rehearse_to=folder / "out", home=home or folder)
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


def _has_picture(window: MainWindow) -> bool:
    grid: Any = window.view
    return grid is not None and grid.active.painted is not None


def _rest(wait: Callable[..., None], seconds: float) -> None:
    end = time.monotonic() + seconds
    wait(lambda: time.monotonic() >= end)


def _denser(room: Any, count: int) -> Any:
    """The room with its splats repeated to so many, each repeat moved by millimetres."""
    import numpy as np

    from scenes.splats import SplatCloud

    rng = np.random.default_rng(0)
    chosen = np.arange(count) % len(room)
    jitter = rng.normal(0.0, 0.004, (count, 3)).astype(np.float32)
    return SplatCloud(
        room.means[chosen] + jitter,
        room.scales[chosen],
        room.rotations[chosen],
        room.opacities[chosen],
        room.sh[chosen],
    )


def _since_begin() -> float:
    return time.monotonic() - float(os.environ[BEGIN])


def _resident_mb() -> float:
    for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    main()
