"""Measures of an operator's day: a project, checks, delays, a bump."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.studio.process import BEGIN
from benchmarks.studio.shown import has_picture, shown_window
from scenes.pose import Pose, rotation_angle
from studio.console.rows import Row, at_least, at_most
from tracking.output import CameraMoment, TrackOutput

OPEN_BAR_S, CHECK_BAR_S = 10.0, 30.0
DELAY_BAR_MS = 1000.0
"""Median from a movement to the twin, on processor cores alone."""

MOVED_M, SEEN_BAR_S = 0.05, 2.0
"""An object moved if it is shown farther than this from where it lies; a bump is to be seen by."""

BUMP_S, BUMPED_SESSION_S = 2.0, 6.0
BUMPS = {"": (0.6, 0.5), ".slight": (0.3, 0.0), ".strong": (2.0, 3.0), ".hardest": (3.0, 5.0)}
"""Degrees and centimetres by the rows' names: as usual (`sim.faults.device`), and lighter and
harder ones. Before two of them a chair is being pushed, and the light changes with the bump."""

STILL_M = 1e-3
"""What truly moved by less lies still."""

SHIFTED_BAR_CM = 5.0
"""Farthest that an object at rest may be shown from where it was shown before a bump."""

LIVE = """# A chair is pushed before a small camera, in real time.
room = "lab"
duration_s = 12.0

[camera]
fps = 5
lens_size_px = 360
bitrate_mbps = 2.0

[[people]]
id = "local-user"
start = [-1.25, 1.5]
facing_deg = -40.0
actions = [{ do = "push", object = "chair-1", to = [-0.45, 0.4] }]
"""
BUMPED = """# Somebody bumps into the camera; nobody touches an object.
room = "lab"
duration_s = {seconds}

[camera]
fps = 5
lens_size_px = 480
bitrate_mbps = 6.0

[faults]
bump_s = {at_s}
bump_deg = {deg}
bump_cm = {cm}
"""
BUSY = """
[faults.exposure]
from_s = {at_s}
ev = -0.5

