"""`nexus studio` and the windows of other verbs: makes the window, and runs it to its end."""

from __future__ import annotations

import gc
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from PySide6.QtCore import (
    QCoreApplication,
    QEvent,
    QMessageLogContext,
    QTimer,
    QtMsgType,
    qInstallMessageHandler,
)
from PySide6.QtWidgets import QApplication, QMainWindow, QWidget

from scenes.memory import collect_due, give_back_memory, return_free_pages, share_one_heap
from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import SUFFIX, load_document
from studio.app.model.jobs.live_job import LivePlan
from studio.app.model.jobs.scene_job import SceneJob
from studio.app.model.runs.guests import Guests, doors_of
from studio.app.model.runs.live_run import LiveRun
from studio.app.model.runs.session_run import SessionRun
from studio.app.model.script import Step
from studio.app.model.settings import load_settings, settings_folder
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.history import make_history
from studio.app.shell.main_window import MainWindow
from studio.app.shell.script_run import ScriptRun

if TYPE_CHECKING:  # takes a second to import: not before the window is shown
    from studio.rehearsal import Performance
    from studio.session.plan import SessionPlan
    from studio.session.session import SessionOutput

SWITCH_S = 0.002
"""How long a busy thread may keep the interpreter from the window, seconds."""


COLLECT_AFTER_MS = 3000
"""Time after a change of what is open until it is collected: threads have ended by then."""

COLLECT_MS = 500
"""Between two looks whether objects are due to be collected, milliseconds: by Python's own counts
new ones are every time, and all of them every minute, which takes 80 ms in a rehearsal."""

TRIM_MS = 5000
"""Between two times that the heap's free pages are given back, milliseconds: what sessions and
closed rooms leave is not kept for long. It takes some milliseconds at most."""


def make_window(
    document: Document,
    *,
    rehearse_to: Path,
    home: Path | None = None,
    plugins: Path | None = None,
) -> MainWindow:
    """The studio's window, not yet shown.

    Args:
        document: what it begins with.
        rehearse_to: folder where every session gets one of its own.
        home: folder of settings and of work in progress; None for the user's own.
        plugins: folder of plug-ins; None for the user's own.
    """
    share_one_heap()
    home = home or settings_folder()
    settings, problem = load_settings(home / "settings.json")
    made: list[Workbench] = []
    history = make_history(lambda: made[0])
    bench = Workbench(document, settings, history)
    made.append(bench)
    run = SessionRun(bench, out=rehearse_to, scenarios=home / "scenarios")
    bench.session = run
    bench.share(run.folders)
    live = LiveRun(bench, run)
    bench.share(live)
    bench.share(Guests(bench, doors_of(live)))
    window = MainWindow(bench, run, home=home, make_view=_make_view, plugins=plugins)
    trimming = QTimer(window)
    trimming.timeout.connect(return_free_pages)
    trimming.start(TRIM_MS)
    _collect_after_closing(bench, run, window=window)
    if problem:
        bench.say("warning", problem)
    return window


def _collect_after_closing(bench: Workbench, run: SessionRun, *, window: MainWindow) -> None:
    """Collect what holds only itself some time after a recording or a scene was let go.

    Recordings, their pictures and threads hold each other, 300 to 450 MB of a short one. By itself
    Python looks at old objects when many new ones have come, some recordings later. A collection
    takes 0.2 to 0.7 s, so it waits until nothing plays.
    """
    timer = QTimer(window)
    timer.setSingleShot(True)
    timer.setInterval(COLLECT_AFTER_MS)

    def collect() -> None:
        if run.is_playing or run.is_busy:
            timer.start()
        else:
            give_back_memory()

    timer.timeout.connect(collect)
    for topic in (Topic.RECORDING, Topic.SCENE):
        bench.listen(topic, timer.start)


