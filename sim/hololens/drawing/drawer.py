"""Draws and codes beside this process: both hold the interpreter, and hands shall not wait."""

from __future__ import annotations

import pickle
import subprocess
from collections import deque
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.personal_video import VideoRequest
from scenes.workers.child_process import ChildProcess, module_command, module_environment
from sim.hololens.drawing.process import HEAD
from sim.hololens.drawing.scenery import DrawnScene, Shot

LEAVING_S = 3.0
"""Longest wait for the process to end by itself, seconds."""

LAST_WORDS = 20
"""Lines of what it says on standard error that are kept, for the message where it dies."""


class DrawingError(RuntimeError):
    """The process that draws has died: its last words."""


class Drawer:
    """Draws shots in order, for one thread.

    Args:
        scene: what is drawn.

    Attributes:
        took_ns: for how long the picture that was taken last was drawn and coded.
    """

    def __init__(self, scene: DrawnScene) -> None:
        self.took_ns = 0
        self._ordered: deque[tuple[int, int]] = deque()
        self._process = ChildProcess(
            module_command("sim.hololens.drawing.process"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            last_words=LAST_WORDS,
            environment=module_environment(),
        )
        self._tell(scene)

    def code(self, request: VideoRequest | None) -> None:
        """Have pictures coded from now on, the first as a keyframe, or not; `take` gives them.

        Raises:
            DrawingError: the process has died.
        """
        self._tell(request)

    def order(self, shot: Shot) -> None:
        """Have a picture drawn; `picture` gives it, or `take` where it is coded.

        Raises:
            DrawingError: the process has died.
        """
        self._ordered.append((shot.camera.width_px, shot.camera.height_px))
        self._tell(shot)

    def picture(self) -> NDArray[np.uint8]:
        """Wait for the picture that was ordered first; return its (H, W, 3) uint8 RGB.

        Raises:
            DrawingError: the process has died.
        """
        width, height = self._ordered[0]
        return np.frombuffer(self.take(), np.uint8).reshape(height, width, 3)

    def take(self) -> bytes:
        """Wait for the picture that was ordered first; return its bytes.

        Raises:
            DrawingError: the process has died.
        """
        self._ordered.popleft()
        size, self.took_ns = HEAD.unpack(self._read(HEAD.size))
        return bytes(self._read(size))

    def close(self) -> None:
        """End the process."""
        with suppress(OSError):
            self._process.stdin.close()
        if self._process.wait(LEAVING_S) is None:
            self._process.kill()
            self._process.wait(LEAVING_S)
        self._process.stdout.close()

    def _read(self, size: int) -> bytearray:
        data = bytearray(size)
        view, have = memoryview(data), 0
        while have < size:
            count = self._process.stdout.readinto(view[have:])
            if not count:
                raise self._died()
            have += count
        return data

    def _tell(self, value: DrawnScene | VideoRequest | Shot | None) -> None:
        try:
            pickle.dump(value, self._process.stdin, protocol=5)
            self._process.stdin.flush()
        except OSError:
            raise self._died() from None

    def _died(self) -> DrawingError:
        self._process.join(LEAVING_S)
        words = " / ".join(self._process.last_words()[-3:])
        return DrawingError(
            f"the process that draws has died, status {self._process.code}: {words}"
        )
