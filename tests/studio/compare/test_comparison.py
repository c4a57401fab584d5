"""Two folders read, held to be of one scene, and drawn."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from studio.compare.comparison import kinship, read_comparison, scenario_difference
from studio.compare.error_map import moved_objects
from studio.compare.floor_cells import CELL_M, mean_errors
from studio.compare.page import error_curves, headline, render_comparison, write_comparison
from studio.compare.run import what_is_missing


def test_a_run_is_read_as_it_was_played(compared, tiny):
    a, b = compared.a, compared.b
    assert (a.name, a.verb, a.scenario_names, a.fork_s) == ("A", "rehearse", "tiny-push", None)
    assert (b.name, b.scenario_names, b.fork_s) == ("B", "tiny-push → other", 0.5)
    assert a.frames_s == pytest.approx([seq / 10 for seq in range(tiny.frames)])
    assert a.events == ((300_000_000, "pushes chair 1"),)
    assert a.board.score(kind="chair").world_cm.mean == pytest.approx(3.0)
    assert b.board.score(kind="chair").world_cm.mean == pytest.approx(5.0)


def test_what_got_worse_is_found_and_said(compared):
    assert {row.name for row in compared.worse} >= {"rehearse.chairs.world_cm.mean"}
    assert all("world_cm" in row.name for row in compared.worse)
    assert headline(compared) == f"{len(compared.worse)} figures got worse by more than 10 %"


def test_a_fork_and_its_parent_are_recognised(compared):
    assert kinship(compared.a, compared.b) == "B is a fork of A: the same to the bit until 0.5 s"
    assert kinship(compared.b, compared.b) == (
        "A and B are forks of one recording: the same until 0.5 s"
    )
    assert kinship(compared.a, compared.a) == ""


def test_the_difference_of_the_scenarios_is_short(compared):
    lines = scenario_difference(compared.a, compared.b)
    assert [line for line in lines if line[0] in "+-"] == ["+[faults]", "+drop_share = 0.1"]
    assert scenario_difference(compared.a, compared.a) == []


def test_the_map_holds_the_error_where_the_objects_truly_were(compared, tiny):
    low, _high = tiny.scene.footprint_m
    values = mean_errors(compared.a.board, low, (16, 16))
    seen = {
        tuple(np.floor((s.true_world_from_object.translation[:2] - low) / CELL_M).astype(int)[::-1])
        for s in compared.a.board.samples("chair-1")
        if s.counted
    }
    assert {tuple(cell) for cell in np.argwhere(np.isfinite(values))} == seen
    assert np.nanmin(values) == pytest.approx(3.0)
    assert np.nanmax(values) == pytest.approx(3.0)
    assert [m.object_id for m in moved_objects((compared.a, compared.b))] == ["chair-1"]


def test_curves_show_both_and_what_happened(compared):
    drawn = error_curves(compared.a, compared.b)
    assert drawn.startswith("<svg")
    for colour in ("#1f88d1", "#d9601f"):
        assert colour in drawn
    still = [replace(run, board=type(run.board)(())) for run in (compared.a, compared.b)]
    assert error_curves(*still) == ""


def test_the_page_needs_nothing_but_the_films_beside_it(compared, tmp_path):
    write_comparison(compared, tmp_path / "pages" / "one two.html")
    shutil.move(tmp_path / "pages", tmp_path / "moved")
    text = (tmp_path / "moved" / "one two.html").read_text()
    fetched = {
        f for f in re.findall(r'(?:src|href)="([^"]*)"', text) if f[:5] != "data:" and f[0] != "#"
    }
    assert fetched == {"one%20two-films/a.mp4", "one%20two-films/b.mp4"}
    copied = tmp_path / "moved" / "one two-films" / "b.mp4"
    assert copied.read_bytes() == compared.b.film.read_bytes()
    assert sorted(p.name for p in (tmp_path / "moved").rglob("*") if p.is_file()) == [
        "a.mp4",
        "b.mp4",
        "one two.html",
    ]
    assert text.count("<svg") == 2
    assert "got worse by more than 10 %" in text
    assert "B is a fork of A: the same to the bit until 0.5 s" in text
    assert '<tr class="fail"><td>chairs, place, mean</td><td>3</td><td>5</td>' in text


def test_times_of_the_films_are_those_of_their_frames(compared, tiny):
    text = render_comparison(compared, {"A": "a.mp4", "B": "b.mp4"})
    times = json.loads(re.search(r"const films = (.*);", text)[1])
    assert times["A"] == {"times": [seq / 10 for seq in range(tiny.frames)], "fps": 10.0}


def test_a_page_without_films_says_so_by_leaving_them_out(compared):
    text = render_comparison(compared, {})
    assert "<video" not in text
    assert "<script>" not in text


def test_other_versions_are_noted(compared, two_runs, in_tiny_scene, monkeypatch):
    from studio.compare import comparison

    infos = {}

    def other_info(folder):
        info = compared.a.info
        infos[folder] = info if not infos else replace(info, versions={"numpy": "9.9"})
        return infos[folder]

    monkeypatch.setattr(comparison, "read_info", other_info)
    found = read_comparison(*two_runs, tolerance=0.1)
    assert "numpy: missing in A, 9.9 in B." in found.notes


def test_runs_of_different_scenes_are_refused(compared, two_runs, in_tiny_scene, monkeypatch):
    from studio.compare import comparison

    other = replace(compared.a.info, scene="desk", scene_hash="f" * 64)
    monkeypatch.setattr(
        comparison, "read_info", lambda folder: compared.a.info if folder.name == "a" else other
    )
    with pytest.raises(ValueError, match="of scene 'desk', wanted 'tiny'"):
        read_comparison(*two_runs, tolerance=0.1)


def test_a_damaged_report_is_one_line(two_runs, in_tiny_scene, tmp_path):
    damaged = tmp_path / "damaged"
    shutil.copytree(two_runs[0], damaged)
    for text in ("{", "[]", '{"verb": "rehearse", "rows": [{"name": "x"}]}'):
        (damaged / "report.json").write_text(text)
        with pytest.raises(ValueError, match=r"report\.json: ") as refused:
            read_comparison(two_runs[0], damaged, tolerance=0.1)
        assert "\n" not in str(refused.value)


def test_a_folder_that_holds_no_run_is_named(two_runs, tmp_path):
    assert what_is_missing(two_runs[0]) is None
    assert "no such folder" in what_is_missing(tmp_path / "nowhere")
    assert "holds no report.json" in what_is_missing(tmp_path)
