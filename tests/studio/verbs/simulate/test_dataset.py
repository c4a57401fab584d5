"""`nexus simulate dataset`: what it prints, refuses, and that the evaluation reads it."""

from __future__ import annotations

import json

import pytest

from benchmarks.evaluate.dataset.layout import read_dataset
from scenes.package import save_package
from studio.cli import EXIT_DONE, EXIT_INPUT, main
from tests.scanned_cell import make_scan

SCENARIO = """
room = "desk"
duration_s = 0.3
[camera]
fps = 10
lens_size_px = 160
bitrate_mbps = 2.0
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    path = tmp_path_factory.mktemp("scenario") / "short.toml"
    path.write_text(SCENARIO)
    return path


@pytest.fixture(scope="module")
def folder(scenario, tmp_path_factory):
    out = tmp_path_factory.mktemp("sets") / "desk"
    words = ["simulate", "dataset", "desk", "--scenario", str(scenario), "--out", str(out)]
    assert main([*words, "--every", "2", "--photos", "0"]) == EXIT_DONE
    return out


def test_a_set_without_photos_is_read_but_cannot_be_prepared(folder):
    dataset = read_dataset(folder)
    sequence = dataset.sets["sequence"]
    assert [still.t_ns for still in sequence.stills] == [0, 200_000_000]
    assert set(dataset.objects) == set(sequence.stills[0].world_from_object)
    assert set(dataset.label_of) == {*dataset.objects, "person"}
    assert sequence.stills[0].labels.is_file()
    with pytest.raises(ValueError, match="no photos of the room"):
        dataset.photo_camera()
    assert main(["evaluate", "dataset", str(folder)]) == EXIT_INPUT


def test_it_says_what_it_has_checked(folder, capsys):
    assert main(["simulate", "dataset", "--check", str(folder), "--json"]) == EXIT_DONE
    found = json.loads(capsys.readouterr().out)
    assert found["form"] == "room-c"
    assert found["images"] == 4


def test_bad_input_is_one_line(folder, scenario, tmp_path, capsys):
    words = ["simulate", "dataset", "desk", "--scenario", str(scenario)]
    for more, said in (
        ([], "give --out"),
        (["--out", str(folder)], "already holds something"),
        (["--out", str(tmp_path / "a"), "--every", "0"], "at least 1"),
        (["--out", str(tmp_path / "a"), "--form", "bop", "--pictures", "video"], "no video"),
        (["--check", str(tmp_path)], "no data set"),
    ):
        assert main([*words, *more]) == EXIT_INPUT
        error = capsys.readouterr().err.strip().splitlines()
        assert said in error[-1]
    assert not (tmp_path / "a").exists()


def test_a_video_cannot_be_evaluated(scenario, tmp_path):
    words = ["simulate", "dataset", "desk", "--scenario", str(scenario), "--photos", "0"]
    assert main([*words, "--pictures", "video", "--out", str(tmp_path / "v")]) == EXIT_DONE
    with pytest.raises(ValueError, match="--pictures png"):
        read_dataset(tmp_path / "v")


def test_a_scan_that_nothing_stands_for_is_refused(tmp_path, capsys):
    save_package(make_scan().scene, tmp_path / "cell.gnx")
    command = ["simulate", "dataset", str(tmp_path / "cell.gnx"), "--out", str(tmp_path / "d")]
    assert main(command) == EXIT_INPUT
    assert "to rehearse with objects that were cut out of a scan" in capsys.readouterr().err
    assert not (tmp_path / "d").exists()
