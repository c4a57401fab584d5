"""Earlier results are never replaced unless that is asked for."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from studio.cli import main
from studio.verbs.flags.results import add_result_flags, result_folder

pytestmark = pytest.mark.usefixtures("no_display", "no_traceback")


def folder(default, *words):
    parser = argparse.ArgumentParser()
    add_result_flags(parser, default)
    return result_folder(parser.parse_args(words), default)


def test_without_out_the_next_free_folder_is_taken(tmp_path):
    default = tmp_path / "rehearsal"
    assert folder(default) == default
    default.mkdir()
    assert folder(default) == default  # empty
    (default / "report.html").write_text("old")
    assert folder(default) == Path(f"{default}-2")
    Path(f"{default}-2").write_text("a file")
    assert folder(default) == Path(f"{default}-3")


@pytest.mark.parametrize("verb", [("rehearse", "lab"), ("live", "lab")])
def test_earlier_results_are_refused_with_the_remedy_before_any_work(verb, tmp_path, capsys):
    (tmp_path / "report.html").write_text("old")
    assert main([*verb, "--headless", "--out", str(tmp_path)]) == 3
    said = capsys.readouterr().err
    assert f"{tmp_path}: holds earlier results" in said
    assert "--replace" in said
    assert (tmp_path / "report.html").read_text() == "old"


def test_they_are_replaced_if_asked(tmp_path):
    (tmp_path / "report.html").write_text("old")
    assert folder(tmp_path, "--out", str(tmp_path), "--replace") == tmp_path
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match="which no rehearsal wrote"):
        folder(tmp_path, "--out", str(tmp_path), "--replace")
