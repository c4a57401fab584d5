"""Work in progress on the disk, so that a crash or a cut cable costs no more than a moment.

Every process has a file of its own. Its name carries the process number; a file whose process is
gone was left behind by a crash and is offered when the studio opens.
"""

from __future__ import annotations

import contextlib
import os
import threading
from dataclasses import dataclass
from pathlib import Path

from devices.streams import Slot
from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import (
    SUFFIX,
    DocumentError,
    load_document,
    save_document,
)

STEM = "autosave-"


@dataclass(frozen=True, slots=True, eq=False)
class Recovered:
    """What a crashed studio left behind.

    Attributes:
        document: as of its last change.
        path: the file.
        t_s: when it was written, seconds since 1970.
    """

    document: Document
    path: Path
    t_s: float


class Autosave:
    """Writes the newest document on a thread of its own; older ones that it missed are skipped.

    Args:
        folder: where work in progress is kept.
        pid: of the process that it belongs to.
    """

    def __init__(self, folder: Path, *, pid: int | None = None) -> None:
        self.path = folder / f"{STEM}{pid or os.getpid()}{SUFFIX}"
        self._slot: Slot[Document] = Slot()
        self._problem: Slot[str] = Slot()
        self._thread = threading.Thread(target=self._run, name="autosave", daemon=True)
        self._thread.start()

    def keep(self, document: Document) -> None:
        """This is the work in progress now."""
        self._slot.put(document)

    def problem(self) -> str | None:
        """Why the last one could not be written, once; None if all is well."""
        return self._problem.take()

    def stop(self, *, keep: bool = False) -> None:
        """End; the file goes, unless it is to be kept."""
        self._slot.close()
        self._thread.join()
        if not keep:
            self.path.unlink(missing_ok=True)

    def _run(self) -> None:
        while (document := self._slot.take(timeout_s=None)) is not None:
            try:
                save_document(document, self.path)
            except OSError as error:
                self._problem.put(
                    f"work in progress cannot be kept: {self.path}: {error.strerror}; "
                    "free some disk space, or save the project elsewhere"
                )


def recoverable(folder: Path) -> list[Recovered]:
    """What crashed studios have left in the folder, newest first; damaged files stay untouched."""
    found: list[Recovered] = []
    for path in folder.glob(f"{STEM}*{SUFFIX}"):
        pid = path.stem.removeprefix(STEM)
        if pid.isdigit() and not _is_running(int(pid)):
            with contextlib.suppress(DocumentError, OSError):
                found.append(Recovered(load_document(path), path, path.stat().st_mtime))
    return sorted(found, key=lambda item: -item.t_s)


def discard(recovered: Recovered) -> None:
    """The user does not want it, or has it open again."""
    recovered.path.unlink(missing_ok=True)


def _is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
