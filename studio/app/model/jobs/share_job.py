"""A thread that makes what is handed over after a rehearsal."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING

from devices.streams import Slot
from studio.console.progress import Progress

if TYPE_CHECKING:
    from studio.handover.share import Shared


class ShareJob:
    """Film, viewer, sheet and archive of a rehearsal's folder.

    Args:
        rehearsal: the folder.
        out: where the results go.
    """

    def __init__(self, rehearsal: Path, out: Path) -> None:
        self.lines: Slot[str] = Slot()
        self.shared: Shared | None = None
        self.failure: Exception | None = None
        self._rehearsal, self._out = rehearsal, out
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self._run, name="share", daemon=True)
        self._thread.start()

    @property
    def is_running(self) -> bool:
        """Whether it is still at work."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Cancel and wait."""
        self._cancelled.set()
        self._thread.join()

    def _run(self) -> None:
        from studio.handover.share import share

        progress = Progress(lambda text, _final: self.lines.put(text))
        try:
            self.shared = share(
                self._rehearsal, self._out, progress=progress, cancelled=self._cancelled
            )
        except Exception as error:  # noqa: BLE001 - shown in the window's log
            self.failure = error
