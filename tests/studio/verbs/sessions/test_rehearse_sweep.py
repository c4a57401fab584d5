"""`nexus rehearse --sweep`: what it is asked for, and what is refused before anything is played."""

from __future__ import annotations

import json

import pytest

from studio.cli import EXIT_DONE, EXIT_INPUT, main
from studio.sweep.plan import load_sweep

SWEEP = '[sweep]\nscenario = "lab-short"\n[faults]\nblur = { px = [1, 2] }\n'


@pytest.fixture
def asked(monkeypatch):
    seen = []

    def sweep(plan, target, *, progress, play):
        seen.append((plan, target, play))
        return [{"fault": "blur"}]

    monkeypatch.setattr("studio.sweep.sweep.sweep", sweep)
    return seen


def test_a_file_or_a_name_is_played_into_the_folder(asked, tmp_path, capsys):
    path = tmp_path / "s.toml"
    path.write_text(SWEEP)
    out = tmp_path / "out"
    line = ["rehearse", "lab", "--sweep", str(path), "--out", str(out), "--json"]
    assert main(line) == EXIT_DONE
    assert json.loads(capsys.readouterr().out)["rows"] == [{"fault": "blur"}]
    assert main(["rehearse", "--sweep", "lab-faults", "--cluster", "tcp://h:1"]) == EXIT_DONE
    (plan, target, here), (named, default, there) = asked
    assert plan.runs == load_sweep(str(path), "lab").runs
    assert (target, default.as_posix()) == (out, "out/sweep")
    assert len(named.runs) == 12
    assert here.__name__ == "play_here"
    assert there.keywords == {"address": "tcp://h:1"}


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--cluster", "tcp://h:1"], "--cluster plays sweeps only"),
        (["--sweep", "lab-faults", "--scenario", "lab-short"], "--scenario does not go with"),
        (["--sweep", "lab-faults", "--paced"], "--paced does not go with"),
        (["--sweep", "nothing-of-that-name"], "lab-faults"),
    ],
)
def test_what_cannot_be_played_is_one_line(asked, capsys, flags, words):
    assert main(["rehearse", "lab", *flags]) == EXIT_INPUT
    assert words in capsys.readouterr().err
    assert not asked
