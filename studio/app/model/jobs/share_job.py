"""A thread that makes what is handed over after a rehearsal."""

from __future__ import annotations

import threading
from collections.abc import Sequence
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
        parts: names of what is made; None for all.
    """

    def __init__(self, rehearsal: Path, out: Path, parts: Sequence[str] | None = None) -> None:
        self.lines: Slot[str] = Slot()
        self.shared: Shared | None = None
        self.failure: Exception | None = None
        self._rehearsal, self.out, self._parts = rehearsal, out, parts
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
        from studio.handover.share import ALL, Part, share

        progress = Progress(lambda text, _final: self.lines.put(text))
        try:
            parts = ALL if self._parts is None else frozenset(map(Part, self._parts))
            self.shared = share(
                self._rehearsal,
                self.out,
                progress=progress,
                cancelled=self._cancelled,
                parts=parts,
            )
        except Exception as error:  # noqa: BLE001 - shown in the window's log
            self.failure = error
