"""`nexus bench sites`: a small building run for a moment, and words that make no sense."""

import importlib.util
import json

import pytest

from studio.cli import main


@pytest.mark.skipif(importlib.util.find_spec("zenoh") is None, reason="no eclipse-zenoh")
@pytest.mark.slow
def test_the_verb_measures_and_reckons(capsys):
    words = ["--rooms", "2", "--clients", "1", "--hz", "20", "--seconds", "1"]
    main(["bench", "sites", *words, "--reckon", "100", "10", "--json"])
    out, err = capsys.readouterr()
    rows = {row["name"]: row["value"] for row in json.loads(out)["rows"]}
    assert rows["sites.2x1.room_kb_s"] > 0
    assert rows["sites.2x1.client_kb_s"] > 0
    assert rows["sites.reckoned_100x10.routers"] >= 1
    assert "the bottleneck is the" in err


@pytest.mark.parametrize("word", [["--clients", "0"], ["--seconds", "0"], ["--rooms", "99"]])
def test_what_makes_no_sense_is_refused(word, capsys):
    assert main(["bench", "sites", *word]) == 3
    assert "wanted --" in capsys.readouterr().err
