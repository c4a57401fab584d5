"""What the steps of an operator's day are measured by: a project, checks, delays, a bump."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import numpy as np

from scenes.pose import Pose, rotation_angle
from studio.app.measure.process import BEGIN
from studio.app.measure.shown import has_picture, shown_window
from studio.console.rows import Row, at_least, at_most

OPEN_BAR_S, CHECK_BAR_S = 10.0, 30.0
DELAY_BAR_MS = 1000.0
"""Median from a movement to the twin, on processor cores alone."""

MOVED_M, SEEN_BAR_S = 0.05, 2.0
"""An object moved if it is shown farther than this from where it lies; a bump is to be seen by."""

BUMP_S, BUMPED_SESSION_S = 2.0, 6.0
BUMPS = {"": (0.6, 0.5), ".strong": (2.0, 3.0)}
"""Degrees and centimetres by the rows' names: as usual (`sim.faults.bump`), and a hard knock."""

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


def project(folder: Path) -> list[Row]:
    """O1, O2: a project opens as it was left; one button looks at everything."""
    from studio.app.model.document import Document, Marker
    from studio.app.model.document_file import load_document, save_document
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
    from studio.app.model.document import Document

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
    for name, (deg, cm) in BUMPS.items():
        path = folder / f"bumped{name}.toml"
        text = BUMPED.format(seconds=BUMPED_SESSION_S, at_s=BUMP_S, deg=deg, cm=cm)
        path.write_text(text, encoding="utf-8")
        thrown, first_s = _after_a_bump(path, deg)
        rows += [
            at_most(f"studio.O6{name}.objects_thrown", thrown, "", bar=0),
            at_most(f"studio.O6{name}.seen_after_s", first_s, "s", bar=SEEN_BAR_S),
        ]
    return rows


def _after_a_bump(scenario: Path, deg: float) -> tuple[int, float]:
    """Objects that were shown elsewhere, and when half of the camera's turn was known, seconds."""
    from studio.session.opening import open_session
    from studio.session.plan import SessionPlan
    from studio.session.session import SessionOutput

    session = open_session(SessionPlan(scenario=str(scenario), methods=("own",), seed=1))
    lies = {item.object_id: item.world_from_object for item in session.scene.objects}
    thrown: set[str] = set()
    poses: list[tuple[float, Pose]] = []

    def watch(output: SessionOutput) -> None:
        for track in output.shown.objects:
            away = track.world_from_object.translation - lies[track.object_id].translation
            if float(np.linalg.norm(away)) > MOVED_M:
                thrown.add(track.object_id)
        if output.shown.world_from_rig is not None:
            poses.append((output.input.frame.t_ns / 1e9, output.shown.world_from_rig))

    session.run(watch)
    before = [pose for t_s, pose in poses if t_s < BUMP_S]
    if not before:
        return len(thrown), BUMPED_SESSION_S
    turned = (
        (t_s - BUMP_S, np.degrees(rotation_angle((before[-1].inverse() @ pose).rotation)))
        for t_s, pose in poses
        if t_s >= BUMP_S
    )
    first_s = next((t_s for t_s, angle in turned if angle > 0.5 * deg), BUMPED_SESSION_S)
    return len(thrown), first_s
