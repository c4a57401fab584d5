"""`nexus bench hub`: a crowd's figures as rows, and hostile streams counted."""

import json

import pytest

from benchmarks.verbs.bench.hub import load_rows
from benchmarks.wire.crowd import CrowdFigures
from benchmarks.wire.hub_load import LoadFigures
from studio.cli import main


def figures(p95=5.0, publish=0.1, growth=1.0):
    crowd = CrowdFigures(100, 270, 50, 10, 2, [1.0, p95, 9.0, 20.0])
    return LoadFigures(crowd, 30.0, growth, (0.01, publish), (1.0, 2.0), 5_000_000, 3, 0)


def test_rows_are_held_to_their_bars():
    rows = {row.name: row for row in load_rows(figures(), 4)}
    assert rows["hub.body_to_client_ms.p95"].passed
    assert rows["hub.bodies_left_out_percent"].value == pytest.approx(10.0)
    assert rows["hub.late_bodies_percent"].value == 2.0
    assert rows["hub.sent_mb"].value == 5.0
    bad = [row.name for row in load_rows(figures(21.0, 1.5, 6.0), 4) if row.passed is False]
    assert bad == [
        "hub.body_to_client_ms.p95",
        "hub.rss_growth_percent",
        "hub.publish_ms.p99",
    ]


def test_the_verb_measures_and_counts(capsys):
    words = ["bench", "hub", "--clients", "2", "--hz", "20", "--seconds", "1", "--streams", "60"]
    main([*words, "--json"])
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)["rows"]}
    assert rows["live.hub_fuzz.crashes"]["value"] == 0


@pytest.mark.parametrize("word", [["--clients", "1"], ["--seconds", "0"], ["--hz", "0"]])
def test_what_makes_no_sense_is_refused(word, capsys):
    assert main(["bench", "hub", *word]) == 3
    assert "wanted --clients" in capsys.readouterr().err
