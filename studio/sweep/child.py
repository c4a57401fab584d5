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
from pathlib import Path
from typing import Any

import studio
from studio.session.pipeline import CancelledError
from studio.sweep.plan import Run

ROOT = Path(studio.__file__).resolve().parents[1]
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
    """What `studio.sweep.play.play` gives, from a process of its own.

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
    path = os.pathsep.join(p for p in (str(ROOT), os.environ.get("PYTHONPATH", "")) if p)
    with tempfile.TemporaryFile() as answer, tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "studio.sweep.child"],
            stdin=subprocess.PIPE,
            stdout=answer,
            stderr=said,
            env={**os.environ, "PYTHONPATH": path},
        )
        try:
            assert process.stdin is not None
            # The pipe stays open: the child ends when nobody holds the other end any more.
            process.stdin.write(order.encode() + b"\n")
            process.stdin.flush()
            _wait(process, cancelled or threading.Event())
        except BrokenPipeError:
            process.wait()
        finally:
            process.kill()
            process.wait()
        return _answer(run, process.returncode, _content(answer), _content(said))


def _wait(process: subprocess.Popen[bytes], cancelled: threading.Event) -> None:
    while process.poll() is None:
        if cancelled.is_set():
            raise CancelledError
        try:
            process.wait(POLL_S)
        except subprocess.TimeoutExpired:
            continue


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
    threading.Thread(target=_end_with_parent, daemon=True).start()
    from studio.sweep.play import play

    values = order["run"]
    try:
        found = play(Run(**{**values, "methods": tuple(values["methods"])}))
    except (ValueError, OSError) as error:
        found = {"refused": " ".join(str(error).split())}
    sys.stdout.write("\n" + json.dumps(found, allow_nan=False) + "\n")
    sys.stdout.flush()


def _end_with_parent() -> None:
    while os.read(STDIN, 4096):
        pass
    os._exit(1)


if __name__ == "__main__":
    _main()
