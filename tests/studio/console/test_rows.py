"""Rows: verdicts, the table, the JSON object and the exit code."""

import json
import math

from studio.console.rows import Row, as_json, as_table, at_least, at_most, exit_code


def test_verdicts():
    assert at_most("a", 1.0, "ms", bar=1.0).passed is True
    assert at_most("a", 1.1, "ms", bar=1.0).passed is False
    assert at_most("a", math.nan, "ms", bar=1.0).passed is False
    assert at_most("a", 1.1, "ms").passed is None
    assert at_least("a", 1.0, "x", bar=1.0).passed is True
    assert at_least("a", 0.9, "x", bar=1.0).passed is False


def test_one_missed_bar_fails_the_run():
    good, open_ended, bad = (
        Row("a", 1.0, "", bar=2.0, passed=True),
        Row("b", 1.0, ""),
        Row("c", 3.0, "", bar=2.0, passed=False),
    )
    assert exit_code([]) == 0
    assert exit_code([good, open_ended]) == 0
    assert exit_code([good, bad, open_ended]) == 1


def test_json_has_the_stated_keys_and_only_plain_values():
    rows = [Row("a.b", math.nan, "cm", spread=math.inf), at_most("c", 1.0, "ms", bar=2.0)]
    report = json.loads(json.dumps(as_json("bench raster", rows, seed=3), allow_nan=False))
    assert set(report) == {"verb", "version", "machine", "seed", "rows"}
    wanted = {"cpu", "vectors", "cores", "memory_gib", "os", "python"}
    assert set(report["machine"]) == wanted
    assert report["machine"]["cores"] >= 1
    assert report["rows"][0] == {
        "name": "a.b",
        "value": None,
        "unit": "cm",
        "bar": None,
        "passed": None,
        "spread": None,
    }
    assert report["rows"][1]["passed"] is True
    assert report["seed"] == 3


def test_the_table_lines_up():
    rows = [
        Row("short", 1.23456, "ms", bar=2.0, passed=True, spread=0.5),
        Row("a.longer.name", 123456.0, "", bar=1.0, passed=False),
        Row("unmeasured", None, "cm"),
    ]
    lines = as_table(rows).splitlines()
    assert len(lines) == 5
    assert "1.235" in lines[2]
    assert "± 0.5" in lines[2]
    assert lines[2].endswith("pass")
    assert lines[3].endswith("FAIL")
    assert lines[4].split() == ["unmeasured", "-", "cm"]
    assert lines[2].index("ms") == lines[4].index("cm")
