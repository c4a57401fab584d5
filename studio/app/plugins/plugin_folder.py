"""The folder of plug-ins: found, run on threads with a time limit, run again when saved."""

from __future__ import annotations

import sys
import time
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from scenes.workers.task import Task
from studio.app.model.settings import settings_folder
from studio.app.plugins.registration import Registration

LIMIT_S = 5.0
"""Seconds that a plug-in may take to register; one that takes longer is taken to loop."""
LOOK_EVERY_S = 1.0
"""Seconds between two looks at the times of the files."""
LAST_LINES = 3
"""Lines of a traceback that are reported."""
MESSAGES = 200
"""Reports that wait for the window; of more, the oldest go."""
ABANDONED = 8
"""Plug-ins that loop, until no more are started: each holds a processor for good."""


@dataclass(frozen=True, slots=True, eq=False)
class Plugin:
    """One plug-in as it was run last.

    Attributes:
        path: its file.
        module: what the file became.
        offers: what it registered.
    """

    path: Path
    module: ModuleType
    offers: Registration


@dataclass(slots=True)
class _Try:
    """A run of one file on a thread."""

    path: Path
    mtime_ns: int
    before: Plugin | None
    started_s: float = field(default_factory=time.monotonic)
    plugin: Plugin | None = None
    problem: str = ""
    is_done: bool = False
    note: str = ""


def default_folder() -> Path:
    """Return the folder of the user's plug-ins."""
    return settings_folder() / "plugins"


class PluginFolder:
    """Plug-ins of one folder. `poll` belongs to the main thread and never waits.

    Args:
        folder: of the `.py` files; need not be there yet.
        changed: called by `poll` with the plug-in that went and the one that came, or None.
        say: takes a level ("info" or "error") and a line for the log; called by `poll`.
        limit_s: seconds that a plug-in has to register.
    """

    def __init__(
        self,
        folder: Path,
        *,
        changed: Callable[[Plugin | None, Plugin | None], None] = lambda _old, _new: None,
        say: Callable[[Any, str], None] = lambda _level, _text: None,
        limit_s: float = LIMIT_S,
    ) -> None:
        self.folder = folder
        self.plugins: dict[str, Plugin] = {}
        """By file name: those that work; one that fails after it was saved stays as it was."""
        self.abandoned: list[Task[None]] = []
        """Tasks of plug-ins that did not end in time, named after their files."""
        self._changed, self._say, self._limit_s = changed, say, limit_s
        self._tries: dict[str, tuple[_Try, Task[None]]] = {}
        self._seen: dict[str, int] = {}
        self._times: dict[str, int] = {}
        self._messages: deque[str] = deque(maxlen=MESSAGES)
        self._watcher = Task("plug-in folder", self._watch)

    def start(self) -> None:
        """Begin to watch the folder."""
        self._watcher.start()

    def close(self) -> None:
        """Stop watching; what runs is left to itself and its results are ignored."""
        self._watcher.cancel()

    def poll(self) -> None:
        """Take what has been run since the last time, and start what was saved."""
        while self._messages:
            self._say("error", self._messages.popleft())
        for name, (attempt, task) in list(self._tries.items()):
            if attempt.is_done:
                del self._tries[name]
                self._take(name, attempt)
            elif time.monotonic() - attempt.started_s > self._limit_s:
                del self._tries[name]
                self.abandoned.append(task)
                text = f"plug-in {name}: does not end ({self._limit_s:g} s); left to itself."
                self._say("error", f"{text} Look for a loop in it, save it, and it is run again.")
        times = self._times
        for name in [name for name in self._seen if name not in times]:
            del self._seen[name]
            self._remove(name)
        for name, mtime_ns in times.items():
            if self._seen.get(name) != mtime_ns and name not in self._tries:
                self._seen[name] = mtime_ns
                self._begin(name, mtime_ns)

    def offers(self) -> Registration:
        """Everything that all plug-ins offer."""
        total = Registration()
        for plugin in self.plugins.values():
            total.trackers |= plugin.offers.trackers
            total.panels |= plugin.offers.panels
            total.faults |= plugin.offers.faults
            total.actions += plugin.offers.actions
        return total

    def look(self) -> None:
        """Read the times of the files now; the watcher does so every second."""
        try:
            files = sorted(self.folder.glob("*.py")) if self.folder.is_dir() else []
            self._times = {file.name: file.stat().st_mtime_ns for file in files}
        except OSError as error:
            self._messages.append(f"plug-ins in {self.folder} cannot be read: {error.strerror}")

    def _watch(self, task: Task[None]) -> None:
        while not task.is_cancelled:
            self.look()
            task.pause(LOOK_EVERY_S)

    def _begin(self, name: str, mtime_ns: int) -> None:
        alive = [task for task in self.abandoned if task.is_running]
        if len(alive) >= ABANDONED:
            self._say("error", f"plug-in {name}: not run, {ABANDONED} loop already; start again")
            return
        attempt = _Try(self.folder / name, mtime_ns, self.plugins.get(name))
        task = Task(f"plug-in {name}", lambda _: _run(attempt))
        self._tries[name] = attempt, task
        task.start()

    def _take(self, name: str, attempt: _Try) -> None:
        if attempt.plugin is None:
            self._say("error", f"plug-in {name}: {attempt.problem}")
            return
        old = self.plugins.get(name)
        self.plugins[name] = attempt.plugin
        try:
            self._changed(old, attempt.plugin)
        except Exception:  # noqa: BLE001 - what a plug-in offers may be of any kind
            self._say("error", f"plug-in {name}: {last_lines(attempt.path)}")
            return
        self._say("info", f"plug-in {name}: {'loaded again' if old else 'loaded'}{attempt.note}")

    def _remove(self, name: str) -> None:
        self._tries.pop(name, None)
        old = self.plugins.pop(name, None)
        if old is not None:
            self._changed(old, None)
            self._say("info", f"plug-in {name}: taken away")


def last_lines(path: Path) -> str:
    """The exception that is being handled, in a line: file:line first, then the last lines."""
    error = sys.exception()
    assert error is not None
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame.lineno for frame in frames if frame.filename == str(path)]
    line = error.lineno if isinstance(error, SyntaxError) else (own[-1] if own else 1)
    text = "".join(traceback.format_exception(error)).strip().splitlines()[-LAST_LINES:]
    return f"{path}:{line}: {' | '.join(part.strip() for part in text)}"


def _run(attempt: _Try) -> None:
    """Run the file and its `register`, and hand over the state of the one before."""
    try:
        module = ModuleType(f"gaussiannexus_plugin_{attempt.path.stem}")
        module.__file__ = str(attempt.path)
        sys.modules[module.__name__] = module  # dataclasses look up the module they are in
        source = attempt.path.read_text(encoding="utf-8-sig")
        exec(compile(source, str(attempt.path), "exec"), module.__dict__)
        register = getattr(module, "register", None)
        if register is None:
            raise AttributeError("there is no function register(studio)")  # noqa: TRY301
        offers = Registration()
        register(offers)
        keep = getattr(attempt.before and attempt.before.module, "state", None)
        restore = getattr(module, "restore", None)
        if keep is not None and restore is not None:
            restore(keep())
            attempt.note = ", its state kept"
        attempt.plugin = Plugin(attempt.path, module, offers)
    except BaseException:  # noqa: BLE001 - also sys.exit: the window lives on
        attempt.problem = last_lines(attempt.path)
    attempt.is_done = True
