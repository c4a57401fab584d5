"""Reduced pictures of the recording that is open, made by a process of its own.

A seek shows one of exactly that instant while the full one is being decoded. They are made at the
lowest priority and while nobody else asks for the processor.
"""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scenes.workers.child_process import ChildProcess
from scenes.workers.task import Task
from studio.app.timeline.pictures.proxy_file import MAX_BYTES, ProxyFile, is_whole, proxy_folder
from studio.app.timeline.pictures.reader import EARLY_PACKETS
from studio.app.timeline.recorded.index import RecordingIndex

SIDE_PX = 480
"""Of a reduced picture: the view shows the camera's picture 0.3 of its width wide (`INSET_SHARE` in
`viewport/view_grid.py`), 480 px of 1600."""

BEGIN_AFTER_S = 2.0
"""Seconds that a recording is open before they are made: whoever only looks at one pays nothing."""

_ROOT = Path(__file__).resolve().parents[4]

PROCESS = (
    sys.executable,
    "-c",
    f"import sys; sys.path.insert(0, {str(_ROOT)!r}); "
    "from studio.app.timeline.pictures.proxy_process import main; main()",
)
"""Command that is run; only what decodes is imported."""


def proxies_of(index: RecordingIndex) -> Proxies | None:
    """Those of a recording; None where full pictures are as small, or decoded as soon.

    Args:
        index: of the recording.
    """
    packets = index.packets
    if packets is None or len(packets.topics) != 1:
        return None
    keys = np.append(np.flatnonzero(packets.keyframe), len(packets.t_ns))
    longest = int(np.diff(keys).max()) if len(keys) > 1 else 0
    if index.session.rig.lenses[0].height_px <= SIDE_PX or longest <= EARLY_PACKETS:
        return None
    return Proxies(index.path, packets.topics[0], proxy_folder())


class Proxies:
    """Makes and finds the reduced pictures of one recording.

    Args:
        recording: the file.
        topic: of its video.
        folder: where files of reduced pictures are kept.
        begin_after_s: how long to wait first.
        side_px: of a picture.
        most_bytes: of all files in the folder.

    Attributes:
        problem: why there are none or not all, in words; empty if nothing went wrong.
    """

    def __init__(
        self,
        recording: Path,
        topic: str,
        folder: Path,
        *,
        begin_after_s: float = BEGIN_AFTER_S,
        side_px: int = SIDE_PX,
        most_bytes: int = MAX_BYTES,
    ) -> None:
        self.problem = ""
        self._arguments = (str(recording), topic, str(folder), str(side_px), str(most_bytes))
        self._begin_after_s = begin_after_s
        self._lock = threading.Lock()
        self._held: set[str] = set()
        self._process: ChildProcess | None = None
        self._file: ProxyFile | None = None
        self._task = Task("reduced pictures", self._run)
        self._task.start()

    @property
    def is_done(self) -> bool:
        """Whether nothing more is made."""
        return not self._task.is_running

    @property
    def path(self) -> Path | None:
        """The file, once it is known."""
        return None if self._file is None else self._file.path

    def find(self, number: int, t_ns: int) -> NDArray[np.uint8] | None:
        """The reduced picture (side, side, 3), RGB, of a packet; None if there is none yet.

        Args:
            number: of the packet.
            t_ns: when it was taken.
        """
        with self._lock:
            file = self._file
            if file is None or file.is_damaged:
                return None
            found = file.find(number, t_ns)
            if file.is_damaged:
                self.problem = f"{file.path}: damaged: removed, made anew at the next opening"
                self._end_process()
                with suppress(OSError):
                    file.path.unlink()
            return found

    def hold(self, who: str) -> None:
        """Make none from now on: somebody needs the processor."""
        with self._lock:
            self._held.add(who)
            self._say(b"h")

    def release(self, who: str) -> None:
        """Go on, unless somebody else still needs it."""
        with self._lock:
            self._held.discard(who)
            if not self._held:
                self._say(b"g")

    @contextmanager
    def held(self, who: str) -> Iterator[None]:
        """Hold meanwhile."""
        self.hold(who)
        try:
            yield
        finally:
            self.release(who)

    def stop(self) -> None:
        """End at once; what is not finished is removed."""
        self._task.cancel()
        with self._lock:
            self._end_process()
        self._task.join()
        with self._lock:
            if self._file is not None:
                self._file.close()
                if not is_whole(self._file.path):
                    with suppress(OSError):
                        self._file.path.unlink()
                self._file = None

    def _run(self, task: Task[None]) -> None:
        if task.pause(self._begin_after_s):
            return
        try:
            process = self._begun()
        except OSError as error:
            self.problem = str(error)
            return
        if process is None:
            return
        with process.stdout as lines:
            for line in lines:
                self._take(line.decode(errors="replace").rstrip("\n"))
        code = process.wait()
        if code and not task.is_cancelled and not self.problem:
            self.problem = f"the process that makes reduced pictures ended with {code}"

    def _begun(self) -> ChildProcess | None:
        with self._lock:
            if self._task.is_cancelled:
                return None
            self._process = ChildProcess(
                (*PROCESS, *self._arguments),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                creation_flags=getattr(subprocess, "IDLE_PRIORITY_CLASS", 0),
            )
            if self._held:
                self._say(b"h")
            return self._process

    def _take(self, line: str) -> None:
        word, _, rest = line.partition(" ")
        if word == "failed":
            self.problem = rest
        elif word == "file":
            with self._lock, suppress(OSError):
                self._file = ProxyFile(Path(rest))

    def _say(self, word: bytes) -> None:
        if self._process is not None:
            with suppress(OSError, ValueError):
                self._process.stdin.write(word)
                self._process.stdin.flush()

    def _end_process(self) -> None:
        if self._process is not None:
            self._process.kill()
            with suppress(OSError):
                self._process.stdin.close()