[[people]]
id = "local-user"
start = [-1.25, 1.5]
facing_deg = -40.0
actions = [{{ do = "push", object = "chair-1", to = [-0.45, 0.4] }}]
"""


def project(folder: Path) -> list[Row]:
    """O1, O2: a project opens as it was left; one button looks at everything."""
    from studio.app.model.documents.document import Document, Marker
    from studio.app.model.documents.document_file import load_document, save_document
    from studio.session.preflight import checks_for, run_checks, save_checks

    path = folder / "tomorrow.nexus"
    save_document(Document("lab", markers=(Marker(5, "door"),)), path)
    window, wait = shown_window(load_document(path), home=folder / "home")
    wait(lambda: window.is_filled and has_picture(window))
    opened_s = time.monotonic() - float(os.environ[BEGIN])
    markers = len(window.bench.document.markers)
    window.close()
    begin = time.monotonic()
    checks = run_checks(checks_for(recordings=folder))
    save_checks(checks, folder / "preflight.json")
    checked_s = time.monotonic() - begin
    saved = json.loads((folder / "preflight.json").read_text(encoding="utf-8"))["checks"]
    unfixed = [c for c in saved if c["verdict"] != "PASS" and not c["fix"]]
    return [
        at_most("studio.O1.open_s", opened_s, "s", bar=OPEN_BAR_S),
        at_least("studio.O1.markers", markers, "", bar=1),
        at_most("studio.O2.check_s", checked_s, "s", bar=CHECK_BAR_S),
        at_least("studio.O2.checks", len(saved), "", bar=6),
        at_most("studio.O2.without_a_fix", len(unfixed), "", bar=0),
    ]


def live(folder: Path) -> list[Row]:
    """O5: a simulated camera in real time; from a frame's capture to the twin."""
    from studio.app.model.documents.document import Document

    document = Document("lab", scenario_name="live", scenario=LIVE)
    window, wait = shown_window(document, home=folder / "home")
    wait(lambda: window.is_filled and has_picture(window))
    window.bench.perform("session.rehearse", paced=True)
    delays_ms: dict[int, float] = {}

    def is_over() -> bool:
        output = window.run.output
        if output is not None:
            frame = output.input.frame
            delays_ms[frame.seq] = 1e-6 * (output.now_ns - frame.t_ns)
        return not window.run.is_playing

    wait(is_over)
    session = None if window.run.job is None else window.run.job.session
    stages = () if session is None else session.latencies.stages()
    window.close()
    # The first frames wait for libraries and for the search of all objects.
    settled = list(delays_ms.values())[len(delays_ms) // 3 :]
    p50_ms, p95_ms = np.quantile(settled, [0.5, 0.95]).tolist()
    return [
        at_most("studio.O5.delay_ms.p50", p50_ms, "ms", bar=DELAY_BAR_MS),
        Row("studio.O5.delay_ms.p95", p95_ms, "ms"),
        at_least("studio.O5.stages", len(stages), "", bar=4),
    ]


def bumped(folder: Path) -> list[Row]:
    """O6: the camera is bumped; objects that lie still are shown where they lie."""
    rows: list[Row] = []
    found: list[AfterBump] = []
    for number, (name, (deg, cm)) in enumerate(BUMPS.items()):
        path = folder / f"bumped{name}.toml"
        text = BUMPED.format(seconds=BUMPED_SESSION_S, at_s=BUMP_S, deg=deg, cm=cm)
        busy = BUSY.format(at_s=BUMP_S) if number % 2 else ""
        path.write_text(text + busy, encoding="utf-8")
        after = _after_a_bump(path, deg)
        found.append(after)
        rows += [
            at_most(f"studio.O6{name}.objects_thrown", len(after.thrown), "", bar=0),
            at_most(f"studio.O6{name}.seen_after_s", after.followed_s, "s", bar=SEEN_BAR_S),
        ]
    noticed_s = max(after.noticed_s for after in found)
    moved_cm = max(after.moved_cm for after in found)
    return [
        *rows,
        at_most("live.bump.noticed_s", noticed_s, "s", bar=SEEN_BAR_S),
        at_most("live.bump.moved_cm.max", moved_cm, "cm", bar=SHIFTED_BAR_CM),
    ]


@dataclass(frozen=True, slots=True)
class AfterBump:
    """Session after a bump, as it was seen.

    Attributes:
        thrown: objects at rest that were shown elsewhere than where they lie.
        followed_s: when half of the camera's turn was known, seconds after the bump.
        noticed_s: when the tracker said that the camera was bumped.
        moved_cm: farthest that an object at rest was shown from where it was before the bump.
    """

    thrown: frozenset[str]
    followed_s: float
    noticed_s: float
    moved_cm: float


def _after_a_bump(scenario: Path, deg: float) -> AfterBump:
    """A session with a bump, and what it showed after it."""
    from studio.session.opening import open_session
    from studio.session.plan import SessionPlan
    from studio.session.session import SessionOutput

    session = open_session(SessionPlan(scenario=str(scenario), methods=("own",), seed=1))
    outputs: list[tuple[float, TrackOutput, Mapping[str, Pose]]] = []

    def watch(output: SessionOutput) -> None:
        truth = output.message.truth
        if truth is not None:
            lies = truth.recorded.world_from_object
            outputs.append((output.input.frame.t_ns / 1e9, output.shown, lies))

    session.run(watch)
    return judged_bump(outputs, deg, at_s=BUMP_S, lasts_s=BUMPED_SESSION_S)


def judged_bump(
    outputs: Sequence[tuple[float, TrackOutput, Mapping[str, Pose]]],
    deg: float,
    *,
    at_s: float,
    lasts_s: float,
) -> AfterBump:
    """Judge a tracker's answers after a bump.

    Args:
        outputs: per frame its time in seconds, the answer, and where objects really are.
        deg: by how much the camera turned, degrees.
        at_s: when.
        lasts_s: given for what never came.
    """
    before = [output for output in outputs if output[0] < at_s]
    after = [output for output in outputs if output[0] >= at_s]
    if not before or before[-1][1].world_from_rig is None:
        return AfterBump(frozenset(), lasts_s, lasts_s, 0.0)
    _, last, lay = before[-1]
    first_rig = last.world_from_rig
    shown = {track.object_id: track.world_from_object for track in last.objects}
    resting = {
        name for name in lay if all(_apart_m(o[2][name], lay[name]) < STILL_M for o in after)
    }
    thrown: set[str] = set()
    followed_s, noticed_s, moved_m = lasts_s, lasts_s, 0.0
    for t_s, output, _ in after:
        for track in output.objects:
            if track.object_id not in resting:
                continue
            moved_m = max(moved_m, _apart_m(track.world_from_object, shown[track.object_id]))
            if _apart_m(track.world_from_object, lay[track.object_id]) > MOVED_M:
                thrown.add(track.object_id)
        if any(notice.moment is CameraMoment.BUMPED for notice in output.notices):
            noticed_s = min(noticed_s, t_s - at_s)
        if output.world_from_rig is not None and first_rig is not None:
            turned = first_rig.inverse() @ output.world_from_rig
            if np.degrees(rotation_angle(turned.rotation)) > 0.5 * deg:
                followed_s = min(followed_s, t_s - at_s)
    return AfterBump(frozenset(thrown), followed_s, noticed_s, 100.0 * moved_m)


def _apart_m(one: Pose, other: Pose) -> float:
    return float(np.linalg.norm(one.translation - other.translation))
