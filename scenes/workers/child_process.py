"""A process that ends with whoever started it: lines from it, its last words, its end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from io import BufferedIOBase
from pathlib import Path
from typing import IO, cast

from scenes.workers.task import Task

ROOT = Path(__file__).parents[2]
"""Folder of the program's packages."""

Stream = int | IO[bytes]
"""A descriptor, an open file, or `subprocess.PIPE` and its like."""


def module_command(module: str, *words: str) -> list[str]:
    """Return the command that runs a module with this Python."""
    return [sys.executable, "-m", module, *words]


def module_environment() -> dict[str, str]:
    """Return this process's environment, in which a child finds the program's packages."""
    path = os.pathsep.join(p for p in (str(ROOT), os.environ.get("PYTHONPATH", "")) if p)
    return {**os.environ, "PYTHONPATH": path}


class ChildProcess:
    """A running process; any thread may ask.

    A child of this program notices its parent's death at the end of its standard input, see
    `scenes.workers.parent`.

    Args:
        command: what is run.
        stdin: `subprocess.PIPE` for `say` and `stdin`.
        stdout: where it prints to; not used where `on_line` is given.
        stderr: likewise, where `last_words` is above 0; None for this process's own.
        on_line: takes each line that it prints, without its end, on a thread.
        last_words: lines of what it says on stderr that are kept.
        has_group: whether it, and what it starts, are ended together.
        environment: its own; None for this process's.
        creation_flags: of Windows.

    Raises:
        OSError: it cannot be started.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        stdin: Stream = subprocess.DEVNULL,
        stdout: Stream = subprocess.DEVNULL,
        stderr: Stream | None = None,
        on_line: Callable[[str], None] | None = None,
        last_words: int = 0,
        has_group: bool = False,
        environment: Mapping[str, str] | None = None,
        creation_flags: int = 0,
    ) -> None:
        self._has_group = has_group and os.name == "posix"
        self._last_words: deque[str] = deque(maxlen=last_words)
        self._process = subprocess.Popen(
            command,
            stdin=stdin,
            stdout=stdout if on_line is None else subprocess.PIPE,
            stderr=subprocess.PIPE if last_words else stderr,
            start_new_session=self._has_group,
            env=environment,
            creationflags=creation_flags,
        )
        self._readers: list[Task[None]] = []
        if on_line is not None:
            self._read_lines("lines", self._process.stdout, on_line)
        if last_words:
            self._read_lines("last words", self._process.stderr, self._last_words.append)

    @property
    def process_id(self) -> int:
        """Number that the system gives it."""
        return self._process.pid

    @property
    def code(self) -> int | None:
        """Exit status, negative for the signal that ended it; None while it runs."""
        return self._process.poll()

    @property
    def is_running(self) -> bool:
        """Whether it is at work, or not all that it said has been read."""
        return self.code is None or any(reader.is_running for reader in self._readers)

    @property
    def stdin(self) -> BufferedIOBase:
        """Pipe to it."""
        assert self._process.stdin is not None, "started without a pipe to it"
        return cast(BufferedIOBase, self._process.stdin)

    @property
    def stdout(self) -> BufferedIOBase:
        """Pipe from it."""
        assert self._process.stdout is not None, "started without a pipe from it"
        return cast(BufferedIOBase, self._process.stdout)

    def last_words(self) -> list[str]:
        """Return the last lines that it has said on stderr."""
        return list(self._last_words)

    def say(self, line: str) -> None:
        """Write one line to it.

        Raises:
            OSError: it is gone.
        """
        self.stdin.write(f"{line}\n".encode())
        self.stdin.flush()

    def wait(self, timeout_s: float | None = None) -> int | None:
        """Wait for its end; return its exit status, None where it still runs.

        Args:
            timeout_s: longest wait, seconds; None for no limit.
        """
        with suppress(subprocess.TimeoutExpired):
            return self._process.wait(timeout_s)
        return None

    def join(self, timeout_s: float) -> bool:
        """Wait for its end and its last words; return whether it has ended.

        Args:
            timeout_s: longest wait for each of them, seconds.
        """
        if self.wait(timeout_s) is None:
            return False
        for reader in self._readers:
            reader.join(timeout_s)
        return True

    def cancel(self) -> None:
        """Ask it to end, without waiting for it."""
        self._send(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once, without waiting for it."""
        self._send(signal.SIGKILL if os.name == "posix" else signal.SIGTERM)

    def end(self, patience_s: float = 0.0) -> int:
        """End it and wait until it is gone; return its exit status. Harmless when it is gone.

        Args:
            patience_s: seconds that it has to end by itself once it was asked; 0 to kill it.
        """
        if patience_s > 0:
            self.cancel()
        if self.wait(patience_s) is None:
            self.kill()
        return self._process.wait()

    def _send(self, number: int) -> None:
        if self.code is not None:
            return
        if self._has_group:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, number)
        else:
            self._process.send_signal(number)

    def _read_lines(
        self, what: str, stream: IO[bytes] | None, on_line: Callable[[str], None]
    ) -> None:
        assert stream is not None

        def read(_task: Task[None]) -> None:
            with stream:
                for line in stream:
                    on_line(line.decode(errors="replace").rstrip("\r\n"))

        self._readers.append(Task(f"{what} of {self._process.pid}", read).start())
