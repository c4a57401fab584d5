"""`nexus compare`: exit codes, what is printed, and bad input."""

import json

import pytest

from studio.cli import main
from studio.verbs.sessions.compare import DEFAULT_OUT

pytestmark = pytest.mark.usefixtures("in_tiny_scene", "no_traceback")


def compare(a, b, out, *words):
    return main(["compare", str(a), str(b), "--out", str(out / "page.html"), *words])


def test_worse_is_exit_1_and_named(two_runs, tmp_path, capsys):
    assert compare(*two_runs, tmp_path) == 1
    out, err = capsys.readouterr()
    assert "figures got worse by more than 10 %" in out
    assert "rehearse.chairs.world_cm.mean: 3 → 5 cm" in out
    assert f"page: {tmp_path / 'page.html'}" in err
    assert (tmp_path / "page.html").is_file()


@pytest.mark.parametrize("words", [["--tolerance", "70%"], ["--tolerance", "0.7"]])
def test_within_the_tolerance_is_exit_0(two_runs, tmp_path, words):
    assert compare(*two_runs, tmp_path, *words) == 0


def test_better_and_the_same_are_exit_0(two_runs, tmp_path, capsys):
    a, b = two_runs
    assert compare(b, a, tmp_path) == 0
    assert compare(a, a, tmp_path, "--tolerance", "0") == 0
    assert "No figure got worse by more than 0 %" in capsys.readouterr().out


def test_json_holds_every_row(two_runs, tmp_path, capsys):
    assert compare(*two_runs, tmp_path, "--json") == 1
    values = json.loads(capsys.readouterr().out)
    assert values["verb"] == "compare"
    assert values["tolerance"] == 0.1
    rows = {row["name"]: row for row in values["rows"]}
    row = rows["rehearse.chairs.world_cm.mean"]
    assert (row["a"], row["b"]) == (pytest.approx(3.0), pytest.approx(5.0))
    assert row["worse"] is True
    assert rows["rehearse.frames"]["verdict"] == "same"


def test_what_is_no_run_is_one_line_and_exit_2(two_runs, tmp_path, capsys):
    assert compare(two_runs[0], tmp_path, tmp_path) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{tmp_path}: holds no report.json" in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("share", ["-1", "much", "nan", "2000%"])
def test_a_tolerance_that_is_no_share_is_one_line_and_exit_2(two_runs, tmp_path, capsys, share):
    assert compare(*two_runs, tmp_path, f"--tolerance={share}") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "wanted a share such as 10% or 0.1" in line


def test_a_folder_as_page_is_refused(two_runs, tmp_path, capsys):
    (tmp_path / "page.html").mkdir()
    assert compare(*two_runs, tmp_path) == 3
    assert "is a folder" in capsys.readouterr().err


def test_the_page_goes_beside_the_runs_by_default():
    assert DEFAULT_OUT.as_posix() == "out/compare.html"