def dispose(window: MainWindow) -> None:
    """Delete a closed window with its docks and what they hold, and give the memory back.

    Signals hold what they are connected to for as long as their sender lives, and outside of an
    event loop Qt keeps windows that are to be deleted later for ever.
    """
    window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    give_back_memory()


def _make_view(bench: Workbench) -> QWidget:
    from studio.app.film.view_films import ViewFilms
    from studio.app.viewport.view_grid import ViewGrid

    grid = ViewGrid(bench)
    films = ViewFilms(bench, grid)
    grid.add_foot(films)
    # A film that is being drawn needs the scene's drawing: it ends before the views do.
    grid.closing.connect(films.close_films)
    return grid


def open_window(
    scene: str,
    *,
    rehearse_to: Path,
    script: list[Step] | None = None,
    source: str = "script",
    plugins: Path | None = None,
) -> int:
    """`nexus studio`: look at a scene, edit, rehearse. Returns the exit code.

    Args:
        scene: built-in room, package, splat file or project.
        rehearse_to: folder where every session gets one of its own.
        script: user actions to play; the window closes after them.
        source: the script's name, for messages.
        plugins: folder of plug-ins; None for the user's own.

    Raises:
        KeyboardInterrupt: Ctrl+C, or the process got a signal to end.
        ValueError, OSError: the scene cannot be opened, or a step of the script failed.
    """
    is_project = scene.endswith(SUFFIX)
    document = load_document(Path(scene)) if is_project else Document(scene)
    application = _application()
    window = make_window(document, rehearse_to=rehearse_to, plugins=plugins)
    if is_project:
        window.bench.open_document(document, Path(scene).resolve())
    window.run.open_scene(document.scene)
    if script is not None:
        window.script = ScriptRun(
            window.bench, script, source=source, conditions=_conditions(window)
        )
        window.after_script = window.close
        window.bench.set(has_started=True)
    _exec(application, window)
    if window.script is not None and window.script.failure is not None:
        raise window.script.failure
    failure = None if window.run.job is None else window.run.job.failure
    if window.bench.scene is None and isinstance(failure, ValueError | OSError):
        raise failure
    return 0


def rehearse_in_window(plan: SessionPlan, out: Path) -> Performance:
    """Play a rehearsal in a window, which stays open at its end until the user closes it.

    Raises:
        KeyboardInterrupt: the window was closed before the end.
        ValueError, OSError: an input is bad, or the disk is full.
    """
    job = SceneJob(plan.scene, plan, out)
    _play(plan, job, out)
    if job.performance is None:
        _raise_failure(job)
    assert job.performance is not None
    return job.performance


def replay_in_window(plan: SessionPlan, watch: Callable[[SessionOutput], None]) -> None:
    """Play a recording in a window.

    Raises:
        KeyboardInterrupt: the window was closed before the end.
        ValueError, OSError: the recording is bad.
    """
    job = SceneJob(plan.scene, plan, watch=watch)
    _play(plan, job, Path("out/replay"))
    _raise_failure(job)


def live_in_window(plan: LivePlan) -> int:
    """`nexus live` with a display: the window with the live session in front, connecting at once.

    Returns:
        The exit code: 1 where the session that was begun here came to nothing.

    Raises:
        KeyboardInterrupt: Ctrl+C, or the process got a signal to end.
        ValueError, OSError: the room, the camera or the disk are bad.
    """
    application = _application()
    window = make_window(Document(plan.scene, seed=plan.seed), rehearse_to=plan.out)
    live = window.bench.shared(LiveRun)
    assert live is not None
    live.plan = plan
    live.use(plan.setup, is_simulated=plan.is_simulated, wears=plan.wears)
    window.bench.set(has_started=True)
    window.show_dock("live")
    live.begin()
    job = live.job
    assert job is not None
    _exec(application, window)
    if isinstance(job.failure, ValueError | OSError):
        raise job.failure
    return 1 if job.failure is not None or job.live is None else 0


