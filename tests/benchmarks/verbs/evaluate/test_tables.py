import importlib
import json

import pytest

from benchmarks.evaluate.findings import Drawing, Findings
from benchmarks.verbs.evaluate import tables
from studio.cli import EXIT_DONE, EXIT_FAILED, EXIT_INPUT, EXIT_USAGE, main
from studio.console.rows import Row, at_most


@pytest.fixture
def one_table(monkeypatch):
    """Replaces the room's evaluation; returns what it was asked."""
    asked = []

    def evaluate_room(what):
        asked.append(what)
        return Findings(
            rows=[at_most("room.world_cm.mean", 3.0, "cm", bar=2.0), Row("paper.room.x", 1.0, "")],
            text=["the table"],
            drawings=[Drawing("room", lambda figure: figure.add_subplot().plot([0, 1]))],
        )

    module = importlib.import_module("benchmarks.evaluate.tables.paper_tables")
    monkeypatch.setattr(module, "room", evaluate_room)
    return asked


@pytest.mark.parametrize("name", tables.TABLES)
def test_every_table_has_its_function(name):
    table = tables.TABLES[name]
    module = importlib.import_module(f"benchmarks.evaluate.tables.{table.module}")
    assert callable(getattr(module, table.function))
    assert 1 <= table.seeds <= table.published_seeds


def test_a_missed_bar_fails_and_the_table_is_printed(one_table, capsys):
    assert main(["evaluate", "room"]) == EXIT_FAILED
    printed = capsys.readouterr().out
    assert "the table" in printed
    assert "FAIL" in printed
    assert one_table[0].methods == ("own",)
    assert one_table[0].seeds == (0,)
    assert one_table[0].conditions.pose_error_deg == 0.5


def test_json_says_methods_seeds_and_machine(one_table, capsys):
    main(["evaluate", "room", "--method", "paper", "--seeds", "3", "--json", "--noise", "0"])
    values = json.loads(capsys.readouterr().out)
    assert values["methods"] == ["own", "paper"]
    assert values["seeds"] == 3
    assert values["machine"]["cores"] >= 1
    assert [row["name"] for row in values["rows"]] == ["room.world_cm.mean", "paper.room.x"]
    assert one_table[0].seeds == (0, 1, 2)
    assert one_table[0].conditions.noise == 0


@pytest.mark.usefixtures("one_table")
def test_plots_say_what_was_run(tmp_path):
    main(["evaluate", "room", "--plot", str(tmp_path)])
    assert {path.name for path in tmp_path.iterdir()} == {"room.png", "room.svg"}
    assert "nexus evaluate room · own · 1 seed" in (tmp_path / "room.svg").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--seeds", "0"], "--seeds 0: wanted 1 to 100"),
        (["--lens-px", "481"], "--lens-px 481: wanted an even number"),
        (["--lens-px", "16"], "--lens-px 16: wanted 64 to 4096"),
        (["--noise", "-1"], "--noise -1: wanted 0 to 20"),
        (["--bitrate-mbps", "0"], "--bitrate-mbps 0: wanted 0.5 to 400"),
    ],
)
def test_nonsense_is_refused_before_anything_is_filmed(words, said, one_table, capsys):
    assert main(["evaluate", "room", *words]) == EXIT_INPUT
    assert said in capsys.readouterr().err
    assert one_table == []


def test_an_unknown_table_is_a_usage_error(capsys):
    assert main(["evaluate", "kitchen"]) == EXIT_USAGE
    assert "room" in capsys.readouterr().err


def test_help_lists_every_table(capsys):
    assert main(["evaluate", "--help"]) == EXIT_DONE
    printed = capsys.readouterr().out
    assert all(name in printed for name in tables.TABLES)
