"""`nexus simulate hololens` as a person starts it."""

from __future__ import annotations

import json

from studio.cli import main


def test_it_says_where_it_listens_and_what_it_did(capsys):
    assert main(["simulate", "hololens", "lab", "--any-ports", "--seconds", "0.5", "--json"]) == 0
    started, ended = map(json.loads, capsys.readouterr().out.splitlines())
    assert started["event"] == "started"
    assert started["host"] == "127.0.0.1"
    assert set(started["ports"]) == {"configuration", "video", "body", "surfaces", "display"}
    assert all(port > 0 for port in started["ports"].values())
    assert ended["ports"]["video"]["connections"] == 0


def test_a_fault_that_is_none_is_said(capsys):
    assert main(["simulate", "hololens", "lab", "--fault", "flood"]) != 0
    assert "wanted one of delay" in capsys.readouterr().err
