"""A measurement in a process of its own: starts it, and reads what it printed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

BEGIN = "NEXUS_MEASURE_BEGIN"
"""Variable with the parent's monotonic clock when it started the process, seconds."""


def command(what: str, *rest: str) -> Sequence[str]:
    """The command line of a measurement of `studio.app.measure.child`."""
    return [sys.executable, "-m", "studio.app.measure.child", what, *rest]


def measured(what: str, *rest: str) -> dict[str, Any]:
    """What a measurement found.

    Raises:
        subprocess.CalledProcessError: it crashed or failed.
    """
    done = subprocess.run(
        command(what, *rest),
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        env={**os.environ, BEGIN: repr(time.monotonic())},
    )
    return json.loads(done.stdout.splitlines()[-1])
