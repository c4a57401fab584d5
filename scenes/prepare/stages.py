# pyright: standard
"""The work folder of a preparation: what each stage left, and from what it was made.

A stage that is run again with the same ingredients is not run: what it left is taken. A stage whose
ingredients changed, and every stage after it, is made anew. So a preparation that was cancelled,
killed or stopped by a full disk goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from scenes.formats.storage.atomic import write_file
from scenes.package import Stage
from scenes.prepare.progress import Progress

T = TypeVar("T")

_STAMP = "stage.json"
_MARK = "preparation.json"
_FORMAT = "gaussiannexus preparation"


@dataclass(slots=True)
class WorkFolder:
    """A folder of finished stages.

    Attributes:
        path: the folder.
        seconds: a stopwatch; any start, in seconds.
        progress: called with the share that the stage has done; its note begins with the stage's
            name.
        log: what was done so far, in order, with the time it took when it was made.
    """

    path: Path
    seconds: Callable[[], float]
    progress: Progress
    log: list[Stage] = field(default_factory=list)
    _key: str = ""

    def run(
        self,
        name: str,
        ingredients: Mapping[str, Any],
        *,
        make: Callable[[Path, Progress], T],
        load: Callable[[Path, Progress], T],
        detail: Callable[[T], str],
    ) -> T:
        """The result of a stage: loaded if it is there, made if it is not.

        Args:
            name: of the stage and its folder.
            ingredients: what decides the result beside the stages before it; plain values.
            make: leaves the result in the folder, which may hold an unfinished attempt of the
                same ingredients, and returns it.
            load: reads it back.
            detail: says in words what came out.
        """
        self._key = _key_of(self._key, name, ingredients)

        def report(done: float, note: str) -> None:
            self.progress(done, f"{name}: {note}")

        folder = self.path / name
        stamp = _read_stamp(folder / _STAMP)
        if stamp.get("key") == self._key and stamp.get("finished"):
            result = load(folder, report)
            self.log.append(Stage(name, detail(result), stamp.get("seconds")))
            return result
        if stamp.get("key") != self._key:
            shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        spent = float(stamp.get("seconds") or 0.0)
        started = self.seconds()
        _write_stamp(folder, self._key, spent, finished=False)
        try:
            result = make(folder, report)
        except BaseException:
            # On a full disk the time spent cannot be noted either; that is not what went wrong.
            with suppress(OSError):
                _write_stamp(folder, self._key, spent + self.seconds() - started, finished=False)
            raise
        spent += self.seconds() - started
        _write_stamp(folder, self._key, spent, finished=True)
        self.log.append(Stage(name, detail(result), spent))
        return result


def open_work_folder(path: Path, *, seconds: Callable[[], float], progress: Progress) -> WorkFolder:
    """The work folder at `path`, made if it is not there.

    Raises:
        ValueError: the folder holds something else.
    """
    if path.exists():
        foreign = not path.is_dir() or (any(path.iterdir()) and not (path / _MARK).is_file())
        if foreign:
            raise ValueError(
                f"{path}: holds something that is no preparation; choose another folder with --work"
            )
    path.mkdir(parents=True, exist_ok=True)
    write_file(path / _MARK, [json.dumps({"format": _FORMAT, "version": 1}).encode()])
    return WorkFolder(path, seconds, progress)


def stamps(path: Path) -> list[tuple[str, int, int]]:
    """Name, size and time of a file, or of a folder's files: they change when its content does.

    Raises:
        OSError: it is not there.
    """
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    status = [(file, file.stat()) for file in files]
    return [(str(file.resolve()), s.st_size, s.st_mtime_ns) for file, s in status]


def _key_of(before: str, name: str, ingredients: Mapping[str, Any]) -> str:
    text = json.dumps([before, name, dict(ingredients)], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _read_stamp(path: Path) -> dict[str, Any]:
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return values if isinstance(values, dict) else {}


def _write_stamp(folder: Path, key: str, seconds: float, *, finished: bool) -> None:
    values = {"key": key, "seconds": round(seconds, 3), "finished": finished}
    write_file(folder / _STAMP, [json.dumps(values).encode()])
