"""Checks before a session starts: each has a verdict and a remedy."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from scenes.formats.storage.atomic import write_file
from scenes.workers.task import Task
from studio.console import probes
from studio.console.display import why_no_window

Verdict = Literal["PASS", "WARN", "FAIL"]

LIMIT_S = 25.0
"""Seconds that all checks may take together; what has not answered by then has failed."""
CLOCK_STEP_LIMIT_S = 0.05
"""Seconds by which wall clock and monotonic clock may part while they are watched."""
CLOCK_WATCH_S = 0.2
"""Seconds that both clocks are watched: a clock that is being set jumps within it."""


@dataclass(frozen=True, slots=True)
class Check:
    """One line of the list.

    Attributes:
        name: what was looked at.
        verdict: PASS, WARN (a session can run all the same) or FAIL.
        what: what was found.
        fix: what to do; empty where there is nothing to do.
    """

    name: str
    verdict: Verdict
    what: str
    fix: str = ""


Probe = Callable[[], Check]


def checks_for(
    *, recordings: Path, source: Path | None = None, method: str = "own"
) -> Mapping[str, Probe]:
    """The checks of a session, by name.

    Args:
        recordings: folder that the recorder will write into.
        source: file that the pictures come from; None for the simulated camera.
        method: of the tracker.
    """
    folder = _existing(recordings)
    return {
        "camera": lambda: _camera(source),
        "tracker": lambda: _tracker(method),
        "disk space": lambda: _found("disk space", probes.disk(folder)),
        "clock": _clock,
        "recordings": lambda: _writable(recordings),
        "OpenGL": lambda: _found("OpenGL", probes.offscreen_drawing()),
        "splat engine": lambda: _found("splat engine", probes.native()),
        "memory": lambda: _found("memory", probes.memory()),
        "display": _display,
    }


def run_checks(probes_by_name: Mapping[str, Probe], *, limit_s: float = LIMIT_S) -> list[Check]:
    """All checks at once, in their order; never raises, never takes longer than the limit.

    Args:
        probes_by_name: what makes each check.
        limit_s: seconds that they have together.
    """
    checks = {name: _begun(name, probe) for name, probe in probes_by_name.items()}
    deadline = time.monotonic() + limit_s
    for check in checks.values():
        check.join(max(deadline - time.monotonic(), 0.0))
    return [
        check.result
        or Check(name, "FAIL", f"no answer in {limit_s:.0f} s", f"unplug and plug in the {name}")
        for name, check in checks.items()
    ]


def save_checks(checks: list[Check], path: Path) -> None:
    """Write the checks as JSON, whole or not at all.

    Raises:
        WriteError: the folder cannot be written into.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    values = {"t_ns": time.time_ns(), "checks": [asdict(check) for check in checks]}
    write_file(path, [json.dumps(values, indent=2).encode()])


def worst(checks: list[Check]) -> Verdict:
    """The verdict on the whole: that of the worst check."""
    verdicts = {check.verdict for check in checks}
    return "FAIL" if "FAIL" in verdicts else "WARN" if "WARN" in verdicts else "PASS"


def _begun(name: str, probe: Probe) -> Task[Check]:
    return Task(f"check {name}", lambda _: _answer(name, probe)).start()


def _answer(name: str, probe: Probe) -> Check:
    try:
        check = probe()
    except Exception as error:  # noqa: BLE001 - a device may fail in any way; the user gets a line
        reason = " ".join(str(error).split()) or type(error).__name__
        return Check(name, "FAIL", reason, f"plug in the {name} again, then check again")
    return Check(name, check.verdict, check.what, check.fix)


def _found(name: str, finding: probes.Finding) -> Check:
    verdicts: dict[str, Verdict] = {"ok": "PASS", "optional": "WARN", "missing": "FAIL"}
    return Check(name, verdicts[finding.state], finding.detail, finding.remedy)


def _camera(source: Path | None) -> Check:
    if source is None:
        return Check("camera", "PASS", "simulated")
    if not source.is_file():
        fix = "connect it, or choose another file"
        return Check("camera", "FAIL", f"{source.name} is not there", fix)
    if source.stat().st_size == 0:
        return Check("camera", "FAIL", f"{source.name} is empty", "record it again")
    return Check("camera", "PASS", f"file {source.name}")


def _tracker(method: str) -> Check:
    from studio.session.trackers.methods import METHODS

    if method in METHODS:
        return Check("tracker", "PASS", method)
    fix = f"choose one of {', '.join(METHODS)}"
    return Check("tracker", "FAIL", f"there is no tracker {method!r}", fix)


def _clock() -> Check:
    wall, steady = time.time(), time.monotonic()
    time.sleep(CLOCK_WATCH_S)
    step_s = abs((time.time() - wall) - (time.monotonic() - steady))
    if step_s > CLOCK_STEP_LIMIT_S:
        fix = "wait until the system has set its clock, then check again"
        return Check("clock", "WARN", f"jumped by {1000 * step_s:.0f} ms", fix)
    return Check("clock", "PASS", f"steady to {1000 * step_s:.1f} ms")


def _writable(folder: Path) -> Check:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"0" * 4096)
    except OSError as error:
        fix = "choose a folder that you may write into"
        return Check("recordings", "FAIL", f"{folder}: {error.strerror}", fix)
    return Check("recordings", "PASS", str(folder))


def _display() -> Check:
    reason = why_no_window()
    if reason is None:
        return Check("display", "PASS", "answers")
    return Check("display", "WARN", reason, "needed by windows only")


def _existing(folder: Path) -> Path:
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder
