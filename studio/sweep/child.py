"""One run of a sweep in a process of its own, on a few cores: what dies there takes nothing along.

`python -m studio.sweep.child` reads a run as one line of JSON and answers with one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from scenes.workers.child_process import ChildProcess, module_command, module_environment
from scenes.workers.parent import end_with_parent
from studio.session.pipeline import CancelledError
from studio.sweep.plan import Run

POLL_S = 0.1
"""How long it may take until a run is ended after it was cancelled, seconds."""

STDIN = 0
LAST_WORDS = 300
"""Characters of a dead process's last words that are shown."""


class RunDiedError(OSError):
    """The process of a run ended without an answer: killed, or out of memory."""


class RunRefusedError(ValueError):
    """A run cannot be played, now or later: its input is wrong."""


def play_in_child(
    run: Run, *, cores: Sequence[int] = (), cancelled: threading.Event | None = None
) -> dict[str, Any]:
    """Play a run as `studio.sweep.play.play`, in a process of its own.

    Args:
        run: what to play.
        cores: those that the process may use, where the system can hold it to them; all if empty.
        cancelled: set it from another thread to end the process.

    Raises:
        RunDiedError: the process ended without an answer.
        RunRefusedError: the run's input is wrong.
        CancelledError: it was cancelled.
    """
    order = json.dumps({"run": asdict(run), "cores": list(cores)})
    with tempfile.TemporaryFile() as answer, tempfile.TemporaryFile() as said:
        process = ChildProcess(
            module_command("studio.sweep.child"),
            stdin=subprocess.PIPE,
            stdout=answer,
            stderr=said,
            environment=module_environment(),
        )
        try:
            # The pipe stays open: the child ends when nobody holds the other end any more.
            process.say(order)
            _wait(process, cancelled or threading.Event())
        except BrokenPipeError:
            process.wait()
        finally:
            code = process.end()
        return _answer(run, code, _content(answer), _content(said))


def _wait(process: ChildProcess, cancelled: threading.Event) -> None:
    while process.code is None:
        if cancelled.is_set():
            raise CancelledError
        process.wait(POLL_S)


def _content(file: Any) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")


def _answer(run: Run, code: int, answer: str, said: str) -> dict[str, Any]:
    lines = answer.splitlines()
    if code != 0 or not lines:
        words = " ".join(said.split())[-LAST_WORDS:]
        raise RunDiedError(f"run {run.name}: its process ended with code {code}: {words}")
    values: dict[str, Any] = json.loads(lines[-1])
    if "refused" in values:
        raise RunRefusedError(f"run {run.name}: {values['refused']}")
    return values


def _main() -> None:
    # Unbuffered: a thread that waits inside a buffered reader keeps the interpreter from ending.
    with open(STDIN, "rb", buffering=0, closefd=False) as pipe:
        order = json.loads(pipe.readline())
    if order["cores"] and hasattr(os, "sched_setaffinity"):
        # Everything that starts threads later (kernels, OpenGL, codec) counts these cores.
        os.sched_setaffinity(0, order["cores"])
    end_with_parent()
    from studio.sweep.play import play

    values = order["run"]
    try:
        found = play(Run(**{**values, "methods": tuple(values["methods"])}))
    except (ValueError, OSError) as error:
        found = {"refused": " ".join(str(error).split())}
    sys.stdout.write("\n" + json.dumps(found, allow_nan=False) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    _main()
