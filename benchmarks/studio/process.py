"""A measurement in a process of its own: starts it, and reads what it printed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

BEGIN = "NEXUS_MEASURE_BEGIN"
"""Variable with the parent's monotonic clock when it started the process, seconds."""


def command(what: str, *rest: str) -> Sequence[str]:
    """The command line of a measurement of `benchmarks.studio.child`."""
    return [sys.executable, "-m", "benchmarks.studio.child", what, *rest]


def surroundings(temporary: Path) -> dict[str, str]:
    """The variables of a measurement's process: when it began, and its own temporary folder.

    Args:
        temporary: what it leaves there, however it ends, is the caller's to delete.
    """
    own = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(temporary))
    return {**os.environ, **own, BEGIN: repr(time.monotonic())}


def measured(what: str, *rest: str) -> dict[str, Any]:
    """Return the result of a measurement.

    Raises:
        subprocess.CalledProcessError: it crashed or failed.
    """
    with tempfile.TemporaryDirectory(prefix="nexus-measure-") as folder:
        done = subprocess.run(
            command(what, *rest),
            stdout=subprocess.PIPE,
            text=True,
            check=True,
            env=surroundings(Path(folder)),
        )
    return json.loads(done.stdout.splitlines()[-1])
