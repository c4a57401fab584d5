"""The doctor names what is missing and what to do about it."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from studio.verbs import doctor


def test_a_wrong_and_an_absent_package_are_named_with_their_pin(tmp_path: Path) -> None:
    pins = tmp_path / "run.txt"
    pins.write_text(
        "numpy==0.0.1 \\\n    --hash=sha256:00\n"
        "no-such-package==1.0 \\\n    --hash=sha256:00\n"
        "pyobjc-core==13.0 ; sys_platform == 'darwin' \\\n"
    )

    (finding,) = doctor._packages(pins)

    assert finding.state == "missing"
    assert "(pinned 0.0.1)" in finding.detail
    assert "no-such-package absent (pinned 1.0)" in finding.detail
    assert "pyobjc" not in finding.detail, "packages of other systems are not ours to miss"
    assert finding.remedy == "./nexus setup"


def test_table_says_state_in_words_and_gives_the_remedy() -> None:
    table = doctor.as_table(
        [
            doctor.Finding("camera", "missing", "unplugged", "plug it in"),
            doctor.Finding("disk", "ok", "9 GiB"),
        ]
    )

    assert "missing" in table
    assert "→ plug it in" in table
    assert table.count("→") == 1


def test_json_lists_every_finding_and_exit_status_follows_missing_ones(capsys, monkeypatch) -> None:
    findings = [
        doctor.Finding("a", "ok", "fine"),
        doctor.Finding("b", "optional", "none", "maybe"),
    ]
    monkeypatch.setattr(doctor, "examine", lambda: iter(findings))
    parser = argparse.ArgumentParser()
    doctor.add_arguments(parser)

    status = doctor.run(parser.parse_args(["--json"]))

    printed = json.loads(capsys.readouterr().out)
    assert status == 0
    assert [f["subject"] for f in printed["findings"]] == ["a", "b"]

    findings.append(doctor.Finding("c", "missing", "gone", "find it"))
    assert doctor.run(parser.parse_args([])) == 1


def test_this_machine_can_draw_off_screen_and_encode_video() -> None:
    assert doctor._offscreen_drawing().state == "ok"
    assert doctor._h264().state == "ok"
