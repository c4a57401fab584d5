"""The end report: its page opens, its numbers are the session's, and a stopped recording shows."""

from __future__ import annotations

import json
from dataclasses import replace

from studio.live.report import HISTOGRAM_MS, histogram, live_rows, write_report
from studio.session.preflight import Check


def test_a_session_s_report(live):
    session = live.session()
    played = live.run(session)
    live.push(session)
    live.until(lambda: session.status().frames >= 15)
    session.end()
    played.thread.join(120)
    result = played.result
    rows = live_rows(result)
    checks = [Check("camera", "WARN", "<dark>", "light on")]
    page = write_report(live.folder / "out", result, rows, scene="tiny", checks=checks)
    text = page.read_text(encoding="utf-8")
    assert "&lt;dark&gt;" in text
    assert "the session is live" in text
    values = json.loads((live.folder / "out" / "live.json").read_text())
    named = {row["name"]: row["value"] for row in values["rows"]}
    assert named["live.frames"] == result.session.frames
    assert named["live.camera.connections"] == 1
    assert values["recording"] == "live.mcap"
    counted = histogram(result)
    assert len(counted) == len(HISTOGRAM_MS) - 1
    assert sum(count for _, count, _ in counted) == result.session.frames - 1

    stopped = replace(result, recording_failure="recording stopped: the disk is full")
    page = write_report(live.folder / "out", stopped, rows, scene="tiny")
    assert "the disk is full" in page.read_text(encoding="utf-8")
