"""Names of live recordings: one a session, never over an earlier one."""

from __future__ import annotations

import time
from pathlib import Path


def recording_in(folder: Path) -> Path:
    """A new recording's path in a folder, named by the local time; nothing is made yet."""
    stem = time.strftime("live-%Y%m%d-%H%M%S")
    path = folder / f"{stem}.mcap"
    number = 2
    while path.exists() or path.with_name(path.name + ".part").exists():
        path = folder / f"{stem}-{number}.mcap"
        number += 1
    return path
