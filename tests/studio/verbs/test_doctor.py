"""The doctor names what is missing and what to do about it."""

from __future__ import annotations

import argparse
import json

from studio.console.probes import Finding
from studio.verbs import doctor


def test_table_says_state_in_words_and_gives_the_remedy() -> None:
    table = doctor.as_table(
        [
            Finding("camera", "missing", "unplugged", "plug it in"),
            Finding("disk", "ok", "9 GiB"),
        ]
    )

    assert "missing" in table
    assert "→ plug it in" in table
    assert table.count("→") == 1


def test_json_lists_every_finding_and_exit_status_follows_missing_ones(capsys, monkeypatch) -> None:
    findings = [
        Finding("a", "ok", "fine"),
        Finding("b", "optional", "none", "maybe"),
    ]
    monkeypatch.setattr(doctor, "examine", lambda: iter(findings))
    parser = argparse.ArgumentParser()
    doctor.add_arguments(parser)

    status = doctor.run(parser.parse_args(["--json"]))

    printed = json.loads(capsys.readouterr().out)
    assert status == 0
    assert [f["subject"] for f in printed["findings"]] == ["a", "b"]

    findings.append(Finding("c", "missing", "gone", "find it"))
    assert doctor.run(parser.parse_args([])) == 1
