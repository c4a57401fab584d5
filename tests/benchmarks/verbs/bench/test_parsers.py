"""`nexus bench parsers`: every parser reads or refuses, and one that does neither is counted."""

import json

from benchmarks.wire import fuzz as fuzzing
from benchmarks.wire.fuzz import FuzzTarget
from studio.cli import main


def test_no_parser_fails_otherwise_than_by_a_refusal(capsys):
    assert main(["bench", "parsers", "--inputs", "20", "--json"]) == 0
    out, err = capsys.readouterr()
    assert [(row["name"], row["value"]) for row in json.loads(out)["rows"]] == [
        ("live.fuzz.crashes", 0)
    ]
    assert len(err.splitlines()) == len(fuzzing.targets())


def test_a_parser_that_fails_is_counted_and_named(monkeypatch, capsys):
    def read(data):
        raise IndexError("beyond the end")

    broken = {"fragile": FuzzTarget((b"bytes",), read, (ValueError,))}
    monkeypatch.setattr(fuzzing, "targets", lambda: broken)
    assert main(["bench", "parsers", "--parsers", "packets", "--inputs", "0"]) == 3
    assert "wanted at least 1" in capsys.readouterr().err
    monkeypatch.setattr("benchmarks.verbs.bench.parsers.targets", lambda: broken)
    assert main(["bench", "parsers", "--inputs", "5"]) == 1
    assert "fragile" in capsys.readouterr().err