def _play(plan: SessionPlan, job: SceneJob, out: Path) -> None:
    application = _application()
    document = replace(Document(plan.scene), seed=plan.seed, scenario_name=plan.scenario or "")
    window = make_window(document, rehearse_to=out.with_name("sessions"))
    window.run.play(job)
    _exec(application, window)


def _conditions(window: MainWindow) -> dict[str, Callable[..., bool]]:
    """Return the conditions that a script can wait for."""
    run, bench = window.run, window.bench
    live = bench.shared(LiveRun)
    return {
        "wait.idle": lambda: not run.is_busy and not bench.busy,
        "wait.playing": lambda s=0.0: (
            run.output is not None and run.output.input.frame.t_ns >= float(s) * 1e9
        ),
        "wait.live": lambda state="live": (
            live is not None and live.session is not None and live.session.state == state
        ),
        "wait.scene": lambda: bench.scene is not None and not run.is_opening and window.is_filled,
        "wait.drawn": lambda: _is_drawn(window.view),
    }


def _is_drawn(view: QWidget | None) -> bool:
    """Return whether the view that is worked in shows what is now, with nothing left out."""
    from studio.app.viewport.view_grid import ViewGrid

    return isinstance(view, ViewGrid) and view.active.is_drawn


def _application() -> QApplication:
    existing = QApplication.instance()
    application = existing if isinstance(existing, QApplication) else QApplication(["nexus"])
    application.setApplicationDisplayName("")
    return application


class _QtMessages:
    """Prints Qt's messages, and says where the work is when the display has gone.

    Qt ends the event loop, or the process, after that message: it is said at once.
    """

    def __init__(self) -> None:
        self.is_display_gone = False

    def __call__(self, _kind: QtMsgType, _where: QMessageLogContext, text: str) -> None:
        """As `qInstallMessageHandler` has it; from any thread."""
        print(text, file=sys.stderr, flush=True)
        if "connection broke" in text and not self.is_display_gone:
            self.is_display_gone = True
            words = "open the studio again and choose Restore"
            where = f"Unsaved work is kept in {settings_folder()}: {words}"
            print(f"nexus: the display is gone. {where}", file=sys.stderr, flush=True)


def _exec(application: QApplication, window: MainWindow) -> None:
    messages = _QtMessages()
    qInstallMessageHandler(messages)
    window.show()
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    try:
        with _closing_on_signal(window) as signals, collecting_between_events():
            application.exec()
    finally:
        sys.setswitchinterval(before)
    if messages.is_display_gone:
        raise SystemExit(1)  # it has been said already
    if signals:
        raise KeyboardInterrupt


@contextmanager
def collecting_between_events() -> Iterator[None]:
    """Has the event loop alone collect what holds only itself, while it runs.

    Any thread may be the one whose objects make Python collect. Widgets and drawings that it frees
    there are freed under the hands of the window, which ends the program: so it went where a thread
    collected while a style sheet was set.
    """
    timer = QTimer()
    timer.setInterval(COLLECT_MS)
    timer.timeout.connect(collect_due)
    was_enabled = gc.isenabled()
    gc.disable()
    timer.start()
    try:
        yield
    finally:
        timer.stop()
        if was_enabled:
            gc.enable()


@contextmanager
def _closing_on_signal(window: QMainWindow) -> Iterator[list[int]]:
    """Ctrl+C closes the window, as its frame's button does; collects the signals that came.

    What is raised in a signal's handler would end in Qt's event loop, which only prints it.
    """
    signals: list[int] = []

    def close(number: int, _frame: FrameType | None) -> None:
        signals.append(number)
        window.close()

    if threading.current_thread() is not threading.main_thread():
        yield signals
        return
    before = {number: signal.signal(number, close) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield signals
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _raise_failure(job: SceneJob) -> None:
    from studio.session.pipeline import CancelledError

    if isinstance(job.failure, CancelledError):
        raise KeyboardInterrupt from None
    if job.failure is not None:
        raise job.failure
